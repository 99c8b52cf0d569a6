#include "fit/uncertainty/undetermined.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "fit/likelihood/modal_frequencies.h"

namespace unrig {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A mode of the rig file above half of every run's sampling rate stays what the file says.
void hold_modes_above_nyquist(JointProblem& joint, MatrixXd& jacobian) {
  const AeroelasticModel& model = joint.model();
  const double nyquist = highest_nyquist(joint.runs());
  for (std::size_t i = 0; i < model.rig().modal.size(); ++i) {
    if (modal_frequency(model, joint.theta(0), i) < nyquist) continue;
    const ModalPlace place = place_of_mode(model, i);
    for (std::size_t k = 0; k < joint.unknowns().size(); ++k) {
      Unknown& u = joint.unknowns()[k];
      if (u.parameter != place.mass && u.parameter != place.stiffness && u.parameter != place.damping && u.parameter != place.participation) continue;
      jacobian.col(static_cast<Index>(k)).setZero();
      u.why_held = fmt::format("Its mode lies above half the sampling rate of these runs, {:.4g} Hz", nyquist);
    }
  }
}

bool hold_undetermined(JointProblem& joint) {
  for (Unknown& u : joint.unknowns()) u.why_held.clear();
  const JointProblem::Linearisation lin = joint.linearise();
  MatrixXd jacobian = lin.jacobian;
  const bool told = jacobian.allFinite() && std::any_of(lin.run_chi2.begin(), lin.run_chi2.end(), [](double chi2) { return std::isfinite(chi2); });
  if (!told) jacobian.setIdentity();
  hold_modes_above_nyquist(joint, jacobian);
  std::vector<Index> order(joint.unknowns().size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
  const auto last_resort = [&](Index i) {
    const Parameter& p = joint.parameter(joint.unknowns()[static_cast<std::size_t>(i)]);
    return p.role == Role::mass && p.mode >= 0 ? 1 : 0;
  };
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return last_resort(a) < last_resort(b); });

  constexpr double dependent = 1e-6;  // sine of the angle to the span of the others; exact derivatives leave 1e-10 where it is truly zero
  std::vector<VectorXd> span;
  for (Index i : order) {
    VectorXd rest = jacobian.col(i);
    const double length = rest.norm();
    for (int pass = 0; pass < 2; ++pass)
      for (const VectorXd& direction : span) rest -= direction.dot(rest) * direction;
    Unknown& unknown = joint.unknowns()[static_cast<std::size_t>(i)];
    unknown.held = !(length > 0) || rest.norm() < dependent * length;
    if (unknown.held && unknown.why_held.empty()) unknown.why_held = length > 0 ? "These runs determine it only together with others" : "These runs do not respond to it";
    if (!unknown.held) span.push_back(rest.normalized());
  }
  return told;
}

bool is_damping_ratio(const Parameter& p) { return p.role == Role::damping && p.unit == "1"; }

double ignorance(const Parameter& p, double value) {
  return is_damping_ratio(p) ? 0.2 : 0.5 * std::max(std::abs(p.start), std::abs(value));
}

double start_of(const Parameter& parameter, const StartValues& starts) {
  const auto own = starts.find(parameter.name);
  return own == starts.end() ? parameter.start : own->second;
}

/// The least damping ratio that a decay in these runs can show, 1 / (omega T): less leaves no mark over the longest of them.
double least_visible_damping(const JointProblem& joint, const Parameter& p) {
  const Basis& basis = joint.model().basis();
  if ((p.torsion ? basis.torsion_modes : basis.normal_modes) == 0) return 0;
  double longest = 0, scale = 1;
  for (const RunResidual& run : joint.runs()) longest = std::max(longest, run.run().dt * static_cast<double>(run.run().samples()));
  for (const Unknown& u : joint.unknowns())
    if (const Parameter& other = joint.parameter(u); other.role == Role::stiffness && other.torsion == p.torsion) scale = u.value;
  return 1 / (std::sqrt(scale) * basis.omega[p.torsion ? basis.normal_modes : 0] * longest);
}

/// A standard error that says the runs do not determine the unknown. The damping of a mode that is hardly excited is where a resonance is mistaken for
/// a line of the noise: such lines are four or five times their own standard error at most, and narrow, which looks like little damping.
double most_error(const JointProblem& joint, const Unknown& u) {
  const Parameter& p = joint.parameter(u);
  constexpr double part = 0.25;
  return is_damping_ratio(p) ? part * std::max(u.value, least_visible_damping(joint, p)) : ignorance(p, u.value);
}

bool hold_weak(JointProblem& joint, const ParameterUncertainty& uncertainty, const StartValues& starts) {
  bool held = false;
  std::vector<Index> free = uncertainty.free;
  MatrixXd covariance = uncertainty.covariance();
  while (!free.empty()) {
    Index weakest = -1;
    double most = 1;
    for (Index a = 0; a < covariance.rows(); ++a) {
      const Unknown& u = joint.unknowns()[static_cast<std::size_t>(free[static_cast<std::size_t>(a)])];
      const double weak = std::sqrt(covariance(a, a)) / most_error(joint, u);
      if (weak >= most) weakest = a, most = weak;
    }
    if (weakest < 0) break;
    Unknown& u = joint.unknowns()[static_cast<std::size_t>(free[static_cast<std::size_t>(weakest)])];
    u.why_held = fmt::format("These runs hardly respond to it (one standard deviation would be {:.2g})", std::sqrt(covariance(weakest, weakest)));
    u.value = start_of(joint.parameter(u), starts);
    u.held = held = true;
    // The others once it is known.
    const VectorXd column = covariance.col(weakest);
    covariance -= column * column.transpose() / column[weakest];
    std::vector<Index> others;
    for (Index a = 0; a < covariance.rows(); ++a)
      if (a != weakest) others.push_back(a);
    covariance = MatrixXd(covariance(others, others));
    free.erase(free.begin() + weakest);
  }
  return held;
}

HeldInfluence held_influence(const JointProblem& joint) {
  const auto& unknowns = joint.unknowns();
  HeldInfluence influence;
  influence.slope = influence.shift = MatrixXd::Zero(static_cast<Index>(unknowns.size()), 0);
  if (std::none_of(unknowns.begin(), unknowns.end(), [](const Unknown& u) { return u.held; })) return influence;
  const MatrixXd jacobian = joint.linearise().jacobian;
  std::vector<Index> free;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto column = static_cast<Index>(i);
    if (!unknowns[i].held) free.push_back(column);
    else if (jacobian.col(column).norm() > 0) influence.held.push_back(i);
  }
  const auto count = static_cast<Index>(unknowns.size()), held = static_cast<Index>(influence.held.size());
  influence.slope = influence.shift = MatrixXd::Zero(count, held);
  if (free.empty() || held == 0) return influence;
  MatrixXd others = jacobian(Eigen::all, free);
  const VectorXd scale = others.colwise().norm().transpose().cwiseInverse();
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(others * scale.asDiagonal());
  for (Index h = 0; h < held; ++h) {
    const std::size_t which = influence.held[static_cast<std::size_t>(h)];
    const VectorXd slope = -scale.cwiseProduct(VectorXd(qr.solve(jacobian.col(static_cast<Index>(which)))));
    for (std::size_t a = 0; a < free.size(); ++a) influence.slope(free[a], h) = slope[static_cast<Index>(a)];
    influence.shift.col(h) = ignorance(joint.parameter(unknowns[which]), unknowns[which].value) * influence.slope.col(h);
  }
  return influence;
}

std::string short_name(const JointProblem& joint, const Unknown& unknown) {
  const std::string& name = joint.parameter(unknown).name;
  return unknown.run < 0 ? name : name + " (" + std::filesystem::path(joint.runs()[static_cast<std::size_t>(unknown.run)].run().file).filename().string() + ")";
}

std::string what_to_record(const JointProblem& joint, const Unknown& unknown) {
  const Parameter& p = joint.parameter(unknown);
  if (!p.advice.empty()) return p.advice;
  if (p.role == Role::mass) return "Record a run with a measured force: a free decay fixes stiffness and damping only per mass.";
  const bool has_decay = std::any_of(joint.runs().begin(), joint.runs().end(), [](const RunResidual& run) { return run.run().kind == RunKind::pluck; });
  return has_decay ? "Record a free decay that begins larger, lasts longer or is sampled faster than those here." : "Record a free decay.";
}

}  // namespace unrig
