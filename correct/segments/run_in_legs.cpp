#include "correct/segments/run_in_legs.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/numerics/householder.h"
#include "core/numerics/in_parallel.h"
#include "fit/likelihood/motion_prior.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Run part_of(const Run& run, const Interval& samples) {
  Run part = run;
  part.start = run.time(samples.first);
  for (Channel& channel : part.channels) channel.value = channel.value.segment(samples.first, samples.length()).eval();
  return part;
}

/// Where a leg that ends with the one window is cut from one that begins with the other.
Index cut_between(const MotionBasis::Window& before, const MotionBasis::Window& behind) { return behind.knots.first - (behind.knots.first - before.knots.last) / 4; }

/// What a steady radian reads, per channel.
VectorXd steady_reading(const LinearSystem& system) {
  std::vector<Index> moved;
  for (Index i = 0; i < system.states(); ++i)
    if ((i < system.motion || i > system.motion + 2) && std::find(system.exogenous.begin(), system.exogenous.end(), i) == system.exogenous.end()) moved.push_back(i);
  VectorXd state = VectorXd::Zero(system.states());
  state[system.motion] = 1;
  const auto count = static_cast<Index>(moved.size());
  const auto place = [&](Index i) { return moved[static_cast<std::size_t>(i)]; };  // indexed views of Eigen make GCC 12 warn of a deallocation that is none
  MatrixXd own(count, count);
  VectorXd by_angle(count);
  for (Index i = 0; i < count; ++i) {
    by_angle[i] = system.A.value(place(i), system.motion);
    for (Index j = 0; j < count; ++j) own(i, j) = system.A.value(place(i), place(j));
  }
  const VectorXd rest = own.partialPivLu().solve(-by_angle);
  for (Index i = 0; i < count; ++i) state[place(i)] = rest[i];
  return system.C.value * state;
}

/// [J | r] with what w reaches taken out.
MatrixXd beside(const MatrixXd& A, const MatrixXd& rows) {
  const Householder reach{MatrixXd(A)};
  const MatrixXd rotated = reach.rotated(rows);
  return rotated.bottomRows(rotated.rows() - A.cols());
}

}  // namespace

RunInLegs::Ties RunInLegs::ties() const {
  constexpr double undetermined = 1e-11;
  const LinearSystem system = model_->system(residual(0).conditions(), solutions_.front().theta, residual(0).channels());  // of all legs
  const VectorXd g = steady_reading(system);
  const Index channels = g.size(), levels = channels + 1, parameters = solutions_.front().theta.size();
  MatrixXd offset_from(channels, levels);  // o - g a
  offset_from << MatrixXd::Identity(channels, channels), -g;
  const bool with_slopes = !evaluations_.empty();
  const Index count = levels + static_cast<Index>(size() - 1) * channels;
  Ties ties{MatrixXd(count, levels + 1), MatrixXd::Zero(count, with_slopes ? parameters : 0), VectorXd::Zero(count)};
  Index at = 0;
  for (std::size_t p = 0; p < size(); ++p) {
    const auto [value, factor] = residual(p).levels(solutions_[p]);
    const VectorXd known = factor.diagonal().cwiseAbs();
    if (!(known.minCoeff() > undetermined * known.maxCoeff())) {  // something that no reading tells: as if the leg had levels of its own
      ties.rows.middleRows(at, p == 0 ? levels : channels).setZero();
      at += p == 0 ? levels : channels;
      continue;
    }
    const MatrixXd slope = with_slopes ? MatrixXd(evaluations_[p].linear_slope.bottomRows(levels)) : MatrixXd(levels, 0);
    if (p == 0) {
      ties.rows.topRows(levels) << factor, factor * value;
      ties.angle_share[channels] = 1;
      if (with_slopes) ties.slope.topRows(levels) = factor * slope;
      at = levels;
      continue;
    }
    VectorXd level = value;
    level[channels] -= solutions_[p - 1].departure[system.motion];
    const MatrixXd root = factor.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(levels, levels));
    const MatrixXd spread = offset_from * root;
    const Eigen::LLT<MatrixXd> covariance(spread * spread.transpose());
    ties.rows.middleRows(at, channels) << covariance.matrixL().solve(offset_from), covariance.matrixL().solve(offset_from * level);
    const VectorXd of_angle = (g * root.row(channels)).rowwise().squaredNorm(), of_all = spread.rowwise().squaredNorm();
    ties.angle_share.segment(at, channels) = of_angle.cwiseQuotient(of_all).cwiseMin(1);
    if (with_slopes) {
      MatrixXd moved = slope;
      const DualMatrix& arrival = evaluations_[p - 1].departure;
      for (Index j = 0; j < parameters; ++j)
        if (arrival.depends_on(j)) moved(channels, j) -= arrival.d(j)(system.motion, 0);
      ties.slope.middleRows(at, channels) = covariance.matrixL().solve(offset_from * moved);
    }
    at += channels;
  }
  return ties;
}

RunInLegs::RunInLegs(const AeroelasticModel& model, const Run& run, const std::vector<Windows>& legs) : model_(&model), windows_(legs) {
  if (legs.size() == 1) {
    legs_.push_back({{0, run.samples()}, {}, RunResidual(model, run, legs.front()), {}});
    return;
  }
  for (std::size_t p = 0; p < legs.size(); ++p) {
    const Index first = p == 0 ? 0 : legs_.back().samples.last, last = p + 1 < legs.size() ? cut_between(legs[p].back(), legs[p + 1].front()) : run.samples();
    Windows windows = legs[p];
    for (MotionBasis::Window& w : windows) w.knots.first -= first, w.knots.last -= first;
    legs_.push_back({{first, last}, part_of(run, {first, last}), std::nullopt, {}});
    RunOptions options;
    options.conditions = conditions_of(run);
    legs_.back().residual.emplace(model, legs_.back().own, windows, options);
    if (p > 0) legs_.back().residual->share_responses_with(*legs_.front().residual);
  }
}

RunInLegs RunInLegs::held_against(const AeroelasticModel& model, const Run& run) const {
  RunInLegs other(model, run, windows_);
  for (std::size_t p = 0; p < size(); ++p) {
    other.residual(p).keep_noise_of(residual(p));
    other.residual(p).follow_in(residual(p).finer());
    other.residual(p).start_from(residual(p));
    other.legs_[p].motion_prior = legs_[p].motion_prior;
    if (legs_[p].motion_prior.rows() > 0) other.residual(p).set_motion_prior(legs_[p].motion_prior);
  }
  return other;
}

RunResidual::Solution RunInLegs::solve(const VectorXd& theta) {
  solutions_.clear();
  evaluations_.clear();
  double chi2 = 0;
  for (std::size_t p = 0; p < size(); ++p) {
    if (p > 0) residual(p).arrive_in(DualMatrix(MatrixXd(solutions_.back().departure)));
    solutions_.push_back(residual(p).solve(theta));
    chi2 += solutions_.back().chi2;
    if (!std::isfinite(chi2)) {
      solutions_.clear();
      return {theta, INFINITY, {}, nullptr};
    }
  }
  if (size() == 1) return solutions_.front();
  const MatrixXd rows = ties().rows;
  return {theta, chi2 + beside(rows.leftCols(rows.cols() - 1), rows.rightCols(1)).squaredNorm(), {}, nullptr};
}

const std::vector<RunResidual::Evaluation>& RunInLegs::by_leg(const RunResidual::Solution& solution) {
  if (size() == 1 && (solutions_.empty() || solutions_.front().model != solution.model)) {
    solutions_.clear();
    solutions_.push_back(solution);  // where a law is at work c is another search
    evaluations_.clear();
  }
  if (solutions_.empty() || solutions_.front().theta != solution.theta) solve(solution.theta);
  if (solutions_.size() != size()) throw NoAnswer(fmt::format("{}: the model of the fit runs away in this run; is it the fit of this rig, at this speed?", residual(0).run().file));
  if (!evaluations_.empty()) return evaluations_;
  for (std::size_t p = 0; p < size(); ++p) {
    if (p > 0) {
      DualMatrix& arrival = evaluations_.back().departure;
      arrival.value = solutions_[p - 1].departure;  // the same but for rounding
      residual(p).arrive_in(arrival);
    }
    evaluations_.push_back(residual(p).differentiate(solutions_[p]));
    evaluations_.back().linear_factor = residual(p).linear_factor(solutions_[p]);
  }
  return evaluations_;
}

RunResidual::Evaluation RunInLegs::differentiate(const RunResidual::Solution& solution) {
  const std::vector<RunResidual::Evaluation>& legs = by_leg(solution);
  if (size() == 1) return legs.front();
  const Index parameters = solution.theta.size();
  const Ties tied = ties();
  const Index levels = tied.rows.cols() - 1;
  MatrixXd of_ties(tied.rows.rows(), parameters + 1);
  of_ties << tied.slope, tied.rows.col(levels);
  of_ties = beside(tied.rows.leftCols(levels), of_ties);
  MatrixXd rows(static_cast<Index>(size()) * (parameters + 1) + of_ties.rows(), parameters + 1);
  Index at = 0;
  for (const RunResidual::Evaluation& e : legs) {
    rows.middleRows(at, parameters + 1) << e.jacobian, e.residual;
    at += parameters + 1;
  }
  rows.bottomRows(of_ties.rows()) = of_ties;
  const MatrixXd triangle = Householder(std::move(rows)).triangle();
  RunResidual::Evaluation all;
  all.jacobian = triangle.leftCols(parameters);
  all.residual = triangle.col(parameters);
  all.chi2 = all.residual.squaredNorm();
  return all;
}

void RunInLegs::differentiate_only(const std::vector<Index>& parameters) {
  for (Leg& leg : legs_) leg.residual->differentiate_only(parameters);
  evaluations_.clear();
}

void RunInLegs::learn_noise_and_motion(const VectorXd& theta) {
  if (size() > 1) solve(theta);  // so that each goes on from the one before
  in_parallel(size(), [&](std::size_t p) {
    Leg& leg = legs_[p];
    leg.residual->settle_noise(theta);
    leg.residual->reject_spikes(theta);
    leg.motion_prior = motion_prior(*leg.residual, theta);
    leg.residual->set_motion_prior(leg.motion_prior);
  });
  solutions_.clear();
  evaluations_.clear();
}

RunInLegs RunInLegs::with_colours(const VectorXd& theta, const RunResidual::Colours& colours) const {
  RunInLegs other = *this;
  Leg& leg = other.legs_.front();
  const MatrixXd of_motion = leg.motion_prior.leftCols(leg.residual->motion().unknowns());
  leg.residual->set_colours(theta, colours);
  leg.motion_prior = MatrixXd::Zero(of_motion.rows(), leg.residual->linear_unknowns());
  leg.motion_prior.leftCols(of_motion.cols()) = of_motion;
  leg.residual->set_motion_prior(leg.motion_prior);
  other.solutions_.clear();
  other.evaluations_.clear();
  return other;
}

Index RunInLegs::degrees_of_freedom() const {
  Index sum = 0;
  for (const Leg& leg : legs_) sum += leg.residual->degrees_of_freedom() + leg.motion_prior.rows();
  const Index channels = static_cast<Index>(residual(0).channels().size());
  return sum + static_cast<Index>(size() - 1) * channels;
}

RunInLegs::Together RunInLegs::look_at(const RunResidual::Solution& solution, const Prior& prior, bool with_calibration) {
  Together together;
  together.all = differentiate(solution);
  if (size() == 1) return together;
  together.known.resize(size());
  in_parallel(size(), [&](std::size_t p) { together.known[p] = theta_known(residual(p), evaluations_[p], legs_[p].motion_prior); });
  const Ties tied = ties();
  const MatrixXd angle = beside(tied.rows.leftCols(tied.rows.cols() - 1), tied.angle_share.cwiseSqrt().asDiagonal() * tied.slope);
  together.known.push_back({angle.transpose() * angle, MatrixXd::Zero(angle.cols(), angle.cols())});
  if (with_calibration) together.answer_to_reading = answers_to_reading(together, prior);
  return together;
}

/// Readings that are larger by a thousandth of themselves, at the same theta: by how much c changes, and where the slopes of chi-square, which readings enter linearly, then take theta.
std::vector<VectorXd> RunInLegs::answers_to_reading(const Together& together, const Prior& prior) const {
  constexpr double larger = 1e-3;
  const VectorXd& theta = solutions_.front().theta;
  RunInLegs scaled = *this;
  for (Leg& leg : scaled.legs_) leg.residual->scale_readings(1 + larger);
  const RunResidual::Evaluation there = scaled.differentiate(scaled.solve(theta));
  const VectorXd downhill = there.jacobian.transpose() * there.residual - together.all.jacobian.transpose() * together.all.residual;
  const MatrixXd root = theta_root(together.all, prior);
  const VectorXd of_theta = -root * (root.transpose() * downhill) / larger;
  std::vector<VectorXd> answers;
  for (std::size_t p = 0; p < size(); ++p) {
    const RunResidual::Evaluation& e = evaluations_[p];
    VectorXd answer(theta.size() + e.linear.size());
    answer << of_theta, (scaled.evaluations_[p].linear - e.linear) / larger + e.linear_slope * of_theta;
    answers.push_back(std::move(answer));
  }
  return answers;
}

UncertaintyBudget RunInLegs::budget(std::size_t leg, const Together& together, const Prior& prior, double calibration_uncertainty, double inflation) const {
  RunResidual::Evaluation e = evaluations_[leg];
  e.jacobian = together.all.jacobian;
  e.residual = together.all.residual;
  std::optional<OtherParts> others;
  if (size() > 1) {
    const Index parameters = e.jacobian.cols();
    others = {{MatrixXd::Zero(parameters, parameters), MatrixXd::Zero(parameters, parameters)}, VectorXd::Zero(parameters + e.linear.size())};
    for (std::size_t p = 0; p < together.known.size(); ++p)
      if (p != leg) others->known = others->known + together.known[p];
    if (!together.answer_to_reading.empty()) others->answer_to_reading = together.answer_to_reading[leg];
  }
  return {residual(leg), e, prior, legs_[leg].motion_prior, others, calibration_uncertainty, inflation};
}

Searched searched(RunInLegs& legs) {
  return {[&legs](const VectorXd& theta) { return legs.solve(theta); }, [&legs](const RunResidual::Solution& solution) { return legs.differentiate(solution); }};
}

}  // namespace unrig
