#pragma once
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fit/search/arrival.h"
#include "fit/search/decays_first.h"
#include "fit/search/first_order.h"
#include "fit/search/residual_lines.h"

namespace unrig {

/// A fit that effects are to join, and all that tells where the search for any of them begins.
class Screening {
 public:
  /// Looks at both as long as it lives.
  Screening(const FitProblem& problem, const Arrival& without);

  struct Extended {
    Arrival arrival;
    double left = 0;   ///< chi-square that one linear step in all unknowns promises to leave; infinite where the model runs away
    double share = 0;  ///< which it promises to remove of what a step in the unknowns of the fit leaves: a fit that ended early is no mismatch that any effect takes away
  };
  /// With `model`, the one with the effects `added`, and nothing searched for yet: values of the fit without them where it has them, the best of their starts for the effects. Starts of a law are
  /// compared, and what it promises is told, to first order about the fit (fit/search/first_order.h); of other effects by chi-square, all linear unknowns at their best.
  Extended extend(const std::shared_ptr<const AeroelasticModel>& model, const std::vector<std::string>& added) const;

 private:
  /// A fit, what it leaves and its first order, which does not move.
  struct Base {
    explicit Base(JointProblem at) : joint(std::move(at)), first_order(joint), lines(joint) {}
    Base(const Base&) = delete;
    Base& operator=(const Base&) = delete;
    JointProblem joint;
    FirstOrder first_order;
    ResidualLines lines;
  };
  const Base& judge() const { return at_the_rig_ ? *at_the_rig_ : base_; }
  bool is_law(const JointProblem& joint, const std::string& id) const;
  double largest_argument_of_readings(const JointProblem& joint) const;
  std::vector<Eigen::VectorXd> starts_of(JointProblem& joint, const std::string& id) const;
  JointProblem best_start(const JointProblem& joint, const std::string& id) const;

  const FitProblem& problem_;
  const Arrival& without_;
  Base base_;
  double left_ = 0;  // by a step in the unknowns of the fit
  std::unique_ptr<const Base> at_the_rig_;     // where parameters of the fit have gone astray: what a rig moves by there says nothing of the size of a force
  std::optional<BesideUnknownForces> beside_;  // then, where there are decays
};

/// With `model`, the one of other effects: values, noise and c of the fit `without` them where it has them.
Arrival transferred(const FitProblem& problem, const Arrival& without, const std::shared_ptr<const AeroelasticModel>& model);

/// Chi-square that one linear step in all unknowns leaves; infinite where the model runs away from where it would start.
double left_by_a_step(const JointProblem& joint);

}  // namespace unrig
