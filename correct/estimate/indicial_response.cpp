#include "correct/estimate/indicial_response.h"

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double wanted = 0.05;  ///< relative standard deviation that counts as known

VectorXd spread_evenly(double first, double last, Index per_decade) {
  const auto count = static_cast<Index>(std::ceil(static_cast<double>(per_decade) * std::log10(last / first))) + 1;
  return (VectorXd::LinSpaced(count, 0, 1) * std::log(last / first)).array().exp() * first;
}

/// Rows over theta of a quantity f(rate_k, x_i) that every amplitude is multiplied by.
template <class F>
MatrixXd amplitude_rows(const AeroelasticModel& model, Index parameters, const VectorXd& x, F f) {
  MatrixXd rows = MatrixXd::Zero(x.size(), parameters);
  for (Index k = 0; k < model.circulation().rate.size(); ++k)
    for (Index i = 0; i < x.size(); ++i) rows(i, model.circulation_parameter(k)) = f(model.circulation().rate[k], x[i]);
  return rows;
}

MatrixXd response_rows(const AeroelasticModel& model, Index parameters, const VectorXd& semichords) {
  return amplitude_rows(model, parameters, semichords, [](double rate, double s) { return -std::exp(-rate * s); });
}

/// Where and how surely it falls.
void test_monotone(const AeroelasticModel& model, const VectorXd& theta, const UncertaintyBudget& budget, IndicialResponse& r) {
  const Index parameters = theta.size();
  const MatrixXd rows = amplitude_rows(model, parameters, r.semichords, [](double rate, double s) { return rate * std::exp(-rate * s); });
  const MatrixXd by_z = rows * budget.root().topRows(parameters);
  const VectorXd in_deviations = (rows * theta).cwiseQuotient(by_z.rowwise().norm());
  Index at = 0;
  const double least = in_deviations.minCoeff(&at);
  r.steepest_fall = least < 0 ? r.semichords[at] : std::numeric_limits<double>::infinity();
  if (least >= 0) return;
  const double both_sides = std::erfc(-least / std::numbers::sqrt2), kappa = curve_length(by_z);
  r.monotone_p = std::min(1.0, 0.5 * (kappa / std::numbers::pi * std::exp(-least * least / 2) + both_sides));
}

void find_bandwidth(const AeroelasticModel& model, const VectorXd& theta, const UncertaintyBudget& budget, double longest, double semichords_per_second,
                    IndicialResponse& r) {
  constexpr Index per_decade = 20;
  const Index parameters = theta.size();
  if (!(2 * std::numbers::pi / longest < model.circulation().rate.maxCoeff())) return;  // so short a record knows none
  const VectorXd reduced = spread_evenly(2 * std::numbers::pi / longest, model.circulation().rate.maxCoeff(), per_decade);  // w b / U
  using Complex = std::complex<double>;
  const auto term = [](double rate, double w) { return -Complex(0, w) / Complex(rate, w); };
  const MatrixXd real = amplitude_rows(model, parameters, reduced, [&](double rate, double w) { return term(rate, w).real(); });
  const MatrixXd imaginary = amplitude_rows(model, parameters, reduced, [&](double rate, double w) { return term(rate, w).imag(); });
  const MatrixXd root = budget.root().topRows(parameters);
  const VectorXd size = ((real * theta).array() + 1).square() + (imaginary * theta).array().square();
  const VectorXd variance = (real * root).rowwise().squaredNorm() + (imaginary * root).rowwise().squaredNorm();
  Index first = 0, longest_run = 0;
  for (Index i = 0, run = 0; i < reduced.size(); ++i) {
    run = variance[i] < wanted * wanted * size[i] ? run + 1 : 0;
    if (run > longest_run) longest_run = run, first = i + 1 - run;
  }
  if (longest_run == 0) return;
  const double hertz = semichords_per_second / (2 * std::numbers::pi);
  r.lowest = reduced[first] * hertz;
  r.highest = reduced[first + longest_run - 1] * hertz;
}

}  // namespace

void IndicialResponse::take_tests_of(const IndicialResponse& other) {
  at_step = other.at_step;
  at_step_std = other.at_step_std;
  steepest_fall = other.steepest_fall;
  monotone_p = other.monotone_p;
}

VectorXd response_semichords(double longest) {
  constexpr Index per_decade = 40;
  constexpr double shortest = 0.01;
  return spread_evenly(shortest, std::max(longest, 2 * shortest), per_decade);
}

VectorXd indicial_values(const AeroelasticModel& model, const VectorXd& theta, const VectorXd& semichords) {
  return (response_rows(model, theta.size(), semichords) * theta).array() + 1;
}

IndicialResponse indicial_response(const AeroelasticModel& model, const VectorXd& theta, const UncertaintyBudget& budget, double longest,
                                   double semichords_per_second) {
  const Index parameters = theta.size(), unknowns = budget.root().rows() - parameters;
  IndicialResponse r;
  r.semichords = response_semichords(longest);
  r.value = indicial_values(model, theta, r.semichords);
  MatrixXd rows = response_rows(model, parameters, r.semichords);
  const MatrixXd nothing = MatrixXd::Zero(r.value.size(), unknowns);
  r.uncertainty = budget.of(rows, nothing);
  const Index slope = model.index("normal_force_slope");
  r.per_radian = theta[slope] * r.value;
  rows *= theta[slope];
  rows.col(slope) = r.value;
  r.per_radian_std = budget.of(rows, nothing).std;

  const VectorXd step = VectorXd::Zero(1);
  r.at_step = indicial_values(model, theta, step)[0];
  r.at_step_std = budget.of(response_rows(model, parameters, step), MatrixXd::Zero(1, unknowns)).std[0];
  r.trusted_from = std::numeric_limits<double>::infinity();
  for (Index i = r.value.size() - 1; i >= 0 && r.uncertainty.std[i] < wanted * std::abs(r.value[i]); --i) r.trusted_from = r.semichords[i];
  test_monotone(model, theta, budget, r);
  find_bandwidth(model, theta, budget, longest, semichords_per_second, r);
  return r;
}

}  // namespace unrig
