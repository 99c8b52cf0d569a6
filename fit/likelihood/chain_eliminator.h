#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "core/numerics/householder.h"
#include "fit/likelihood/eliminator.h"

namespace unrig::run_rows {

/// Rows of least squares over one stretch of time. Its unknowns: those that begin in it, the state that the stretches before it have led to, and those that all stretches share.
struct Link {
  Eigen::Index first = 0, own = 0;  ///< unknowns [first, first + own) of all begin here
  Eigen::MatrixXd rows;             ///< over [own | state | shared]
  Eigen::MatrixXd transition;       ///< the next link's state over [own | state]; none behind the last
};

/// Least squares over unknowns that come one after the other in time: orthogonal elimination of each link's own unknowns, from the last link to the first, as the rows that are left pass
/// through the transitions (Paige and Saunders, SIAM Journal on Numerical Analysis 14 (1977) 180, in the other direction: nothing is inverted, and modes that have died out do no harm).
/// What is left at the beginning is over the last unknowns alone. Time and memory go with the number of links; `factor` goes with the cube of the unknowns, `damped_step` with their square.
/// Unknowns that no row determines are left at zero.
class ChainEliminator {
 public:
  /// `begin`: the first link's state over the last unknowns, which are the `begin.cols()` last ones of all; the last `shared` of them are those that links share. `last_rows`: over the last ones.
  ChainEliminator(std::vector<Link> links, Eigen::Index unknowns, Eigen::MatrixXd begin, Eigen::Index shared, const Eigen::MatrixXd& last_rows);

  std::size_t links() const { return steps_.size(); }
  bool has_state(std::size_t link) const { return steps_[link].state > 0; }

  /// Columns on the right hand side of the rows: what the unknowns reach of them, and what lies beside that.
  struct Rotated {
    std::vector<Eigen::MatrixXd> own;     ///< by link
    Eigen::MatrixXd last;
    std::vector<Eigen::MatrixXd> beside;  ///< the same inner products as what is not reached
  };
  /// `right`: as the rows of each link; `last_right`: as the last rows.
  Rotated rotated(std::vector<Eigen::MatrixXd> right, const Eigen::MatrixXd& last_right) const;
  /// The unknowns, a column for each right hand side.
  Eigen::MatrixXd solve(const Rotated& rotated) const;
  /// R, upper triangular, with R^T R = the information matrix of all unknowns.
  Eigen::MatrixXd factor() const;
  /// Its last rows: R of what is known of the last unknowns with all others eliminated.
  Eigen::MatrixXd last_factor() const { return last_->factor(); }
  /// x with least |R (x - at)|^2 + |F x|^2, and R of both. `further`: rows F of each link, over [own | state | shared]; `last`: over the last unknowns.
  struct Held;
  Held held(const Eigen::VectorXd& at, const std::vector<Eigen::MatrixXd>& further, const Eigen::MatrixXd& last) const;
  /// Marquardt's (1963) step: s with least |R (s - full)|^2 + damping |D s|^2, D the lengths of R's columns.
  Eigen::VectorXd damped_step(const Eigen::VectorXd& full, double damping) const;
  /// Column j of (R^T R)^-1, of one of the last unknowns. Zero for one that the rows do not determine.
  Eigen::VectorXd covariance_column(Eigen::Index j) const;
  /// Of each link L with L L^T = the covariance of [own | state]; behind them that of the last unknowns.
  std::vector<Eigen::MatrixXd> covariance_roots() const;

 private:
  struct Step {
    Eigen::Index first = 0, own = 0, state = 0;
    std::optional<Eliminator> eliminate;  // of the own unknowns; none where nothing begins
    Eigen::MatrixXd beyond;               // what they are beside: rows over [state | shared]
    std::optional<Householder> rest;      // of the rows that are left, where these are many
    Eigen::MatrixXd transition;
  };
  Eigen::MatrixXd solved(const Eigen::MatrixXd& last, const std::vector<Eigen::MatrixXd>& own) const;
  /// Hands on the rows of R that each step has, over all unknowns.
  void for_each_row(const std::function<void(const Eigen::MatrixXd& rows)>& take) const;

  Eigen::Index unknowns_ = 0, shared_ = 0;
  Eigen::MatrixXd begin_;
  std::vector<Step> steps_;
  std::optional<Eliminator> last_;
};

struct ChainEliminator::Held {
  ChainEliminator chain;
  Eigen::VectorXd unknowns;
};

}  // namespace unrig::run_rows
