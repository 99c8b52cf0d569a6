#include "core/law/learnt_range.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "core/law/law_view.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;


void append_output(LinearSystem& system, const RowVectorXd& row, bool of_rates) {
  const Index before = system.C.rows();
  system.C = system.C.grown(before + 1, system.C.cols());
  system.D = system.D.grown(before + 1, system.D.cols());
  if (row.size() == 0) return;
  if (!of_rates) return system.C.set_block(before, 0, MatrixXd(row));
  system.C.set_block(before, 0, MatrixXd(row) * system.A);
  system.D.set_block(before, 0, MatrixXd(row) * system.B);
}

/// Where a law acts: its strips, or -1.
std::vector<Index> places_of(const Law& law, const Rig& rig) {
  if (law.acts_on != ActsOn::lift) return {-1};
  std::vector<Index> strips(rig.submerged.size());
  for (std::size_t s = 0; s < strips.size(); ++s) strips[s] = static_cast<Index>(s);
  return strips;
}

double let_pass(const Range& range) {
  constexpr double share = 0.05;
  return share * std::max({range.upper - range.lower, std::abs(range.lower), std::abs(range.upper)});
}

/// The first sample outside, or their number.
Index first_beyond(const VectorXd& value, const Range& learnt) {
  const double more = let_pass(learnt);
  return std::find_if(value.begin(), value.end(), [&](double x) { return !(x >= learnt.lower - more && x <= learnt.upper + more); }) - value.begin();
}

/// A number moved up by less than a thousandth, to four digits.
double rounded_up(double x) {
  if (x == 0 || !std::isfinite(x)) return x;
  const double unit = std::pow(10, std::floor(std::log10(std::abs(x))) - 3);
  return std::stod(fmt::format("{:.4g}", std::ceil(x / unit) * unit));
}

}  // namespace

std::string told(Symbol symbol, const Range& range) { return fmt::format("{} is from {:.3g} to {:.3g} {}", symbol_names[index_of(symbol)], range.lower, range.upper, symbol_units[index_of(symbol)]); }

Range rounded_outward(const Range& range) { return {0 - rounded_up(-range.lower), rounded_up(range.upper)}; }

std::vector<Sight> append_sights(LinearSystem& system, const AeroelasticModel& model, const Conditions& conditions, Sights which) {
  std::vector<Sight> sights;
  for (const std::string& id : model.effect_ids()) {
    if (!is_law_id(id) || !effect(model.rig(), id).acts(model.rig(), conditions)) continue;
    const Law& law = law_of(effect(model.rig(), id));
    if (which == Sights::learnt && law.learnt_on.empty()) continue;
    for (const Index place : places_of(law, model.rig())) {
      const LawView view = law_view(model, system, conditions, place);
      for (std::size_t s = 0; s < symbol_count; ++s) {
        const auto symbol = static_cast<Symbol>(s);
        if (!law.uses(symbol) || symbol == Symbol::z || (which == Sights::learnt && !law.learnt_on.contains(symbol))) continue;
        append_output(system, view.row[s], symbol == Symbol::a);
        sights.push_back({&law, symbol, view.at_rest[s], {}});
      }
    }
  }
  return sights;
}

void take_values(std::vector<Sight>& sights, const MatrixXd& output, double dt) {
  for (std::size_t i = 0; i < sights.size(); ++i) {
    Sight& sight = sights[i];
    sight.value = output.col(static_cast<Index>(i)).array() + sight.at_rest;
    if (sight.symbol == Symbol::t) sight.value = dt * VectorXd::LinSpaced(output.rows(), 0, static_cast<double>(output.rows() - 1));
  }
}

void widen(std::map<std::string, LearntOn>& known, const std::vector<Sight>& sights) {
  for (const Sight& sight : sights) {
    if (!sight.value.allFinite() || sight.value.size() == 0) continue;
    Range& range = known[sight.law->id()].try_emplace(sight.symbol, Range{INFINITY, -INFINITY}).first->second;
    range = {std::min(range.lower, sight.value.minCoeff()), std::max(range.upper, sight.value.maxCoeff())};
  }
}

std::vector<std::string> beyond_learnt(const std::vector<Sight>& sights, const Run& run) {
  std::map<std::string, LearntOn> reached;
  widen(reached, sights);
  std::vector<std::string> sentences;
  for (auto sight = sights.begin(); sight != sights.end(); ++sight) {
    const auto same = [&](const Sight& other) { return other.law == sight->law && other.symbol == sight->symbol; };
    const auto learnt = sight->law->learnt_on.find(sight->symbol);
    if (learnt == sight->law->learnt_on.end() || std::any_of(sights.begin(), sight, same)) continue;  // of several strips one sentence
    Index first = run.samples();
    for (const Sight& other : sights)
      if (same(other)) first = std::min(first, first_beyond(other.value, learnt->second));
    if (first == run.samples()) continue;
    sentences.push_back(fmt::format("the law \"{}\" was learnt where {}; here {}, beyond for the first time at {:.4g} s", sight->law->name, told(sight->symbol, learnt->second),
                                    told(sight->symbol, reached[sight->law->id()][sight->symbol]), run.time(first)));
  }
  return sentences;
}

void refuse_beyond(const std::vector<std::string>& beyond, const std::string& file, bool go_on, std::vector<std::string>& warnings) {
  if (beyond.empty()) return;
  const std::string found = fmt::format("{}: {}. Beyond, a law is a guess", file, fmt::join(beyond, "; "));
  if (!go_on) throw NoAnswer(found + ": record and fit runs that reach as far, or go on all the same with --beyond");
  warnings.push_back(found + ".");
}

}  // namespace unrig
