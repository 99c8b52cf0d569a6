#pragma once
#include <array>

#include "core/aeroelastic_model.h"

namespace unrig {

constexpr int most_law_parameters = 8;  ///< of one feedback

/// f(z) of a feedback at the parameters in theta, and its derivatives.
struct FeedbackForce {
  double value = 0;
  double slope = 0;                                   ///< in z
  std::array<double, most_law_parameters> partial{};  ///< in each parameter of the law
};

inline FeedbackForce force_of(const Feedback& feedback, double z, const Eigen::VectorXd& theta) {
  FeedbackForce force;
  force.value = feedback.law(z, theta.data() + feedback.first_parameter, force.slope, force.partial.data());
  return force;
}

}  // namespace unrig
