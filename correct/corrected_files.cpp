#include "correct/corrected_files.h"

#include <cmath>
#include <filesystem>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "correct/estimate/how_far_to_trust.h"
#include "correct/estimate/uncertainty_budget.h"

namespace unrig {
namespace {

using Eigen::Index;

/// Columns of a load beyond its value and standard deviation: the parts of the latter, 95 % band over the whole curve, other weights.
std::string further_columns(const std::string& name, const std::string& unit) {
  std::string header;
  for (const char* source : source_names) header += fmt::format(",{}_std_{}{}", name, source, unit);
  return header + fmt::format(",{}_band95{},{}_half_weight{},{}_twice_weight{}", name, unit, name, unit, name, unit);
}

std::string share_columns(const std::string& name) {
  std::string header;
  for (const char* share : share_names) header += fmt::format(",{}_share_{}", name, share);
  return header;
}

template <class Out>
void share_cells(Out out, const CorrectedLoad& load, Index k) {
  const Eigen::MatrixXd shares = variance_shares(load.by_source.row(k), load.of_givens.size() > 0 ? load.of_givens.segment(k, 1).eval() : Eigen::VectorXd{});
  for (const double share : shares.reshaped()) std::isfinite(share) ? fmt::format_to(out, ",{:.6f}", share) : fmt::format_to(out, ",");
}

template <class Out, class Row>
void further_cells(Out out, const Row& by_source, double band, double half, double twice) {
  for (Index s = 0; s < sources; ++s) fmt::format_to(out, ",{:.3g}", by_source[s]);
  fmt::format_to(out, ",{:.4g},{:.6g},{:.6g}", band, half, twice);
}

}  // namespace

std::string to_csv(const CorrectResult& r, const MadeBy& made_by) {
  return whole_text([&](const TextSink& sink) { to_csv(sink, r, made_by); });
}

void to_csv(const TextSink& sink, const CorrectResult& r, const MadeBy& made_by) {
  std::string text = "time [s],semichords,gauge [N],normal_force [N],normal_force_std [N],circulatory [N],circulatory_std [N],cn,cn_std";
  text += further_columns("circulatory", " [N]") + further_columns("normal_force", " [N]") + ",unexplained [N]" + share_columns("circulatory") + share_columns("normal_force");
  const HowFarToTrust trust{r.reduced_chi2, r.warnings, r.no_answer, made_by};
  sink(text + trust.header() + "\n");
  const std::string last_cells = trust.cells();
  const CorrectedLoad &normal = r.normal_force, &circulatory = r.circulatory;
  fmt::memory_buffer row;
  auto out = std::back_inserter(row);
  for (Index k = 0; k < r.gauge.size(); ++k) {
    row.clear();
    const double t = r.start + static_cast<double>(k) * r.dt;
    fmt::format_to(out, "{:.9g},{:.9g},", t, (t - r.onset) * r.semichords_per_second);
    if (std::isfinite(r.gauge[k])) fmt::format_to(out, "{:.6g}", r.gauge[k]);
    fmt::format_to(out, ",{:.6g},{:.4g},{:.6g},{:.4g},{:.6g},{:.4g}", normal.value[k], normal.std[k], circulatory.value[k], circulatory.std[k],
                   normal.value[k] / r.force_per_coefficient, r.coefficient_std.size() > 0 ? r.coefficient_std[k] : normal.std[k] / r.force_per_coefficient);
    for (const CorrectedLoad* load : {&circulatory, &normal})
      further_cells(out, load->by_source.row(k), load->simultaneous * load->std[k], load->half_weight[k], load->twice_weight[k]);
    row.push_back(',');
    if (std::isfinite(r.unexplained[k])) fmt::format_to(out, "{:.4g}", r.unexplained[k]);
    for (const CorrectedLoad* load : {&circulatory, &normal}) share_cells(out, *load, k);
    fmt::format_to(out, "{}\n", last_cells);
    sink({row.data(), row.size()});
  }
}

std::string to_indicial_csv(const CorrectResult& r, const MadeBy& made_by) {
  const IndicialResponse& response = r.indicial;
  std::string text = "semichords,indicial,indicial_std" + further_columns("indicial", "") + ",cn_per_radian [1/rad],cn_per_radian_std [1/rad]";
  const HowFarToTrust trust{r.reduced_chi2, r.warnings, r.no_answer, made_by};
  text += trust.header() + "\n";
  const std::string last_cells = trust.cells();
  auto out = std::back_inserter(text);
  for (Index i = 0; i < response.value.size(); ++i) {
    const UncertaintyBySource& u = response.uncertainty;
    fmt::format_to(out, "{:.6g},{:.6g},{:.4g}", response.semichords[i], response.value[i], u.std[i]);
    further_cells(out, u.by_source.row(i), u.simultaneous * u.std[i], response.half_weight[i], response.twice_weight[i]);
    fmt::format_to(out, ",{:.6g},{:.4g}{}\n", response.per_radian[i], response.per_radian_std[i], last_cells);
  }
  return text;
}

namespace {

std::string indicial_report(const CorrectResult& r) {
  const IndicialResponse& response = r.indicial;
  const Index last = response.value.size() - 1;
  const auto at = [&](double s) {
    Index i = 0;
    while (i < last && response.semichords[i] < s) ++i;
    return fmt::format("{:.4f} +/- {:.2g} at {:.3g}", response.value[i], response.uncertainty.std[i], response.semichords[i]);
  };
  std::vector<std::string> points;
  for (const double s : {0.5, 2.0, 8.0, 30.0})
    if (const std::string point = at(s); points.empty() || point != points.back()) points.push_back(point);  // a short record ends before
  std::string text = fmt::format("    indicial response    {} semichords\n", fmt::join(points, ", "));
  text += fmt::format("        at the step      {}{:.3f} +/- {:.2g} ({:+.1f} standard deviations from 1/2); 1 at infinity, which is the slope\n",
                      r.imposed.at_step ? fmt::format("{:g} imposed; without that ", *r.imposed.at_step) : "", response.at_step, response.at_step_std,
                      (response.at_step - 0.5) / response.at_step_std);
  text += fmt::format("        monotone         {}", r.imposed.monotone ? "imposed; without that " : "");
  text += std::isinf(response.steepest_fall) ? "it nowhere falls\n"
                                             : fmt::format("it falls at {:.3g} semichords; one that never falls looks so with a probability of {:.2g}\n", response.steepest_fall,
                                                           response.monotone_p);
  if (r.imposed.monotone) text += "                         (standard deviations are those without it: upper estimates)\n";
  text += std::isfinite(response.trusted_from) ? fmt::format("    known to 5 % from    {:.3g} semichords on\n", response.trusted_from)
                                               : "    known to 5 %         nowhere in this record\n";
  text += response.highest > 0 ? fmt::format("    usable bandwidth     {:.3g} to {:.3g} Hz (response to oscillation known to 5 %)\n", response.lowest, response.highest)
                               : "    usable bandwidth     none (response to oscillation nowhere known to 5 %)\n";
  return text;
}

std::string uncertainty_report(const CorrectResult& r) {
  const Index last = r.circulatory.value.size() - 1;
  std::string text = "    uncertainty          circulatory load at the end [N]:";
  for (Index s = 0; s < sources; ++s) text += fmt::format(" {} {:.2g}{}", source_names[static_cast<std::size_t>(s)], r.circulatory.by_source(last, s), s + 1 < sources ? "," : "\n");
  text += fmt::format("        95 % bands       1.96 standard deviations for a point, {:.2f} for the whole load, {:.2f} for the whole response\n", r.circulatory.simultaneous,
                      r.indicial.uncertainty.simultaneous);
  if (r.calibration_uncertainty == 0) text += "        calibration      taken as exact: neither --calibration-error nor calibration_uncertainty in the rig file\n";
  const auto change = [&](const Eigen::VectorXd& other) { return (other - r.indicial.value).cwiseAbs().maxCoeff(); };
  text += fmt::format("    regularisation       amplitudes within 0 +/- {:.3g} by evidence; {:.1f} of {} determined by the data\n", r.prior_amplitude, r.determined, r.amplitudes);
  text += fmt::format("        sensitivity      half its weight moves the response by at most {:.2g}, twice by {:.2g}\n", change(r.indicial.half_weight),
                      change(r.indicial.twice_weight));
  return text;
}

}  // namespace

std::string report(const CorrectResult& r) {
  const double degrees = 180 / std::numbers::pi;
  const Index last = r.circulatory.value.size() - 1;
  std::string text = fmt::format("[[Correction]] {}\n", std::filesystem::path(r.file).filename().string());
  text += fmt::format("    the angle changes by {:.4f} deg, from {:.4f} s on; {:.4g} semichords per second\n", r.step * degrees, r.onset, r.semichords_per_second);
  text += fmt::format("    gauge and angle are explained to a reduced chi-square of {:.3f} (gauge noise {:.3g} N)\n", r.reduced_chi2, r.noise);
  text += fmt::format("    rig parameters       {}\n", r.in_fit ? "as the fit left them: the run took part in it" : "those of the fit, adjusted within their errors");
  text += fmt::format("    circulatory load     {:.4f} N before, {:.4f} +/- {:.2g} N at the end\n", r.circulatory.value[0], r.circulatory.value[last], r.circulatory.std[last]);
  text += fmt::format("    normal-force slope   {:.4f} +/- {:.2g} per radian (limit of the indicial response)\n", r.slope, r.slope_std);
  return text + indicial_report(r) + uncertainty_report(r);
}

}  // namespace unrig
