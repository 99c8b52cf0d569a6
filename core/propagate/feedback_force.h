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

/// The arguments of all feedbacks of a system in turn, z = sees x + sees_input u, u all input columns of B, the feedbacks' own forces among them: what a law sees of
/// x' = A x + B u is put through A and B, with their partials.
struct Arguments {
  Arguments() = default;
  explicit Arguments(const LinearSystem& system) {
    for (std::size_t i = 0; i < system.feedback.size(); ++i) {
      first.push_back(static_cast<Eigen::Index>(owner.size()));
      owner.insert(owner.end(), static_cast<std::size_t>(system.feedback[i].sees.rows()), static_cast<Eigen::Index>(i));
    }
    Eigen::MatrixXd of_states(count(), system.states()), of_rates = Eigen::MatrixXd::Zero(count(), system.states());
    for (std::size_t i = 0; i < system.feedback.size(); ++i) {
      const Feedback& f = system.feedback[i];
      of_states.middleRows(first[i], f.sees.rows()) = f.sees;
      if (f.sees_rates.rows() > 0) of_rates.middleRows(first[i], f.sees_rates.rows()) = f.sees_rates;
    }
    accelerations = !of_rates.isZero(0);
    sees = DualMatrix(of_states, system.A.parameters());
    sees_input = DualMatrix(Eigen::MatrixXd::Zero(count(), system.B.cols()), system.B.parameters());
    if (!accelerations) return;
    sees = sees + of_rates * system.A;
    sees_input = of_rates * system.B;
  }
  Eigen::Index count() const { return static_cast<Eigen::Index>(owner.size()); }

  std::vector<Eigen::Index> owner;  ///< of each argument, the feedback whose it is
  std::vector<Eigen::Index> first;  ///< of each feedback, its first argument
  DualMatrix sees;                  ///< arguments x states
  DualMatrix sees_input;            ///< arguments x inputs; zero where no law looks at rates
  bool accelerations = false;       ///< whether one does
};

}  // namespace unrig
