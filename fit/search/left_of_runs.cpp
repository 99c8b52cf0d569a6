#include "fit/search/left_of_runs.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/numerics/in_parallel.h"
#include "core/numerics/prior_cost.h"
#include "core/numerics/spectrum.h"
#include "fit/likelihood/eliminator.h"
#include "fit/likelihood/standardised_residual.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Share of a residual's samples that its colour leaves independent: the flatness of its spectrum, 1 for white noise.
double independent_share(const VectorXd& left) {
  const VectorXd power = fourier(left).cwiseAbs2();
  const double mean = power.mean();
  return mean > 0 ? std::min(1.0, 2 * mean * mean / power.cwiseAbs2().mean()) : 1;  // the lines of white noise are exponentially distributed
}

/// What the readings say of some of the unknowns behind the motion, whatever the others are: residual = triangle (c - estimate).
struct Known {
  MatrixXd triangle;
  VectorXd estimate;
};

/// `estimates` of them all, and R of what is known of them.
Known known_of(const VectorXd& estimates, const MatrixXd& factor, const std::vector<Index>& some) {
  std::vector<Index> order;
  for (Index i = 0; i < estimates.size(); ++i)
    if (std::find(some.begin(), some.end(), i) == some.end()) order.push_back(i);
  order.insert(order.end(), some.begin(), some.end());
  const auto count = static_cast<Index>(some.size());
  return {run_rows::compress(factor(Eigen::all, order)).bottomRightCorner(count, count), estimates(some)};
}

/// Places, behind the motion's unknowns, of those of these states that are unknown where the run begins.
std::vector<Index> places_of(const RunResidual& run, const std::vector<Index>& states) {
  std::vector<Index> places;
  for (std::size_t i = 0; i < run.free_states().size(); ++i)
    if (std::find(states.begin(), states.end(), run.free_states()[i]) != states.end()) places.push_back(static_cast<Index>(i));
  return places;
}

/// Standard deviations of where filters of the gauge start, before the readings are looked at: in their own states, one column for each term of what the channel showed before the record, a power series in t whose k-th
/// coefficient is about swing omega^k / k!, of the reading's own swing and frequency. A reading t^k/k! leaves the filter x' = F x + g y in -F^-(k+1) g at t = 0. Not finite where the reading does not move.
MatrixXd likely_starts(const LinearSystem& system, const VectorXd& reading, double dt) {
  std::vector<Index> others;
  for (Index i = 0; i < system.states(); ++i)
    if (std::find(system.filters.begin(), system.filters.end(), i) == system.filters.end()) others.push_back(i);
  // What goes into the filters is one reading, F = g c^T; at rest they show it as it is.
  const MatrixXd F = system.A.value(system.filters, system.filters);
  const Eigen::JacobiSVD<MatrixXd> into(system.A.value(system.filters, others), Eigen::ComputeThinU | Eigen::ComputeThinV);
  const VectorXd along = into.matrixV().col(0), g = into.singularValues()[0] * into.matrixU().col(0);
  const Eigen::PartialPivLU<MatrixXd> lu(F);
  VectorXd start = -lu.solve(g);
  const double shown = system.C.value.row(0)(system.filters).dot(start) + system.C.value.row(0)(others).dot(along);
  const double swing = (reading.array() - reading.mean()).matrix().norm(), omega = (reading.tail(reading.size() - 1) - reading.head(reading.size() - 1)).norm() / (dt * swing);
  start *= swing / std::sqrt(static_cast<double>(reading.size())) / shown;
  MatrixXd starts(F.rows(), F.rows());
  for (Index k = 0; k < F.rows(); ++k, start = omega * lu.solve(start)) starts.col(k) = start;
  return starts;
}

/// What linear unknowns of a run cost. Of the states in which filters of the gauge start, Laplace's evidence, since what a fast filter was
/// in has died out before many samples show it, and longer runs say no more of it (Berger, Bayarri and Pericchi, Econometric Reviews 33 (2014) 197). Of other states that settle, those combinations that the readings know
/// better than the swing of the reading itself tells. Of the parts of a signal (LinearSystem::parts) those without which the evidence were less: what the others take of chi-square is left of the run instead.
void count_unknowns(const RunResidual& run, const VectorXd& theta, const RunResidual::Prediction& p, double log_samples, LeftOfRun& left) {
  left.unknowns = static_cast<double>(run.linear_unknowns());
  const LinearSystem system = run.model().system(run.conditions(), theta, run.channels());
  const MatrixXd& factor = p.factor_behind_motion;
  const VectorXd estimates = p.linear.tail(factor.cols());
  if (const std::vector<Index> filters = places_of(run, system.filters); !filters.empty()) {
    const MatrixXd likely = likely_starts(system, p.output.col(0), run.run().dt);
    const Known known = known_of(estimates, factor, filters);
    if (likely.allFinite()) left.unknowns -= static_cast<double>(filters.size()) - prior_cost(known.triangle, known.estimate, likely) / log_samples;  // else the reading does not move
  }
  std::vector<Index> others = system.settling;
  std::erase_if(others, [&](Index state) { return std::find(system.filters.begin(), system.filters.end(), state) != system.filters.end(); });
  if (const std::vector<Index> settling = places_of(run, others); !settling.empty()) {
    const VectorXd reading = p.output.col(0).array() - p.output.col(0).mean();
    const auto count = static_cast<Index>(settling.size());
    const double swing = reading.norm() / std::sqrt(static_cast<double>(reading.size()));
    const VectorXd told = Eigen::JacobiSVD<MatrixXd>(swing * known_of(estimates, factor, settling).triangle).singularValues();
    left.unknowns -= static_cast<double>(count - (told.array() > 1).count());
  }
  for (const std::vector<Index>& part : system.parts) {  // each by itself: at frequencies apart they are all but orthogonal
    const std::vector<Index> places = places_of(run, part);
    const Known known = known_of(estimates, factor, places);
    const double takes = (run.tempered() * (known.triangle * known.estimate)).squaredNorm(), costs = static_cast<double>(places.size()) * log_samples;
    if (takes > costs) continue;
    left.unknowns -= static_cast<double>(places.size());
    left.variance += takes / left.samples;
  }
}

/// A law that is missing bends the motion too, within the noise of the angle.
void look_at_angle(const RunResidual& run, const RunResidual::Prediction& p, LeftOfRun& left) {
  if (run.motion().unknowns() == 0) return;
  const VectorXd& angle = run.run().channel("alpha").value;
  double power = 0;
  for (Index k = 0; k < angle.size(); ++k) {
    if (!(run.angle_weight()[k] > 0) || !std::isfinite(angle[k])) continue;
    power += std::pow(run.angle_weight()[k] * (angle[k] - p.motion.angle[k] - p.angle_offset[0]), 2);
    ++left.angle_samples;
  }
  left.angle_variance = power / left.angle_samples;
}

}  // namespace

std::vector<LeftOfRun> left_of_runs(const JointProblem& joint) {
  std::vector<LeftOfRun> all(joint.runs().size());
  double of_all = 0;
  for (const RunResidual& run : joint.runs()) of_all += static_cast<double>(run.run().samples());
  const double log_samples = std::log(of_all);
  in_parallel(all.size(), [&](std::size_t r) {
    const RunResidual& run = joint.runs()[r];
    const auto every_sample = static_cast<double>(run.run().samples());
    if (run.is_aside()) {
      all[r] = {1, every_sample, every_sample};
      all[r].unknowns = static_cast<double>(run.linear_unknowns());
      return;
    }
    const RunResidual::Prediction p = run.predict(joint.theta(r));
    if (!p.output.allFinite()) {
      all[r] = {run_away, every_sample, every_sample};
      all[r].unknowns = static_cast<double>(run.linear_unknowns());
      return;
    }
    double power = 0;
    for (std::size_t c = 0; c < p.channels.size(); ++c) {
      const VectorXd left = standardised_residual(run, joint.theta(r), p, c);
      const auto samples = static_cast<double>((left.array() != 0).count());
      power += left.squaredNorm();
      all[r].samples += samples;
      all[r].independent += independent_share(left) * samples;
    }
    all[r].variance = power / all[r].samples;
    look_at_angle(run, p, all[r]);
    count_unknowns(run, joint.theta(r), p, log_samples, all[r]);
  });
  return all;
}

}  // namespace unrig
