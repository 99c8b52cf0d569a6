#include "correct/corrected_files.h"

#include <cmath>
#include <filesystem>
#include <iterator>
#include <numbers>

#include <fmt/format.h>

namespace unrig {

std::string to_csv(const CorrectResult& r) {
  std::string text = "time [s],semichords,gauge [N],normal_force [N],normal_force_std [N],circulatory [N],circulatory_std [N],cn,cn_std\n";
  auto out = std::back_inserter(text);
  for (Eigen::Index k = 0; k < r.gauge.size(); ++k) {
    const double t = r.start + static_cast<double>(k) * r.dt;
    fmt::format_to(out, "{:.6g},{:.6g},", t, (t - r.onset) * r.semichords_per_second);
    if (std::isfinite(r.gauge[k])) fmt::format_to(out, "{:.6g}", r.gauge[k]);
    fmt::format_to(out, ",{:.6g},{:.4g},{:.6g},{:.4g},{:.6g},{:.4g}\n", r.normal_force[k], r.normal_force_std[k], r.circulatory[k], r.circulatory_std[k],
                   r.normal_force[k] / r.force_per_coefficient, r.normal_force_std[k] / r.force_per_coefficient);
  }
  return text;
}

std::string to_indicial_csv(const CorrectResult& r) {
  std::string text = "semichords,indicial,indicial_std\n";
  for (Eigen::Index i = 0; i < r.indicial.value.size(); ++i)
    fmt::format_to(std::back_inserter(text), "{:.6g},{:.6g},{:.4g}\n", r.indicial.semichords[i], r.indicial.value[i], r.indicial.std[i]);
  return text;
}

std::string report(const CorrectResult& r) {
  const double degrees = 180 / std::numbers::pi;
  const Eigen::Index last = r.circulatory.size() - 1;
  std::string text = fmt::format("[[Correction]] {}\n", std::filesystem::path(r.file).filename().string());
  text += fmt::format("    the angle changes by {:.4f} deg, from {:.4f} s on; {:.4g} semichords per second\n", r.step * degrees, r.onset, r.semichords_per_second);
  text += fmt::format("    gauge and angle are explained to a reduced chi-square of {:.3f} (gauge noise {:.3g} N)\n", r.reduced_chi2, r.noise);
  text += fmt::format("    circulatory load     {:.4f} N before, {:.4f} +/- {:.2g} N at the end\n", r.circulatory[0], r.circulatory[last], r.circulatory_std[last]);
  text += fmt::format("    normal-force slope   {:.4f} +/- {:.2g} per radian (limit of the indicial response)\n", r.slope, r.slope_std);
  const auto at = [&](double s) {
    Eigen::Index i = 0;
    while (i + 1 < r.indicial.value.size() && r.indicial.semichords[i] < s) ++i;
    return fmt::format("{:.4f} +/- {:.2g} at {:.3g}", r.indicial.value[i], r.indicial.std[i], r.indicial.semichords[i]);
  };
  text += fmt::format("    indicial response    {}, {}, {} semichords\n", at(0.5), at(2), at(8));
  if (std::isfinite(r.trusted_from))
    text += fmt::format("    known to 5 % from    {:.3g} semichords on\n", r.trusted_from);
  else
    text += "    known to 5 % nowhere in this record\n";
  text += fmt::format("    regularisation       amplitudes of the response within 0 +/- {:g} beforehand\n", r.prior_amplitude);
  return text;
}

}  // namespace unrig
