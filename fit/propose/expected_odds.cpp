#include "fit/propose/expected_odds.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/model/simulate.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Channel* find(Run& run, const std::string& name) {
  const auto found = std::find_if(run.channels.begin(), run.channels.end(), [&](const Channel& c) { return c.name == name; });
  return found == run.channels.end() ? nullptr : &*found;
}

/// Initial values of the signals in the run at hand; none where the planned run would not start with such.
VectorXd signals_of(const FittedExplanation& truth, const CandidateRun& candidate, const VectorXd& theta) {
  const RunResidual like = truth.joint().runs()[candidate.like];  // a copy: several threads predict
  const LinearSystem system = truth.model().system(like.conditions(), theta, like.channels());
  if (system.exogenous.empty()) return {};
  const VectorXd initial = like.predict(theta).initial_state;
  const Conditions planned = conditions_of(candidate.run);
  const auto count = static_cast<Index>(system.exogenous.size());
  if (initial.size() < count || static_cast<Index>(truth.model().system(planned, theta, like.channels()).exogenous.size()) != count) return {};
  return initial.tail(count);
}

/// The recording itself, as the model has it.
Run predicted_again(const FittedExplanation& truth, const CandidateRun& candidate, const VectorXd& theta, VectorXd& linear) {
  const RunResidual like = truth.joint().runs()[candidate.like];
  const RunResidual::Prediction p = like.predict(theta);
  Run run = like.run();
  const auto put = [&](const std::string& name, const VectorXd& value) {
    VectorXd& old = find(run, name)->value;
    old = old.array().isFinite().select(value, old);  // what was not read is not read again
  };
  for (std::size_t c = 0; c < p.channels.size(); ++c) put(p.channels[c], p.output.col(static_cast<Index>(c)));
  if (p.angle_offset.size() > 0) put("alpha", p.motion.angle.array() + p.angle_offset[0]);
  linear = p.linear;
  return run;
}

Run simulated(const FittedExplanation& truth, const CandidateRun& candidate, const VectorXd& theta) {
  SimulateProblem problem{truth.model(), theta, candidate.run, {}, candidate.release_load, {}};
  problem.signals = signals_of(truth, candidate, theta);
  const SimulateResult result = simulate(problem);
  const std::vector<std::string>& wanted = truth.joint().runs()[candidate.like].channels();
  Run run = result.run;
  std::erase_if(run.channels, [&](const Channel& c) {
    return std::find(result.simulated.begin(), result.simulated.end(), c.name) != result.simulated.end() && std::find(wanted.begin(), wanted.end(), c.name) == wanted.end();
  });
  return run;
}

void add_noise(Run& run, const std::string& channel, double size, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, size);
  if (Channel* c = find(run, channel))
    for (double& x : c->value) x += normal(random);
}

double angle_noise(const FittedExplanation& model, const CandidateRun& candidate) {
  const RunResidual& like = model.joint().runs()[candidate.like];
  return like.angle_sigma() > 0 ? like.angle_sigma() : candidate.angle_noise;
}

/// A run near the parameters of a fit, with what is its own alone eliminated: difference and slopes in units of the noise.
struct Local {
  VectorXd residual;
  MatrixXd slope;  // over FittedExplanation::shared
  double chi2 = 0;
};

Local local(const FittedExplanation& model, const RunResidual& run, const CandidateRun& candidate) {
  const RunResidual::Sensitivity s = run.sensitivity(model.theta(candidate));
  Index rows = 0, at = 0;
  for (const auto& channel : s.channels) rows += channel.residual.size();
  const std::vector<Index>&shared = model.shared(), own = model.own(candidate.like);
  Local out{VectorXd(rows), MatrixXd(rows, static_cast<Index>(shared.size())), 0};
  MatrixXd of_its_own(rows, static_cast<Index>(own.size()));
  for (const auto& channel : s.channels) {
    const Index n = channel.residual.size();
    out.residual.segment(at, n) = channel.residual;
    out.slope.middleRows(at, n) = channel.slope(Eigen::all, shared);
    of_its_own.middleRows(at, n) = channel.slope(Eigen::all, own);
    at += n;
  }
  if (!own.empty() && of_its_own.norm() > 0) {
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(of_its_own);
    const auto without = [&](const MatrixXd& m) -> MatrixXd { return m - of_its_own * qr.solve(m); };
    out.residual = without(out.residual);
    out.slope = without(out.slope);
  }
  out.chi2 = out.residual.squaredNorm();
  return out;
}

double log_det(const MatrixXd& m) {
  const Eigen::LDLT<MatrixXd> ldlt(m);
  return ldlt.vectorD().array().abs().max(std::numeric_limits<double>::min()).log().sum();
}

}  // namespace

ImaginedRun imagined(const FittedExplanation& truth, const CandidateRun& candidate, const VectorXd& theta, std::mt19937_64& random) {
  ImaginedRun run;
  run.exact = candidate.repeat ? predicted_again(truth, candidate, theta, run.linear) : simulated(truth, candidate, theta);
  run.exact.file = candidate.what;
  const RunResidual& like = truth.joint().runs()[candidate.like];
  for (const std::string& channel : like.channels())
    if (const Channel* c = run.exact.find(channel); !candidate.repeat && c && !c->value.allFinite()) throw NoAnswer(candidate.what + ": the model has no finite answer");
  run.noisy = run.exact;
  for (std::size_t c = 0; c < like.channels().size(); ++c) add_noise(run.noisy, like.channels()[c], like.noise(c) * like.tempered(), random);
  if (candidate.run.kind == RunKind::step) add_noise(run.noisy, "alpha", angle_noise(truth, candidate), random);
  run.windows = candidate.repeat ? like.motion().windows() : windows_to_fit(run.noisy);
  return run;
}

RunResidual residual_of(const FittedExplanation& model, const ImaginedRun& run, const CandidateRun& candidate, bool exact) {
  const RunResidual& like = model.joint().runs()[candidate.like];
  RunResidual noisy(model.model(), run.noisy, run.windows);
  noisy.temper(like.noise(0) * like.tempered() / noisy.sigma(0));
  if (like.linear_unknowns() == noisy.linear_unknowns() && run.linear.size() == noisy.linear_unknowns()) noisy.start_from(run.linear);
  if (!exact) return noisy;
  RunResidual residual(model.model(), run.exact, run.windows);
  residual.keep_noise_of(noisy);
  residual.start_from(noisy);
  return residual;
}

double expected_log_odds(const FittedExplanation& truth, const FittedExplanation& other, const ImaginedRun& run, const CandidateRun& candidate) {
  const Local i = local(truth, residual_of(truth, run, candidate, true), candidate), j = local(other, residual_of(other, run, candidate, true), candidate);
  const MatrixXd &hi = truth.information(), &hj = other.information();
  const MatrixXd mi = hi + i.slope.transpose() * i.slope, mj = hj + j.slope.transpose() * j.slope;
  const Eigen::LDLT<MatrixXd> known_i(hi), solve_i(mi), solve_j(mj);
  const auto least = [](const Local& at, const Eigen::LDLT<MatrixXd>& m) {
    const VectorXd g = at.slope.transpose() * at.residual;
    return at.chi2 - g.dot(m.solve(g));
  };
  // tr(S_j^-1 S_i) - n with S_j^-1 = 1 - G_j M_j^-1 G_j^T.
  const MatrixXd cross = j.slope.transpose() * i.slope;
  const double trace = known_i.solve(MatrixXd(i.slope.transpose() * i.slope)).trace() - solve_j.solve(MatrixXd(j.slope.transpose() * j.slope)).trace() -
                       solve_j.solve(MatrixXd(cross * known_i.solve(MatrixXd(cross.transpose())))).trace();
  return 0.5 * (least(j, solve_j) - least(i, solve_i) + trace + log_det(mj) - log_det(hj) - log_det(mi) + log_det(hi));
}

}  // namespace unrig
