#include "fit/diagnose/as_given.h"

#include <algorithm>

#include "fit/fit_description.h"

namespace unrig {
namespace {

void sort_mismatch(const GivenOrder& given, Mismatch& m) {
  given.sort(m.channels, [](const ChannelMismatch& c) { return c.run; });
  const Mismatch was = m;
  const std::vector<std::size_t> places = given.places(m.runs, [](const std::string& file) { return file; });
  for (std::size_t i = 0; i < places.size(); ++i) {
    m.runs[i] = was.runs[places[i]];
    m.time[i] = was.time[places[i]];
    m.frequency[i] = was.frequency[places[i]];
    m.state[i] = was.state[places[i]];
  }
}

}  // namespace

void tell_as_given(const GivenOrder& given, std::size_t runs, Diagnosis& d) {
  sort_mismatch(given, d.mismatch);
  sort_mismatch(given, d.remaining);
  for (std::vector<MissingEffect>* effects : {&d.missing, &d.closest})
    for (MissingEffect& m : *effects) given.sort_by_name(m.parameters);
  const auto fitted = [](const ImprovedRun& run) { return !run.heldout; };
  const auto unseen = std::stable_partition(d.runs.begin(), d.runs.end(), fitted);
  std::vector<ImprovedRun> seen(d.runs.begin(), unseen), others(unseen, d.runs.end());
  for (std::vector<ImprovedRun>* part : {&seen, &others}) given.sort(*part, [](const ImprovedRun& run) { return run.file; });
  d.runs = std::move(seen);
  d.runs.insert(d.runs.end(), others.begin(), others.end());
  given.sort(d.maps, [](const ResidualMaps& m) { return m.run; });
  given.sort(d.missing_force, [](const MissingForce& f) { return f.run; });
  for (FitResult* fit : {&d.before, &d.after})
    if (fit->runs.size() == runs) tell_as_given(given, *fit);  // a verdict alone has none
}

}  // namespace unrig
