#pragma once
#include <Eigen/QR>
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/exact_step.h"
#include "fit/run_residual.h"

// What RunResidual's arithmetic shares between its linear and its nonlinear path. Not for others to include.

namespace unrig {

namespace run_rows {

/// The upper triangular (or trapezoidal) factor of `rows`: the same inner products in no more rows than columns.
inline Eigen::MatrixXd compress(Eigen::MatrixXd rows) {
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(rows);  // in place
  return rows.topRows(std::min(rows.rows(), rows.cols())).triangularView<Eigen::Upper>();
}

inline Eigen::MatrixXd stacked(const std::vector<Eigen::MatrixXd>& blocks, Eigen::Index columns) {
  Eigen::Index total = 0;
  for (const Eigen::MatrixXd& block : blocks) total += block.rows();
  Eigen::MatrixXd stack(total, columns);
  Eigen::Index row = 0;
  for (const Eigen::MatrixXd& block : blocks) {
    stack.middleRows(row, block.rows()) = block;
    row += block.rows();
  }
  return stack;
}

/// Least squares by column-scaled QR. Columns that the rows do not determine (a state that no channel sees) are left at zero.
class Eliminator {
 public:
  explicit Eliminator(const Eigen::MatrixXd& columns) : scale_(columns.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse()) {
    constexpr double rank_tolerance = 1e-11;
    const Eigen::MatrixXd scaled = columns * scale_.asDiagonal();
    quick_.compute(scaled);
    if (columns.rows() >= columns.cols() && (columns.cols() == 0 || quick_.matrixQR().diagonal().cwiseAbs().minCoeff() > rank_tolerance)) return;
    pivoted_.setThreshold(rank_tolerance);
    pivoted_.compute(scaled);
    deficient_ = true;
  }
  Eigen::Index rank() const { return deficient_ ? pivoted_.rank() : scale_.size(); }
  /// Coordinates of `rows` in the columns' space (the first `rank` rows) and beside it.
  Eigen::MatrixXd rotated(const Eigen::MatrixXd& rows) const {
    return deficient_ ? Eigen::MatrixXd(pivoted_.householderQ().setLength(pivoted_.rank()).adjoint() * rows) : Eigen::MatrixXd(quick_.householderQ().adjoint() * rows);
  }
  /// Solution of R x = rotated, back in the columns' own scale.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& rotated) const {
    const Eigen::Index r = rank();
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(scale_.size(), rotated.cols());
    if (deficient_) {
      x.topRows(r) = pivoted_.matrixQR().topLeftCorner(r, r).triangularView<Eigen::Upper>().solve(rotated.topRows(r));
      x = pivoted_.colsPermutation() * x;
    } else {
      x = quick_.matrixQR().topLeftCorner(r, r).triangularView<Eigen::Upper>().solve(rotated.topRows(r));
    }
    return scale_.asDiagonal() * x;
  }
  /// R with R^T R = the columns' information matrix. Only where all columns are determined is it regular.
  Eigen::MatrixXd factor() const {
    const Eigen::Index n = scale_.size();
    Eigen::MatrixXd r = Eigen::MatrixXd::Zero(n, n);
    if (deficient_) {
      const Eigen::Index k = rank();
      Eigen::MatrixXd permuted = Eigen::MatrixXd::Zero(n, n);
      permuted.topRows(k) = Eigen::MatrixXd(pivoted_.matrixQR().topRows(k).triangularView<Eigen::Upper>());
      r = permuted * pivoted_.colsPermutation().transpose();
      r = compress(r);
    } else {
      r = quick_.matrixQR().topRows(n).triangularView<Eigen::Upper>();
    }
    return r * scale_.cwiseInverse().asDiagonal();
  }

 private:
  Eigen::VectorXd scale_;
  Eigen::HouseholderQR<Eigen::MatrixXd> quick_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> pivoted_;
  bool deficient_ = false;
};

}  // namespace run_rows

/// The model at one theta, without partials: its exact step, what the inputs alone do, where the unknown motion takes the states, and the rows
/// of the linear unknowns.
struct RunResidual::Linearised {
  LinearSystem system;
  ExactStep step;
  Eigen::MatrixXd known;          // response to the measured inputs, samples x channels, empty without
  Eigen::MatrixXd spline;         // states after a unit spline, n x samples
  Eigen::MatrixXd spline_summed;  // and their running sum: states after splines at every sample
  std::vector<Eigen::MatrixXd> free;  // rows of the free response per channel, for the longest segment at rest

  /// One channel over one segment. A segment at rest spans only the free response and the offset: `at_rest` rotates its rows so that the first
  /// `kept` of them hold all that c can reach, and the others only what is left.
  struct Block {
    Interval samples;
    bool moving = false;
    Eigen::Index channel = 0, kept = 0;
    std::shared_ptr<const Eigen::HouseholderQR<Eigen::MatrixXd>> at_rest;
    Eigen::MatrixXd rows;   // nonlinear systems: d y / d c where the shaft moves, else d y / d state at the segment's start
    Eigen::MatrixXd start;  // and that state's d / d c

    /// Sets up the rotation of a segment at rest, from the free response `rows` of its channel; returns what c does to the rows that are kept.
    Eigen::MatrixXd rotate(const Eigen::VectorXd& w, const Eigen::Ref<const Eigen::MatrixXd>& free_rows, const Eigen::MatrixXd& start_slope, Eigen::Index offset) {
      const Eigen::Index states = free_rows.cols();
      Eigen::MatrixXd span(w.size(), states + 1);
      span.leftCols(states) = w.asDiagonal() * free_rows;
      span.col(states) = w;
      kept = std::min(w.size(), states + 1);
      at_rest = std::make_shared<const Eigen::HouseholderQR<Eigen::MatrixXd>>(std::move(span));
      const Eigen::MatrixXd triangle = at_rest->matrixQR().topRows(kept).triangularView<Eigen::Upper>();
      Eigen::MatrixXd reach = triangle.leftCols(states) * start_slope;
      reach.col(offset) += triangle.col(states);
      return reach;
    }
    /// Weighted rows of this block: those that c reaches, and the others.
    std::pair<Eigen::MatrixXd, Eigen::MatrixXd> split(Eigen::MatrixXd all) const {
      if (moving) return {std::move(all), Eigen::MatrixXd()};
      all.applyOnTheLeft(at_rest->householderQ().adjoint());
      return {all.topRows(kept), all.bottomRows(all.rows() - kept)};
    }
  };
  std::vector<Block> blocks;
  std::shared_ptr<const Linearised> tangents;  // of a nonlinear run with prescribed motion: its equivalent linear system, which c is searched along

  /// Solves the stacked rows [c | y] for c, beside a sum of squares that c cannot reach.
  void settle(const std::vector<Eigen::MatrixXd>& rows, Eigen::Index unknowns, double unreachable) {
    const Eigen::MatrixXd stack = run_rows::stacked(rows, unknowns + 1);
    eliminate = std::make_unique<run_rows::Eliminator>(stack.leftCols(unknowns));
    const Eigen::MatrixXd rotated = eliminate->rotated(stack.rightCols(1));
    linear = eliminate->solve(rotated);
    chi2 = unreachable + rotated.bottomRows(rotated.rows() - eliminate->rank()).squaredNorm();
  }
  std::unique_ptr<run_rows::Eliminator> eliminate;
  Eigen::VectorXd linear;
  double chi2 = 0;
};

}  // namespace unrig
