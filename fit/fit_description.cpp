#include "fit/fit_description.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/rig/fingerprint.h"
#include "core/rig/bridge.h"
#include "fit/uncertainty/coloured_noise.h"
#include "fit/likelihood/explained.h"
#include "fit/likelihood/modal_frequencies.h"
#include "fit/likelihood/readings_noise.h"
#include "fit/likelihood/share_followed.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

double rms(const VectorXd& x, const VectorXd& weight) {
  double sum = 0;
  Index count = 0;
  for (Index k = 0; k < x.size(); ++k)
    if (weight[k] > 0) sum += x[k] * x[k], ++count;
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

/// Covariance of all unknowns (zero for those held), and behind them of the first offset of each run, once what is held may be off by its ignorance. Unknowns that are lost with it are
/// not identified: their covariance stays what it is with the others held.
MatrixXd covariance_of_all(const JointProblem& joint, const ParameterUncertainty& uncertainty, const HeldInfluence& influence, std::vector<bool>& identified) {
  const auto all = static_cast<Index>(joint.unknowns().size()), runs = static_cast<Index>(joint.runs().size());
  MatrixXd covariance = MatrixXd::Zero(all + runs, all + runs), shift = influence.shift;
  std::vector<Index> place = uncertainty.free;
  for (Index r = 0; r < runs; ++r) place.push_back(all + r);
  covariance(place, place) = uncertainty.with_offsets();
  for (Index i : uncertainty.free) {
    const Unknown& u = joint.unknowns()[static_cast<std::size_t>(i)];
    constexpr double most_of_it = 0.45;  // one in proportion to a held one is off by half of itself
    const double off = shift.row(i).norm();
    if (off <= most_of_it * std::abs(u.value) && std::hypot(std::sqrt(covariance(i, i)), off) < ignorance(joint.parameter(u), u.value)) continue;
    identified[static_cast<std::size_t>(i)] = false;
    shift.row(i).setZero();
  }
  MatrixXd off(all + runs, shift.cols());
  off << shift, uncertainty.offset_slope * shift;
  return covariance + off * off.transpose();
}

/// Steady load before the motion as a coefficient: the offset of the gauge. The gauge's own zero cannot be told from it. The variances are the offset's.
FittedParameter steady_load(const RunResidual& residual, const VectorXd& theta, double unit_reading, double variance, double white, double coloured) {
  FittedParameter steady;
  steady.name = "steady_normal_force";
  steady.unit = "1";
  steady.run = residual.run().file;
  steady.value = residual.evaluate(theta, Partials::none).linear[residual.first_offset()] / unit_reading;
  steady.std_error = std::sqrt(variance) / unit_reading;
  steady.std_error_white = std::sqrt(white) / unit_reading;
  steady.std_error_coloured = std::sqrt(coloured) / unit_reading;
  steady.start = 0;
  return steady;
}

/// 1 on the diagonal, 0 beside what was held.
MatrixXd correlation_of(const MatrixXd& covariance) {
  const VectorXd inverse = covariance.diagonal().unaryExpr([](double v) { return v > 0 ? 1 / std::sqrt(v) : 0.0; });
  MatrixXd correlation = inverse.asDiagonal() * covariance * inverse.asDiagonal();
  correlation.diagonal().setOnes();
  return correlation.cwiseMin(1).cwiseMax(-1);
}

}  // namespace

double reading_of_steady_load(const RunResidual& residual) {
  const Rig& rig = residual.model().rig();
  const Conditions& c = residual.conditions();
  if (rig.gauge_element == 0 || c.speed == 0 || residual.channels().front() != "gauge") return 0;
  return reading_of_unit_coefficient(rig, gauge_levers(rig), c.density, c.speed);
}

void check_lengths(const JointProblem& joint) {
  for (const RunResidual& run : joint.runs())
    if (run.degrees_of_freedom() <= 0)
      throw InputError({run.run().file, 0}, fmt::format("{} samples for {} unknowns of the run itself (how it starts, its zeros, its motion)", run.observations(), run.linear_unknowns()),
                       "wanted more samples than that", "Record for several periods of the rig's lowest mode, or leave the run out.");
}

std::string too_few_samples(Index observations, Index variables) {
  constexpr Index enough = 20;
  const Index freedom = observations - variables;
  if (freedom >= enough) return "";
  return fmt::format("{} samples leave {} degrees of freedom beside {} unknowns, too few to tell noise from signal. Record for several periods of the lowest mode.", observations, freedom, variables);
}

bool FittedRun::explained() const { return reduced_chi2() < most_of_noise(degrees_of_freedom); }

FittedRun describe_run(const RunResidual& residual, const VectorXd& theta, double chi2) {
  const Run& run = residual.run();
  const RunResidual::Prediction p = residual.predict(theta);
  FittedRun fitted;
  fitted.file = run.file;
  fitted.fingerprint = fingerprint(run, residual.model().rig());
  fitted.onset_angle = residual.conditions().onset_angle;
  fitted.samples = run.samples();
  fitted.hold = run.hold;
  fitted.chi2 = chi2;
  fitted.degrees_of_freedom = residual.degrees_of_freedom();
  fitted.in_stream = run.speed > 0;
  fitted.aside = residual.is_aside();
  const auto add = [&](const std::string& name, const VectorXd& model, const VectorXd& weight, double noise) {
    const Channel& channel = run.channel(name);
    FittedChannel c;
    c.name = name;
    c.unit = channel.unit;
    c.missing = channel.missing;
    c.bad = channel.bad;
    c.clipped = channel.clipped;
    c.samples = (weight.array() > 0).count();
    c.rms_residual = rms(channel.value - model, weight);
    c.noise = noise;
    if (!fitted.explained() && !fitted.aside) c.left = left_in_octaves(channel.value - model, weight, run.dt, noise);
    fitted.channels.push_back(c);
  };
  for (std::size_t c = 0; c < p.channels.size(); ++c) {
    const VectorXd predicted = p.output.col(static_cast<Index>(c));
    add(p.channels[c], predicted, residual.channel_weight(c), std::hypot(residual.noise(c), sigma_of_inputs(residual, theta, c)));
    fitted.followed = std::min(fitted.followed, share_followed(run.channel(p.channels[c]).value, predicted, residual.channel_weight(c)));
  }
  if (p.motion.angle.size() > 0) {
    add("alpha", p.motion.angle.array() + p.angle_offset[0], residual.angle_weight(), residual.angle_sigma());
    fitted.channels.back().spikes = residual.spikes();
  }
  return fitted;
}

namespace {

/// Channel by channel, over the noise.
std::map<std::string, std::vector<RestResidual>> left_at_rest(const JointProblem& joint) {
  std::map<std::string, std::vector<RestResidual>> left;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual& run = joint.runs()[r];
    const RunResidual::Prediction p = run.predict(joint.theta(r));
    for (std::size_t c = 0; c < p.channels.size() && !run.is_aside(); ++c) {
      if (sigma_of_inputs(run, joint.theta(r), c) > 0 || run.converter(c).step > 0) continue;  // coloured by what drives the rig, or reads it
      const VectorXd residual = (run.run().channel(p.channels[c]).value - p.output.col(static_cast<Index>(c))) / run.noise(c);
      left[p.channels[c]].push_back({run.at_rest(residual, run.channel_weight(c)), run.run().dt});
    }
  }
  return left;
}

}  // namespace

std::vector<ChannelColour> noise_colours(const JointProblem& joint) {
  std::vector<ChannelColour> colours;
  for (const auto& [channel, residuals] : left_at_rest(joint))
    if (const std::optional<NoiseColour> colour = colour_of(residuals)) colours.push_back({channel, *colour});
  return colours;
}

std::vector<ChannelColour> noise_colours_of_most(const JointProblem& joint) {
  std::vector<ChannelColour> colours;
  for (const auto& [channel, residuals] : left_at_rest(joint))
    if (const std::optional<NoiseColour> colour = colour_of_most(residuals)) colours.push_back({channel, *colour});
  return colours;
}

void describe_parameters(const JointProblem& joint, const ParameterUncertainty& uncertainty, const StartValues& starts, FitResult& result) {
  result.coloured = uncertainty.coloured;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) result.runs[r].whiteness = uncertainty.whiteness[r];
  const auto all = static_cast<Index>(joint.unknowns().size());
  const HeldInfluence influence = held_influence(joint);
  std::vector<bool> identified(joint.unknowns().size(), true);
  const MatrixXd covariance = covariance_of_all(joint, uncertainty, influence, identified);
  MatrixXd with_others_held = MatrixXd::Zero(all, all);
  with_others_held(uncertainty.free, uncertainty.free) = uncertainty.covariance();
  result.determined = determined_combinations(joint, influence, with_others_held);

  for (Index i = 0; i < all; ++i) {
    const auto which = static_cast<std::size_t>(i);
    const Unknown& u = joint.unknowns()[which];
    const Parameter& p = joint.parameter(u);
    FittedParameter fitted;
    fitted.name = p.name;
    fitted.unit = p.unit;
    fitted.run = u.run >= 0 ? joint.runs()[static_cast<std::size_t>(u.run)].run().file : "";
    fitted.value = u.value;
    fitted.start = start_of(p, starts);
    fitted.effect = p.effect;
    fitted.place = p.place;
    fitted.role = p.role;
    fitted.mode = p.mode;
    fitted.std_error = std::nan("");
    const auto position = std::find(uncertainty.free.begin(), uncertainty.free.end(), i);
    if (position == uncertainty.free.end()) {
      fitted.identified = false;
      fitted.advice = u.why_held + fmt::format("; held at {:.6g}. ", u.value) + what_to_record(joint, u);
    } else {
      const Index a = position - uncertainty.free.begin();
      fitted.std_error = std::sqrt(covariance(i, i));
      fitted.std_error_white = std::sqrt(uncertainty.white_covariance(a, a));
      fitted.std_error_coloured = std::sqrt(uncertainty.coloured_covariance(a, a));
      if (const auto [lower, upper] = bounds_at(joint.model(), u.parameter, u.value); u.value <= lower || u.value >= upper) {
        fitted.identified = false;
        fitted.advice = fmt::format("It ended at its bound {}. ", u.value) + what_to_record(joint, u);
      } else if (u.value >= stiffest_below(joint, u, highest_nyquist(joint.runs()))) {
        fitted.identified = false;
        fitted.advice = "Its mode ended at half the sampling rate: these runs would have it higher, where they do not show it. " + what_to_record(joint, u);
      } else if (!identified[which]) {
        fitted.identified = false;
        for (const DeterminedCombination& c : result.determined)
          if (c.unknowns.front() == which) fitted.advice = fmt::format("Determined is only {}; the error is that with the rest of it held. {}", c.combination, c.settled_by);
      }
    }
    result.parameters.push_back(fitted);
  }
  std::vector<Index> described(static_cast<std::size_t>(all));
  std::iota(described.begin(), described.end(), Index{0});
  for (Index r = 0; r < static_cast<Index>(joint.runs().size()); ++r) {
    const RunResidual& run = joint.runs()[static_cast<std::size_t>(r)];
    const double unit_reading = reading_of_steady_load(run);
    if (unit_reading == 0) continue;
    const Index offset = static_cast<Index>(uncertainty.free.size()) + r;
    result.parameters.push_back(steady_load(run, joint.theta(static_cast<std::size_t>(r)), unit_reading, covariance(all + r, all + r), uncertainty.white_covariance(offset, offset), uncertainty.coloured_covariance(offset, offset)));
    described.push_back(all + r);
  }
  result.correlation = correlation_of(covariance(described, described));
}

void describe_profiles(const JointProblem& joint, const ParameterUncertainty& uncertainty, const FitProblem& problem, FitResult& result) {
  if (problem.profile.empty()) return;
  const LeastSquaresProblem squares = joint.least_squares();
  const MatrixXd white = uncertainty.white_covariance / std::max(1.0, result.reduced_chi2());
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i) {
    const Unknown& u = joint.unknowns()[i];
    const Parameter& p = joint.parameter(u);
    const auto asked = [&](const std::string& name) { return name == p.name || name == short_name(joint, u) || (name == "all" && !u.held); };
    if (std::none_of(problem.profile.begin(), problem.profile.end(), asked)) continue;
    if (problem.progress) problem.progress("profile of " + short_name(joint, u));
    ProfiledParameter profiled{p.name, u.run >= 0 ? joint.runs()[static_cast<std::size_t>(u.run)].run().file : "", p.unit, {}};
    ProfileOptions options;
    options.variance_factor = std::max(1.0, result.reduced_chi2());
    const auto position = std::find(uncertainty.free.begin(), uncertainty.free.end(), static_cast<Index>(i));
    if (const Index a = position - uncertainty.free.begin(); position != uncertainty.free.end()) options.variance_factor = uncertainty.covariance()(a, a) / white(a, a);
    constexpr double one_deviation = 0.6826894921370859, usual = 0.95;
    for (const double confidence : {one_deviation, usual}) {
      options.confidence = confidence;
      profiled.intervals.push_back(profile(squares, i, options));
    }
    result.profiles.push_back(std::move(profiled));
  }
}

namespace {

void identify_nothing(FitResult& result, const std::string& advice) {
  for (FittedParameter& p : result.parameters) {
    if (!p.identified) continue;
    p.identified = false;
    p.advice = advice;
  }
}

}  // namespace

void judge_answer(FitResult& result) {
  constexpr double half = 0.5;
  const auto known = [](const FittedParameter& p) { return p.identified; };
  const auto lost = std::find_if(result.runs.begin(), result.runs.end(), [](const FittedRun& run) { return run.followed < half && !run.explained() && !run.aside; });
  std::string advice;
  if (result.no_answer = too_few_samples(result.observations, result.variables); !result.no_answer.empty()) {
    advice = "These runs are too short. Record longer ones.";
  } else if (!result.converged) {
    result.no_answer = "the fit did not converge: " + result.message;
    advice = "The fit did not converge: its values are no answer.";
  } else if (lost != result.runs.end()) {
    result.no_answer = fmt::format("{}: the model follows only {:.0f} % of the variance of this run. The search ended in a wrong minimum, or this is not a run of this rig. Check rig file and run, give start values (--start), or "
                                   "leave the run out.", lost->file, 100 * std::max(0.0, lost->followed));
    advice = "The fit does not follow its runs: its values are no answer.";
  } else if (std::none_of(result.parameters.begin(), result.parameters.end(), known) && result.determined.empty()) {
    result.no_answer = "these runs determine no parameter";
    for (const FittedParameter& p : result.parameters)
      if (!p.advice.empty()) {
        result.no_answer += ". " + p.name + ": " + p.advice;
        break;
      }
    return;
  }
  if (!result.no_answer.empty()) identify_nothing(result, advice);
}

void judge_misfit(const JointProblem& joint, const ParameterUncertainty& uncertainty, FitResult& result) {
  constexpr double significant = 1e-3;
  if (!result.no_answer.empty() || std::all_of(result.runs.begin(), result.runs.end(), [](const FittedRun& run) { return run.explained() || run.aside; })) return;
  double least = significant / static_cast<double>(uncertainty.free.size());
  std::string moved;
  for (std::size_t a = 0; a < uncertainty.free.size(); ++a) {
    const auto which = static_cast<std::size_t>(uncertainty.free[a]);
    const FittedParameter& p = result.parameters[which];
    const double by = uncertainty.earlier_half[static_cast<Index>(a)], chance = std::erfc(std::abs(by) / p.std_error / std::sqrt(2.0));
    if (!p.identified || !(chance < least)) continue;
    least = chance;
    moved = fmt::format("{} = {:.5g} +/- {:.2g} {}, and about {:.5g} by the earlier halves of the runs alone", short_name(joint, joint.unknowns()[which]), p.value, p.std_error, p.unit, p.value + by);
  }
  if (moved.empty()) return;
  result.no_answer = "what the model leaves unexplained moves its parameters by more than their errors: " + moved + ". Something is missing from the model that goes with the swing or with time. Ask `unrig diagnose` what it is.";
  identify_nothing(result, "What the model leaves unexplained moves the parameters by more than their errors. Ask `unrig diagnose` what is missing.");
}

void warn_of_silent_runs(const JointProblem& joint, FitResult& result) {
  for (const RunResidual& run : joint.runs()) {
    const std::string& file = run.run().file;
    if (const std::string few = too_few_samples(run.observations(), run.linear_unknowns()); !few.empty() && joint.runs().size() > 1)
      result.warnings.push_back(fmt::format("{}: the run is too short to say anything by itself: {}", file, few));
    else if (run.run().kind == RunKind::step && !run.conditions().prescribed_pitch)
      result.warnings.push_back(fmt::format("{}: the angle does not move by more than its noise; the run says nothing of its slope", file));
  }
}

namespace {

/// A residual of nothing but rounding is that of a simulation, whose noise is a convention (run_residual.cpp).
void warn_of_too_little(const FittedRun& run, FitResult& result) {
  constexpr double clearly = 1.2, rounding = 0.01;
  for (const FittedChannel& c : run.channels)
    if (c.noise > clearly * c.rms_residual && c.rms_residual > rounding * c.noise)
      result.warnings.push_back(fmt::format("{}: less is left of {} ({:.3g} {}) than its noise ({:.3g} {}; reduced chi-square {:.2f}). Its converter is coarser than the noise, or wrong readings have raised that: look at the "
                                            "recording. The run counts for less than it could.",
                                            run.file, c.name, c.rms_residual, c.unit, c.noise, c.unit, run.reduced_chi2()));
}

}  // namespace

void warn_of_mismatch(FitResult& result) {
  for (const FittedRun& run : result.runs) {
    if (run.aside) {
      result.warnings.push_back(fmt::format("{}: had no part in this fit: it crosses the corners of a law for so long that no search follows it to its end (reduced chi-square {:.2f}). The other runs determine the parameters.",
                                            run.file, run.reduced_chi2()));
      continue;
    }
    if (run.reduced_chi2() < least_of_noise(run.degrees_of_freedom)) warn_of_too_little(run, result);
    if (run.explained()) continue;
    std::string which;
    for (const FittedChannel& c : run.channels)
      if (c.rms_residual > 1.1 * c.noise) which += fmt::format("{}{} is left with {:.3g} {}, its noise is {:.3g}", which.empty() ? "" : ", ", c.name, c.rms_residual, c.unit, c.noise);
    result.warnings.push_back(fmt::format("{}: the model does not explain this run (reduced chi-square {:.2f}; {}). Either the noise is coloured, which the standard errors allow for, "
                                          "or physics is missing, and then the parameters may be further off than their errors say.",
                                          run.file, run.reduced_chi2(), which.empty() ? "all channels together" : which));
  }
}

}  // namespace unrig
