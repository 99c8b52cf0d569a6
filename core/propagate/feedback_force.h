#pragma once
#include <array>

#include "core/model/aeroelastic_model.h"

namespace unrig {

constexpr int most_law_parameters = 16;  ///< of one feedback
constexpr int most_law_arguments = 10;

/// f(z) of a feedback at the parameters in theta, and its derivatives.
struct FeedbackForce {
  double value = 0;
  std::array<double, most_law_arguments> slope{};     ///< in each argument
  std::array<double, most_law_parameters> partial{};  ///< in each parameter of the law
};

/// `z`: as many arguments as `feedback` has.
inline FeedbackForce force_of(const Feedback& feedback, const double* z, const Eigen::VectorXd& theta) {
  FeedbackForce force;
  force.value = feedback.law(z, theta.data() + feedback.first_parameter, force.slope.data(), force.partial.data());
  return force;
}

/// A law of one argument as a Feedback::Law.
template <double (*law)(double z, const double* p, double& slope, double* partial)>
double of_one(const double* z, const double* p, double* slope, double* partial) {
  return law(*z, p, *slope, partial);
}

/// The arguments of all feedbacks of a system in turn.
struct Arguments {
  Arguments() = default;
  explicit Arguments(const LinearSystem& system) {
    for (std::size_t i = 0; i < system.feedback.size(); ++i) {
      first.push_back(static_cast<Eigen::Index>(owner.size()));
      owner.insert(owner.end(), static_cast<std::size_t>(system.feedback[i].sees.rows()), static_cast<Eigen::Index>(i));
    }
    sees.resize(count(), system.states());
    for (std::size_t i = 0; i < system.feedback.size(); ++i) sees.middleRows(first[i], system.feedback[i].sees.rows()) = system.feedback[i].sees;
  }
  Eigen::Index count() const { return static_cast<Eigen::Index>(owner.size()); }

  std::vector<Eigen::Index> owner;  ///< of each argument, the feedback whose it is
  std::vector<Eigen::Index> first;  ///< of each feedback, its first argument
  Eigen::MatrixXd sees;             ///< arguments x states
};

}  // namespace unrig
