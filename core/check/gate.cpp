#include "core/check/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "core/check/causes.h"
#include "core/check/run_estimate.h"

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
// Widths are two to three times these, for rigs and wings unlike the samples: stiffness known to 35 %, apparent mass to 25 %, slope to 35 % (a wing of aspect ratio 5 has 70 % of 2 pi).
struct Width {
  double mean, shared, own, cap;
};
constexpr Width stiffness{-0.15, 0.3, 0.15, 36}, apparent{0, 0.25, 0, 0}, steady{-0.1, 0.3, 0.15, 100}, stalled_steady{-0.1, 0.3, 0.35, 100}, ring{0, 0.3, 0.6, 16};

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
    least = std::min(least, least_distance(dry, stiffness) + square((a - apparent.mean) / apparent.shared));
  }
  return least;
}

/// What cannot be, whatever the rig.
double impossibilities(const RunEstimate& e) {
  double sum = 0;
  if (e.nyquist_ratio < 1) sum += impossible;                 // slower samples than the lowest vibration
  if (e.periods < 1) sum += impossible;                       // shorter than one of its periods
  if (e.largest_angle > pi / 2) sum += impossible;
  if (e.kind == RunKind::step && !e.moves) sum += impossible; // no rest, motion and rest: passed over, unless a slip explains it
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
      stiffnesses.push_back({e.stiffness, e.fluid_share, stiffness.own});
    else
      sum += no_line;
    if (std::isfinite(e.steady)) steadies.push_back({e.steady, 0, e.stalled ? stalled_steady.own : steady.own});
    if (std::isfinite(e.ring)) rings.push_back({e.ring, 0, ring.own});
  }
  return sum + stiffness_distance(stiffnesses) + least_distance(steadies, steady) + least_distance(rings, ring);
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

  double reference() const {
    std::optional<double> nearest;
    for (const RunEstimate& e : estimates_)
      if (e.kind == RunKind::pluck && std::isfinite(e.stiffness) && (!nearest || std::abs(e.stiffness) < std::abs(*nearest))) nearest = e.stiffness;
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

  double measure() const { return implausibility(estimates_); }
  const std::vector<Run>& runs() const { return runs_; }
  const std::vector<RunEstimate>& estimates() const { return estimates_; }

 private:
  CheckModel model_;
  std::vector<Run> runs_;
  std::vector<RunEstimate> estimates_;
  double reference_ = 0;
};

std::string short_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }

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
    if (able.size() > 1) trials.push_back({&cause, able, campaign.without(cause, able) + cause.price});
  }
  for (const RigCause& cause : rig_causes())
    if (cause.possible(rig)) trials.push_back({&cause, {}, campaign.without(cause) + cause.price});
  std::stable_sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) { return a.left < b.left; });
  return trials;
}

std::string where(const Trial& trial, const Rig& rig, const std::vector<Run>& runs) {
  if (trial.runs.empty()) return short_name(rig.file);
  if (trial.runs.size() == 1) return short_name(runs[trial.runs.front()].file);
  if (trial.runs.size() == runs.size()) return "all runs";
  std::string names;
  for (const std::size_t r : trial.runs) names += (names.empty() ? "" : ", ") + short_name(runs[r].file);
  return names;
}

}  // namespace

std::vector<Suspicion> suspicions(const Rig& rig, const std::vector<Run>& runs) {
  std::vector<Suspicion> found;
  if (rig.is_modal() || rig.gauge_element == 0) return found;
  const Campaign campaign(rig, runs);
  const double now = campaign.measure();
  constexpr double suspicious = 12, certain = 20, alike = 5;
  if (std::getenv("GATE")) fmt::print("NOW {:.1f}\n", now);
  if (now < suspicious) return found;
  const std::vector<Trial> trials = all_trials(rig, campaign);
  if (trials.empty()) return found;
  if (std::getenv("GATE")) for (std::size_t i = 0; i < 5; ++i) fmt::print("  TRY {:.1f} {} {} {}\n", trials[i].left, where(trials[i], rig, runs), trials[i].cause->says, trials[i].cause->words);
  const Trial& best = trials.front();
  if (now - best.left < certain) return found;
  Suspicion suspicion;
  suspicion.where = where(best, rig, runs);
  suspicion.factor = best.cause->factor;
  suspicion.weight = now - best.left;
  suspicion.grave = true;
  suspicion.causes.push_back(best.cause->words);
  const std::string others = runs.size() > best.runs.size() && best.runs.size() == 1 ? "the other runs say" : "the rig file and the other numbers say";
  suspicion.text = fmt::format("{}: {} {}; {}", suspicion.where, best.cause->says, others, best.cause->words);
  for (std::size_t i = 1; i < trials.size() && trials[i].left < best.left + alike && suspicion.causes.size() < 2; ++i) {
    suspicion.causes.push_back(trials[i].cause->words);
    const std::string other = where(trials[i], rig, runs);
    suspicion.text += fmt::format(" Or {}{} {}: {}", other == suspicion.where ? "" : other + ": ", trials[i].cause->says, "so", trials[i].cause->words);
  }
  found.push_back(std::move(suspicion));
  return found;
}

std::string why_no_answer(const std::vector<Suspicion>& suspicions) {
  for (const Suspicion& s : suspicions)
    if (s.grave) return s.text;
  return {};
}

}  // namespace unrig
