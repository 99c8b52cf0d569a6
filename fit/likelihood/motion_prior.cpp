#include "fit/likelihood/motion_prior.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/likelihood/run_linearised.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int order = 4;

/// Differences of a smooth oscillation vanish twice a period. Where the shaft moves for long, five of them that happen to lie there would make the motion stiff, and the band of the
/// load too narrow (a motion of twelve frequencies with 800 knots: nine standard deviations off in groups of five, two in groups of twenty): a fortieth of the window's knots.
Index knots_per_group(const MotionBasis::Window& window) {
  constexpr Index least = 5, most = 20, groups = 40;
  return std::clamp<Index>(window.knots.length() / window.stride / groups, least, most);
}

/// Fourth differences of the fine coefficients over everything a window touches, one row each, over the motion unknowns.
MatrixXd differences(const MotionBasis& motion, const MotionBasis::Window& window) {
  const Index s = window.stride, first = std::max<Index>(0, window.knots.first - order * s), last = std::min(motion.samples(), window.knots.last + (order + 4) * s);
  MatrixXd c = MatrixXd::Zero(last - first, motion.unknowns());
  for (Index j = 0; j < motion.unknowns(); ++j) {
    const MotionBasis::Column& column = motion.columns()[static_cast<std::size_t>(j)];
    for (Index k = std::max(first, column.first); k < last; ++k) c(k - first, j) = k - column.first < column.value.size() ? column.value[k - column.first] : column.tail;
  }
  for (int k = 0; k < order; ++k) {
    const Index left = c.rows() - s;
    c = (c.bottomRows(left) - c.topRows(left)).eval();
  }
  return c;
}

/// Neighbouring differences that share a scale: rows over the few unknowns that they touch, from `first` on; the window's first knot, and its stride.
struct Group {
  MatrixXd rows;
  Index first, window, stride;
};

/// Empty where nothing moves.
Group touched(const MatrixXd& rows, const MotionBasis::Window& window) {
  Index first = 0, last = rows.cols();
  while (first < last && rows.col(first).isZero(0)) ++first;
  while (last > first && rows.col(last - 1).isZero(0)) --last;
  return {rows.middleCols(first, last - first), first, window.knots.first, window.stride};
}

/// Each group at least as wide as the wider of its neighbours in the same window: a motion that begins between two samples turns from smooth to rough within a group, and the
/// band of the load over the whole record would be too narrow there (tests/studies/correct_study: it holds in 82 % of the nods without).
std::vector<double> as_wide_as_neighbours(const std::vector<double>& precision, const std::vector<Group>& groups) {
  std::vector<double> widest = precision;
  for (std::size_t g = 1; g < precision.size(); ++g) {
    if (groups[g].window != groups[g - 1].window) continue;
    widest[g] = std::min(widest[g], precision[g - 1]);
    widest[g - 1] = std::min(widest[g - 1], precision[g]);
  }
  return widest;
}

/// What a round finds of a group's differences d: sum d^2, and how many of them the data determine.
struct Roughness {
  double squares = 0, determined = 0;
};

/// 1 / tau_g^2 with the largest  sum_g -(gamma_g ln tau_g^2 + sum d^2 / tau_g^2) / 2 - sum_g (ln tau_g^2 - ln tau_(g-1)^2)^2 / (2 spread^2),  the second sum over neighbours in
/// a window, spread = their stride: a motion that dies away like exp(-t / 10 samples) changes tau^2 by e over five samples. Newton's method in ln tau^2, a tridiagonal system.
std::vector<double> most_probable(const std::vector<Group>& groups, const std::vector<Roughness>& found, const std::vector<double>& precision, double floor) {
  constexpr double longest = 2, arrived = 1e-3;  // of ln tau^2
  constexpr int steps = 50;
  const auto count = static_cast<Index>(groups.size());
  VectorXd level = -Eigen::Map<const VectorXd>(precision.data(), count).array().log();  // ln tau^2
  for (int step = 0; step < steps; ++step) {
    VectorXd diagonal(count), beside = VectorXd::Zero(count), slope(count);  // of the negative logarithm; `beside`: with the group before
    for (Index g = 0; g < count; ++g) {
      const Roughness& own = found[static_cast<std::size_t>(g)];
      const double in_scales = own.squares * std::exp(-level[g]);
      slope[g] = 0.5 * (own.determined - in_scales);
      diagonal[g] = 0.5 * std::max(in_scales, 0.5 * own.determined);
      if (g == 0 || groups[static_cast<std::size_t>(g)].window != groups[static_cast<std::size_t>(g - 1)].window) continue;
      const double spread = static_cast<double>(groups[static_cast<std::size_t>(g)].stride), alike = 1 / (spread * spread), off = alike * (level[g] - level[g - 1]);
      slope[g] += off, slope[g - 1] -= off;
      diagonal[g] += alike, diagonal[g - 1] += alike;
      beside[g] = -alike;
    }
    for (Index g = 1; g < count; ++g) {
      const double share = beside[g] / diagonal[g - 1];
      diagonal[g] -= share * beside[g];
      slope[g] -= share * slope[g - 1];
    }
    VectorXd move(count);
    for (Index g = count - 1; g >= 0; --g) move[g] = (slope[g] - (g + 1 < count ? beside[g + 1] * move[g + 1] : 0)) / diagonal[g];
    const double largest = move.cwiseAbs().maxCoeff();
    level -= std::min(1.0, longest / std::max(largest, 1e-300)) * move;
    if (largest < arrived) break;
  }
  std::vector<double> next(groups.size());
  for (Index g = 0; g < count; ++g) next[static_cast<std::size_t>(g)] = 1 / std::max(floor, std::exp(level[g]));
  return next;
}

}  // namespace

MatrixXd motion_prior(const RunResidual& residual, const VectorXd& theta) {
  const MotionBasis& motion = residual.motion();
  if (motion.unknowns() == 0) return {};
  const Index unknowns = residual.linear_unknowns();
  std::vector<Group> groups;
  for (const MotionBasis::Window& window : motion.windows()) {
    const MatrixXd d = differences(motion, window);
    const Index size = knots_per_group(window) * window.stride;
    for (Index first = 0; first < d.rows(); first += size) {
      Group group = touched(d.middleRows(first, std::min(size, d.rows() - first)), window);
      if (group.rows.cols() > 0) groups.push_back(std::move(group));
    }
  }

  RunResidual free = residual;
  free.set_motion_prior({});
  const RunResidual::Solution solution = free.solve(theta);
  if (!std::isfinite(solution.chi2)) return {};
  Index count = 0;
  for (const Group& group : groups) count += group.rows.rows();
  MatrixXd all = MatrixXd::Zero(count, unknowns);
  count = 0;
  for (const Group& group : groups) {
    all.block(count, group.first, group.rows.rows(), group.rows.cols()) = group.rows;
    count += group.rows.rows();
  }
  const RunResidual::MotionRows rows = free.by_piece(std::move(all));

  const auto scales = [&](const std::vector<double>& by_group) {
    VectorXd scale(rows.all.rows());
    Index row = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      scale.segment(row, groups[g].rows.rows()).setConstant(std::sqrt(by_group[g]));
      row += groups[g].rows.rows();
    }
    return scale;
  };
  // Scales from very wide downwards; each round is one pass of MacKay's fixed point.
  std::vector<double> precision(groups.size());
  const double wide = 1e3 * residual.angle_sigma();
  std::fill(precision.begin(), precision.end(), 1 / (wide * wide));
  constexpr int rounds = 40;
  std::vector<Roughness> found(groups.size());
  for (int round = 0; round < rounds; ++round) {
    const RunResidual::HeldMotion held = free.hold_motion(solution, rows, scales(precision));
    double change = 0;
    Index row = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const Group& group = groups[g];
      found[g].determined = std::max(1e-3, static_cast<double>(group.rows.rows()) - held.variance.segment(row, group.rows.rows()).sum());
      found[g].squares = (group.rows * held.linear.segment(group.first, group.rows.cols())).squaredNorm();
      row += group.rows.rows();
    }
    // A group of smooth motion would let its scale run to zero; a thousandth of the angle's noise is smooth enough.
    const std::vector<double> next = most_probable(groups, found, precision, 1e-6 * residual.angle_sigma() * residual.angle_sigma());
    for (std::size_t g = 0; g < groups.size(); ++g) change = std::max(change, std::abs(std::log(next[g] / precision[g])));
    precision = next;
    if (change < 0.02) break;
  }

  precision = as_wide_as_neighbours(precision, groups);

  return scales(precision).asDiagonal() * rows.all;
}

}  // namespace unrig
