#include "fit/givens/inexact_rig.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "core/rig/fingerprint.h"
#include "fit/fit_description.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// "normal.mass[13]", "speed (step_a.csv)".
std::string label(const FittedGiven& given) { return given.run.empty() ? given.name : given.name + " (" + given.run + ")"; }

}  // namespace

InexactRig::InexactRig(const FitProblem& stated, VectorXd off) : stated_(&stated), numbers_(stated.rig, stated.runs), z_(off.size() > 0 ? std::move(off) : VectorXd::Zero(numbers_.deviations())) {}

InexactRig::Step InexactRig::next_step(const Arrival& arrival) const {
  const JointInformation information = joint_information(arrival.joint, *slopes_);
  VectorXd downhill = information.downhill;
  const auto count = static_cast<Index>(information.free.size());
  downhill.tail(z_.size()) -= z_;
  MatrixXd all = information.of_data;
  all.diagonal().tail(z_.size()).array() += 1;
  const VectorXd scale = all.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * all * scale.asDiagonal();
  const VectorXd step = scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(downhill)));
  Step next{VectorXd::Zero(static_cast<Index>(arrival.joint.unknowns().size())), step.tail(z_.size()), std::sqrt(std::max(0.0, step.dot(downhill)))};
  for (Index a = 0; a < count; ++a) next.unknowns[information.free[static_cast<std::size_t>(a)]] = step[a];
  return next;
}

/// The fit at other numbers: theta by the step, and from there to its best.
InexactRig::Candidate InexactRig::moved(const Arrival& from, const Step& step, double part) const {
  const VectorXd there = z_ + part * step.deviations;
  auto problem = std::make_shared<FitProblem>();
  problem->rig = numbers_.rig_at(there);
  for (std::size_t r = 0; r < stated_->runs.size(); ++r) problem->runs.push_back(numbers_.run_at(r, there));
  problem->circulation = stated_->circulation;
  problem->effects = stated_->effects;
  problem->start = stated_->start;
  problem->progress = stated_->progress;
  const Basis& basis = from.model->basis();
  AeroelasticModel model(problem->rig, make_basis(problem->rig, basis.normal_modes, basis.torsion_modes), from.model->circulation());
  if (!problem->effects.empty()) model = model.with_effects(problem->effects);
  const auto shared = std::make_shared<const AeroelasticModel>(std::move(model));
  std::vector<RunResidual> runs;
  for (std::size_t r = 0; r < problem->runs.size(); ++r) {
    const RunResidual& known = from.joint.runs()[r];
    runs.emplace_back(*shared, problem->runs[r], from.windows[r]);
    runs.back().keep_noise_of(known);
    runs.back().start_from(known);
    runs.back().follow_in(known.finer());
    runs.back().set_aside(known.is_aside());
  }
  Arrival next{shared, from.windows, JointProblem(*shared, std::move(runs)), from.evaluations, from.converged, from.message};
  for (std::size_t i = 0; i < next.joint.unknowns().size(); ++i) {
    Unknown& u = next.joint.unknowns()[i];
    u = from.joint.unknowns()[i];
    const Parameter& p = next.joint.parameter(u);
    const double held_off = u.held ? p.start - from.joint.parameter(u).start : 0;  // what is held at the rig file's number goes with it
    u.value = std::clamp(u.value + held_off + part * step.unknowns[static_cast<Index>(i)], p.lower, p.upper);
  }
  solve(next);
  return {there, std::move(problem), std::move(next)};
}

double InexactRig::promises(const Arrival& arrival) {
  slopes_ = number_slopes(arrival, numbers_, z_);
  const double length = next_step(arrival).length;
  return length * length;
}

Arrival InexactRig::after_the_promised_step(const Arrival& arrival) {
  Candidate next = moved(arrival, next_step(arrival), 1);
  one_step_ = std::move(next.problem);
  return std::move(next.arrival);
}

double InexactRig::cost_of_deviations(const Arrival& arrival) const {
  const MatrixXd told = told_of_deviations(joint_information(arrival.joint, *slopes_), z_.size());
  const VectorXd known = Eigen::SelfAdjointEigenSolver<MatrixXd>(told).eigenvalues().cwiseMax(0);  // rounding takes those of what nothing tells below zero
  return z_.squaredNorm() + known.array().log1p().sum();
}

std::vector<Run> InexactRig::runs() const {
  std::vector<Run> runs;
  for (std::size_t r = 0; r < stated_->runs.size(); ++r) runs.push_back(numbers_.run_at(r, z_));
  return runs;
}

std::vector<FittedGiven> InexactRig::numbers() const {
  std::vector<FittedGiven> numbers = numbers_.numbers();
  const VectorXd off = numbers_.spread() * z_;
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i].value += off[static_cast<Index>(i)];
  return numbers;
}

void InexactRig::search(Arrival& arrival, double worth) {
  constexpr int most = 12, most_halvings = 6;
  constexpr double near = 0.05, hardly = 1.0 / 3;
  const auto tell = [&](const std::string& what) {
    if (stated_->progress) stated_->progress(what);
  };
  for (int round = 0; round < most; ++round) {
    tell("looking at the numbers of rig file and heads");
    slopes_ = number_slopes(arrival, numbers_, z_);  // anew: masses and stiffness move the runs alike to one part in thousands, and so must their slopes agree
    const Step step = next_step(arrival);
    const double promised = step.length * step.length, excess = arrival.joint.chi2() * (1 - 1 / arrival.reduced_chi2());
    if (step.length < near || promised < worth * excess) return;
    const double before = arrival.joint.chi2() + z_.squaredNorm();
    bool better = false;
    for (double part = 1; !better && part > std::pow(0.5, most_halvings); part /= 2) {
      try {
        Candidate next = moved(arrival, step, part);
        constexpr double enough = 1e-4;  // of what the step promises (L. Armijo, Pacific J. Math. 16 (1966) 1)
        better = next.cost() < before - enough * part * promised;
        if (!better) continue;
        arrival = std::move(next.arrival);
        problem_ = std::move(next.problem);
        z_ = std::move(next.z);
      } catch (const std::invalid_argument&) {  // no rig has such numbers
      }
    }
    if (!better && step.length < hardly) return;  // searches along laws with corners know chi-square no better
    if (!better) break;
  }
  arrival.converged = false;
  arrival.message = "no numbers within what rig file and runs state were found that fit best; are the stated uncertainties right?";
}

void InexactRig::describe(const JointProblem& joint, const InexactUncertainty& uncertainty, FitResult& result) const {
  for (std::size_t r = 0; r < result.runs.size(); ++r) result.runs[r].fingerprint = fingerprint(stated_->runs[r], stated_->rig);
  const MatrixXd& spread = numbers_.spread();
  const MatrixXd of_numbers = spread * uncertainty.of_deviations * spread.transpose();
  const VectorXd off = spread * z_;
  result.givens = numbers();
  for (std::size_t i = 0; i < result.givens.size(); ++i) {
    FittedGiven& given = result.givens[i];
    const auto row = static_cast<Index>(i);
    given.std_error = std::sqrt(of_numbers(row, row));
    constexpr double far = 3;
    const double shift = off[row] / given.stated_std;
    if (std::abs(shift) <= far) continue;
    result.warnings.push_back(fmt::format("{}: the recordings pull it to {:.6g} {}, {:.1f} of its standard deviations from the stated {:.6g}. Is it right, or stands it in for physics that is missing?", label(given),
                                          given.value, given.unit, shift, given.stated));
  }
  // Rows of the unknowns and of the steady loads, as describe_parameters lists them.
  const auto all = static_cast<Index>(joint.unknowns().size()), parameters = static_cast<Index>(result.parameters.size()), free = static_cast<Index>(uncertainty.parameters.free.size());
  MatrixXd with_numbers = MatrixXd::Zero(parameters, spread.rows());
  for (Index a = 0; a < free; ++a) with_numbers.row(uncertainty.parameters.free[static_cast<std::size_t>(a)]) = uncertainty.with_deviations.row(a) * spread.transpose();
  Index at = all;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const double unit = reading_of_steady_load(joint.runs()[r]);
    if (unit != 0) with_numbers.row(at++) = uncertainty.with_deviations.row(free + static_cast<Index>(r)) * spread.transpose() / unit;
  }
  VectorXd deviation(parameters);
  for (Index i = 0; i < parameters; ++i) {
    const double error = result.parameters[static_cast<std::size_t>(i)].std_error;
    deviation[i] = std::isfinite(error) ? error : 0;
  }
  result.joint_covariance.resize(parameters + spread.rows(), parameters + spread.rows());
  result.joint_covariance << deviation.asDiagonal() * result.correlation * deviation.asDiagonal(), with_numbers, with_numbers.transpose(), of_numbers;
}

}  // namespace unrig
