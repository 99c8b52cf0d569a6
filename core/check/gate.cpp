#include "core/check/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>

#include "core/check/causes.h"
#include "core/check/run_estimate.h"
#include "core/check/waveform_gate.h"
#include "core/files/error.h"
#include "core/files/heard_warnings.h"
#include "core/files/text_file.h"
#include "core/run/run_limits.h"

namespace unrig {
namespace {

using std::numbers::pi;

// Spread of the estimates (natural logarithms) over the 69 campaigns of tests/core/check/gate_test.cpp, six runs each, with every effect that they hide:
//
//   stiffness of a decay    campaign to campaign -0.16 +- 0.09 (dry), -0.17 +- 0.12 (wet); of one campaign dry less wet up to 0.17
//   of a step's ringing     -0.17 +- 0.12; one in a hundred is of another line
//   steady load             -0.10 +- 0.09 (2 to 4 degrees), -0.04 +- 0.16 (25 degrees); least -0.60
//   ringing                 0.0 +- 0.35, friction and noise lower it to -2.1
//
// Widths are two to three times these, for rigs and wings unlike the samples: stiffness known to 35 %, apparent mass to 15 %, slope to 35 % (a wing of aspect ratio 5 has 70 % of 2 pi).
struct Width {
  double mean, shared, own, cap;
};
namespace width {
constexpr Width stiffness{-0.15, 0.3, 0.1, 36}, step_stiffness{-0.15, 0.3, 0.2, 36}, apparent{0.05, 0.15, 0, 0}, steady{-0.1, 0.3, 0.15, 100}, stalled_steady{-0.1, 0.3, 0.25, 100}, ring{0, 0.3, 0.6, 16};
}  // namespace width

constexpr double no_line = 4, impossible = 60;

double square(double x) { return x * x; }

struct Reading {
  double value, share, own;
};

double distance(const Reading& r, double level, double cap) { return std::min(cap, square((r.value - level) / r.own)); }

/// Least over the shared level of all readings' capped distances and its own from what it can be: one of the readings, or their mean, is near it.
double least_distance(const std::vector<Reading>& readings, const Width& width) {
  std::vector<double> levels{width.mean};
  double sum = width.mean / square(width.shared), weight = 1 / square(width.shared);
  for (const Reading& r : readings) {
    levels.push_back((r.value / square(r.own) + width.mean / square(width.shared)) / (1 / square(r.own) + 1 / square(width.shared)));
    sum += r.value / square(r.own), weight += 1 / square(r.own);
  }
  levels.push_back(sum / weight);
  double least = std::numeric_limits<double>::infinity();
  for (const double level : levels) {
    double total = square((level - width.mean) / width.shared);
    for (const Reading& r : readings) total += distance(r, level, width.cap);
    least = std::min(least, total);
  }
  return least;
}

/// Of the stiffness, with ln C_a, by which a share of it falls in the fluid, at its best too.
double stiffness_distance(const std::vector<Reading>& readings) {
  double least = std::numeric_limits<double>::infinity();
  constexpr double widest = 1, step = 0.05;
  for (double a = -widest; a <= widest; a += step) {
    std::vector<Reading> dry = readings;
    for (Reading& r : dry) r.value += r.share * a;
    least = std::min(least, least_distance(dry, width::stiffness) + square((a - width::apparent.mean) / width::apparent.shared));
  }
  return least;
}

/// What cannot be, whatever the rig.
double impossibilities(const RunEstimate& e) {
  double sum = 0;
  if (e.nyquist_ratio < 1) sum += impossible;                 // slower samples than the lowest vibration
  if (e.periods < 1) sum += impossible;                       // shorter than one of its periods
  if (e.largest_angle > pi / 2) sum += impossible;
  if (e.kind == RunKind::step && !e.turns) sum += impossible;
  if (e.kind == RunKind::pluck && e.turns) sum += impossible;
  if (e.exchanged) sum += impossible;
  if (e.reversed && (!e.stalled || std::abs(e.ring_phase) > 2 * pi / 3)) sum += impossible;
  return sum;
}

double implausibility(const std::vector<RunEstimate>& estimates) {
  std::vector<Reading> stiffnesses, steadies, rings;
  double sum = 0;
  for (const RunEstimate& e : estimates) {
    if (!e.looked_at) continue;
    sum += impossibilities(e);
    if (std::isfinite(e.stiffness))
      stiffnesses.push_back({e.stiffness, e.fluid_share, e.kind == RunKind::step ? width::step_stiffness.own : width::stiffness.own});
    else
      sum += no_line;
    if (std::isfinite(e.steady)) steadies.push_back({e.steady, 0, e.stalled ? width::stalled_steady.own : width::steady.own});
    if (std::isfinite(e.ring)) rings.push_back({e.ring, 0, width::ring.own});
  }
  return sum + stiffness_distance(stiffnesses) + least_distance(steadies, width::steady) + least_distance(rings, width::ring);
}

/// The campaign with what each run says. A step's line is sought at the stiffness of the free decays, of which the one nearest to the rig file counts.
class Campaign {
 public:
  Campaign(const Rig& rig, std::vector<Run> runs) : model_(rig), runs_(std::move(runs)) {
    estimates_.resize(runs_.size());
    look_at_all();
  }

  void look_at_all() {
    for (const bool decays : {true, false}) {
      if (!decays) reference_ = reference();
      for (std::size_t r = 0; r < runs_.size(); ++r)
        if ((runs_[r].kind == RunKind::pluck) == decays) estimates_[r] = estimate(model_, runs_[r], reference_);
    }
  }

  double reference() {
    std::optional<double> nearest;
    for (const RunEstimate& e : estimates_)
      if (e.kind == RunKind::pluck && std::isfinite(e.stiffness) && (!nearest || std::abs(e.stiffness) < std::abs(*nearest))) nearest = e.stiffness, decay_share_ = e.fluid_share;
    decays_ = nearest.has_value();
    return nearest.value_or(0);
  }

  /// How implausible it is with these runs as they are after `undo`.
  double without(const RunCause& cause, const std::vector<std::size_t>& in) const {
    Campaign other = *this;
    bool decay = false;
    for (const std::size_t r : in) {
      cause.undo(other.runs_[r]);
      decay |= runs_[r].kind == RunKind::pluck;
    }
    if (decay)
      other.look_at_all();
    else
      for (const std::size_t r : in) other.estimates_[r] = estimate(model_, other.runs_[r], reference_);
    return other.measure();
  }
  double without(const RigCause& cause) const {
    Rig rig = model_.rig();
    cause.undo(rig);
    return Campaign(rig, runs_).measure();
  }

  /// ln C_a by what the free decays fall in the fluid, none: 0.
  double apparent() const {
    double sum = 0, weight = 0;
    for (const RunEstimate& dry : estimates_)
      for (const RunEstimate& wet : estimates_)
        if (dry.kind == RunKind::pluck && wet.kind == RunKind::pluck && wet.fluid_share > dry.fluid_share + 0.2 && std::isfinite(dry.stiffness) && std::isfinite(wet.stiffness))
          sum += dry.stiffness - wet.stiffness, weight += wet.fluid_share - dry.fluid_share;
    return weight > 0 ? sum / weight : 0.0;
  }
  /// ln of the stiffness scale in vacuum by the free decay nearest to the rig file; none: by the first step that rings.
  PlausibleCampaign plausible() const {
    PlausibleCampaign campaign{model_, runs_, estimates_, reference_, apparent()};
    if (!decays_)
      for (const RunEstimate& e : estimates_)
        if (std::isfinite(e.stiffness)) {
          campaign.stiffness = e.stiffness;
          return campaign;
        }
    campaign.stiffness += decay_share_ * campaign.apparent;
    return campaign;
  }
  double measure() const { return implausibility(estimates_); }
  const std::vector<Run>& runs() const { return runs_; }
  const std::vector<RunEstimate>& estimates() const { return estimates_; }

 private:
  CheckModel model_;
  std::vector<Run> runs_;
  std::vector<RunEstimate> estimates_;
  double reference_ = 0, decay_share_ = 0;
  bool decays_ = false;
};

/// A slip that was tried.
struct Trial {
  const Cause* cause;
  std::vector<std::size_t> runs;  ///< empty: the rig file
  double left;                    ///< implausibility without it, and its price
};

std::vector<Trial> all_trials(const Rig& rig, const Campaign& campaign) {
  std::vector<Trial> trials;
  const std::vector<Run>& runs = campaign.runs();
  for (const RunCause& cause : run_causes()) {
    std::vector<std::size_t> able;
    for (std::size_t r = 0; r < runs.size(); ++r)
      if (campaign.estimates()[r].looked_at && cause.possible(runs[r])) able.push_back(r);
    for (const std::size_t r : able) trials.push_back({&cause, {r}, campaign.without(cause, {r}) + cause.price});
    std::vector<std::size_t> decays, steps;
    for (const std::size_t r : able) (runs[r].kind == RunKind::pluck ? decays : steps).push_back(r);
    if (able.size() > 1) trials.push_back({&cause, able, campaign.without(cause, able) + cause.price});
    for (const auto& several : {decays, steps})
      if (several.size() > 1 && several.size() < able.size()) trials.push_back({&cause, several, campaign.without(cause, several) + cause.price});
  }
  for (const RigCause& cause : rig_causes())
    if (cause.possible(rig)) trials.push_back({&cause, {}, campaign.without(cause) + cause.price});
  std::stable_sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) { return a.left < b.left; });
  return trials;
}

std::string where(const Trial& trial, const Rig& rig, const std::vector<Run>& runs) {
  if (trial.runs.empty()) return base_name(rig.file);
  if (trial.runs.size() == 1) return base_name(runs[trial.runs.front()].file);
  if (trial.runs.size() == runs.size()) return "all runs";
  std::string names;
  for (const std::size_t r : trial.runs) names += (names.empty() ? "" : ", ") + base_name(runs[r].file);
  return names;
}

/// One run of several is guilty: would the others agree without it?
bool others_agree(const Rig& rig, const std::vector<Run>& runs, std::size_t guilty, double agreed) {
  std::vector<Run> others = runs;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(guilty));
  return Campaign(rig, std::move(others)).measure() < agreed;
}

// Of the samples the largest is 21.4, of a record whose steps nobody sees; undoing a slip that is none gains 3.3 at most. Of the mistakes in tests/commands/check_test.cpp the least gain is 17.8 (kg for lb).
constexpr double suspicious = 14, certain = 12, alike = 5;

std::string sentence(const Trial& trial, const std::string& others) { return fmt::format(fmt::runtime(trial.cause->says), others) + "; " + trial.cause->words; }

/// The slip that explains best why the campaign is implausible; none where it is plausible, or no slip makes it so.
std::optional<Suspicion> slip(const Rig& rig, const std::vector<Run>& runs, const Campaign& campaign) {
  const double now = campaign.measure();
  if (now < suspicious) return {};
  const std::vector<Trial> trials = all_trials(rig, campaign);
  if (trials.empty() || now - trials.front().left < certain) return {};
  const Trial& best = trials.front();
  Suspicion s;
  s.where = where(best, rig, runs);
  s.factor = best.cause->factor;
  s.weight = now - best.left;
  s.grave = true;
  s.causes.push_back(best.cause->words);
  const bool alone = best.runs.size() == 1 && runs.size() > 1;
  const std::string others = alone ? "the other runs" : best.runs.empty() ? "the runs" : "the rig file and the other numbers";
  s.text = s.where + ": " + sentence(best, others);
  if (trials.size() > 1 && trials[1].left < best.left + alike) {
    const std::string other = where(trials[1], rig, runs);
    s.causes.push_back(trials[1].cause->words);
    const bool same = other == s.where && trials[1].cause->says == best.cause->says;
    s.text += same ? " Or " + trials[1].cause->words : " Or " + (other == s.where ? "" : other + ": ") + sentence(trials[1], others);
  }
  if (alone && others_agree(rig, runs, best.runs.front(), suspicious)) s.text += fmt::format(" Without {} the other runs agree.", s.where);
  return s;
}

/// Of a channel that stays at its largest or smallest reading for long, while elsewhere readings differ: how many of them.
Eigen::Index stuck_at_an_end(const Eigen::VectorXd& x) {
  Eigen::Index equal = 0, most = 0, at_end = 0;
  const double highest = x.maxCoeff<Eigen::PropagateNumbers>(), lowest = x.minCoeff<Eigen::PropagateNumbers>();
  for (const double end : {highest, lowest}) {
    Eigen::Index count = 0, run = 0, longest = 0;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      run = x[k] == end ? run + 1 : 0;
      count += x[k] == end;
      longest = std::max(longest, run);
    }
    if (count > at_end) at_end = count, most = longest;
  }
  for (Eigen::Index k = 1; k < x.size(); ++k) equal += x[k] == x[k - 1] && x[k] != highest && x[k] != lowest;
  constexpr Eigen::Index long_stay = 16;
  constexpr double seldom = 0.1;
  return most >= long_stay && static_cast<double>(equal) < seldom * static_cast<double>(x.size()) ? at_end : 0;
}

/// Readings that the file's reader has left out already, and a channel that stands at the end of its range.
void look_at_readings(const Run& run, std::vector<Suspicion>& found) {
  for (const Channel& channel : run.channels) {
    if (channel.name != "gauge") continue;
    const auto tell = [&](std::size_t count, const std::string& what, bool grave) {
      found.push_back({base_name(run.file), {what}, static_cast<double>(count), 0, grave, fmt::format("{}: {} of {} readings of the {} {}", base_name(run.file), count, channel.value.size(), channel.name, what)});
    };
    if (channel.clipped > 0) tell(channel.clipped, "are clipped at the end of its range; they are left out. Lower the gain of the amplifier.", false);
    constexpr std::size_t noteworthy = 4;  // noise with heavy tails has one or two in a record of the samples
    if (channel.bad >= noteworthy) tell(channel.bad, "lie far from their neighbours; they are left out.", false);
    const Eigen::Index stuck = stuck_at_an_end(channel.value);
    if (stuck > 0 && channel.value.minCoeff<Eigen::PropagateNumbers>() == channel.value.maxCoeff<Eigen::PropagateNumbers>())
      tell(static_cast<std::size_t>(stuck), "are one and the same, it never changes: a broken cable, or a stopped converter?", true);
    else if (stuck > 0)
      tell(static_cast<std::size_t>(stuck), "stand at the end of its range: clipped or saturated? Lower the gain of the amplifier, and record again.", true);
  }
}

/// A record too short for any number of its own: it says nothing of the rig, and does no harm.
std::optional<Suspicion> too_short(const Run& run, const RunEstimate& e) {
  if (!(e.periods > 0 && e.periods < 1)) return {};
  const std::string where = base_name(run.file), cause = "cut off, or the wrong file?";
  return Suspicion{where, {cause}, e.periods, 0, false,
                   fmt::format("{}: {} samples, {:.3g} s, are {:.2g} periods of the rig, and say nothing of it; {} Record several.", where, run.samples(), run.dt * static_cast<double>(run.samples()), e.periods, cause)};
}

}  // namespace

std::vector<Suspicion> suspicions(const Rig& rig, const std::vector<Run>& runs) {
  std::vector<Suspicion> found;
  std::vector<Run> whole;
  for (const Run& run : runs) {
    const std::size_t before = found.size();
    look_at_readings(run, found);
    const bool spoilt = std::any_of(found.begin() + static_cast<std::ptrdiff_t>(before), found.end(), [](const Suspicion& s) { return s.grave; });
    const Channel* gauge = run.find("gauge");
    constexpr std::size_t few = 20;  // of twenty readings one may be clipped, and what the others say still counts
    if (!spoilt && (!gauge || few * gauge->clipped < static_cast<std::size_t>(gauge->value.size()))) whole.push_back(run);
  }
  if (rig.gauge_element == 0 || whole.empty()) return found;
  const Campaign campaign(rig, whole);
  if (const auto s = slip(rig, whole, campaign)) {
    found.push_back(*s);
    return found;
  }
  for (std::size_t r = 0; r < whole.size(); ++r)
    if (const auto s = too_short(whole[r], campaign.estimates()[r])) found.push_back(*s);
  const PlausibleCampaign plausible = campaign.plausible();
  std::vector<Suspicion> late = late_channels(plausible);
  if (late.empty())
    if (const auto s = other_element(plausible)) late.push_back(*s);
  found.insert(found.end(), late.begin(), late.end());
  return found;
}

void tell(const std::vector<Suspicion>& suspicions) {
  for (const Suspicion& s : suspicions)
    if (const std::string line = "check: " + s.text; !heard(line)) fmt::print(stderr, "{}\n", line);
}

void pass_the_gate(const Rig& rig, const std::vector<Run>& runs, bool anyway) {
  for (const Run& run : runs) check_what_drives(run);
  const std::vector<Suspicion> found = suspicions(rig, runs);
  tell(found);
  const auto grave = std::find_if(found.begin(), found.end(), [](const Suspicion& s) { return s.grave; });
  if (grave == found.end() || anyway) return;
  throw NoAnswer("no trustworthy answer: what was given for " + grave->where + " cannot be right (see above). Mend it, leave that run out, or give --anyway if you know better.");
}

}  // namespace unrig
