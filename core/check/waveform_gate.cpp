#include "core/check/waveform_gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/files/text_file.h"

namespace unrig {
namespace {

constexpr double suspicious_misfit = 0.5, lowered_to = 0.25, as_good = 1.3;

/// Root mean square of the misfits of the small steps; none: 0.
double misfit_of(const CheckModel& model, const PlausibleCampaign& campaign, bool anew) {
  double sum = 0;
  int count = 0;
  constexpr int enough = 3;
  for (std::size_t r = 0; r < campaign.runs.size() && count < enough; ++r) {
    if (!campaign.estimates[r].moves || campaign.estimates[r].stalled) continue;
    const RunEstimate estimated = anew ? estimate(model, campaign.runs[r], campaign.stiffness) : campaign.estimates[r];
    const Waveform shape = waveform(model, campaign.runs[r], estimated, campaign.stiffness, campaign.apparent);
    if (!shape.found) continue;
    sum += shape.misfit * shape.misfit;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

struct Candidate {
  int gauge, calibration;
  double misfit;
};

/// One of the two elements is another, outboard of the gauge.
std::vector<Candidate> candidates(const PlausibleCampaign& campaign) {
  const Rig& rig = campaign.model.rig();
  std::vector<Candidate> found;
  const auto add = [&](int gauge, int calibration) {
    if ((gauge == rig.gauge_element && calibration == rig.calibration_element) || gauge >= calibration || rig.station[gauge - 1] >= rig.station[calibration - 1]) return;
    Rig other = rig;
    other.gauge_element = gauge;
    other.calibration_element = calibration;
    if (const double misfit = misfit_of(CheckModel(other), campaign, true); misfit > 0) found.push_back({gauge, calibration, misfit});
  };
  for (int element = 1; element <= static_cast<int>(rig.station.size()); ++element) {
    add(rig.gauge_element, element);
    add(element, rig.calibration_element);
  }
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) { return a.misfit < b.misfit; });
  return found;
}

std::string name_of(const Candidate& c, const Rig& rig) {
  return c.gauge != rig.gauge_element ? fmt::format("gauge element {} written for {}", rig.gauge_element, c.gauge) : fmt::format("calibration element {} written for {}", rig.calibration_element, c.calibration);
}

}  // namespace

std::optional<Suspicion> other_element(const PlausibleCampaign& campaign) {
  const double now = misfit_of(campaign.model, campaign, false);
  if (now < suspicious_misfit) return {};
  const std::vector<Candidate> tried = candidates(campaign);
  if (tried.empty() || tried.front().misfit > lowered_to * now) return {};
  const Rig& rig = campaign.model.rig();
  Suspicion s;
  s.where = base_name(rig.file);
  s.factor = now / tried.front().misfit;
  s.grave = true;
  std::string words;
  for (const Candidate& c : tried) {
    if (s.causes.size() == 2 || c.misfit > as_good * tried.front().misfit) break;
    s.causes.push_back(name_of(c, rig) + "?");
    words += (words.empty() ? "" : ", or ") + name_of(c, rig);
  }
  s.text = fmt::format("{}: the gauge follows its steps {:.2g} times less well than with another element; {}?", s.where, s.factor, words);
  return s;
}

std::vector<Suspicion> late_channels(const PlausibleCampaign& campaign) {
  constexpr double least = 0.016, better = 5;
  std::vector<Suspicion> found;
  for (std::size_t r = 0; r < campaign.runs.size(); ++r) {
    const Waveform shape = waveform(campaign.model, campaign.runs[r], campaign.estimates[r], campaign.stiffness, campaign.apparent);
    if (!shape.found || std::abs(shape.late) < least || shape.misfit < better * shape.misfit_if_late) continue;
    const std::string where = base_name(campaign.runs[r].file), cause = "a trigger, or channels that do not start together?";
    found.push_back({where, {cause}, shape.late, 0, false, fmt::format("{}: the gauge is {:.3g} ms {} the angle; {} `--effect channel-delay` follows it.", where, 1000 * std::abs(shape.late), shape.late > 0 ? "behind" : "ahead of", cause)});
  }
  return found;
}

}  // namespace unrig
