#include "fit/likelihood/share_followed.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/numerics/median.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double spread(const VectorXd& x) { return (x.array() - x.mean()).square().mean(); }

VectorXd those(const VectorXd& x, const std::vector<Index>& which) { return x(which); }

/// Samples in which a reading stands out of its noise, and that noise's variance; none where it does not, or in most of the record.
struct StandsOut {
  std::vector<Index> samples;
  double noise = 0;
};

StandsOut stands_out(const VectorXd& reading) {
  const Index block = std::max<Index>(64, reading.size() / 1024), blocks = reading.size() / block;
  constexpr Index fewest = 8;  // below that a quarter is no sample of them
  if (blocks < fewest) return {};
  const auto begin = [&](Index b) { return b < blocks ? b * block : reading.size(); };  // the last one takes the rest
  std::vector<double> within;
  for (Index b = 0; b < blocks; ++b) within.push_back(spread(reading.segment(begin(b), begin(b + 1) - begin(b))));
  std::vector<double> sorted = within;
  std::sort(sorted.begin(), sorted.end());
  const auto place = [&](std::size_t quarters) { return sorted[quarters * sorted.size() / 4]; };
  constexpr double clearly = 6;
  const double middle = place(2), scatter = median_to_sigma * (middle - place(1));
  const auto loud = [&](Index b) { return b >= 0 && b < blocks && within[static_cast<std::size_t>(b)] > middle + clearly * scatter; };
  StandsOut out;
  Index quiet = 0;
  for (Index b = 0; b < blocks; ++b)
    if (!loud(b)) out.noise += within[static_cast<std::size_t>(b)], ++quiet;
  out.noise /= static_cast<double>(quiet);
  for (Index b = 0; b < blocks; ++b)
    if (loud(b - 1) || loud(b) || loud(b + 1))
      for (Index k = begin(b); k < begin(b + 1); ++k) out.samples.push_back(k);
  if (2 * static_cast<Index>(out.samples.size()) > reading.size()) return {};
  return out;
}

}  // namespace

double share_followed(const VectorXd& reading, const VectorXd& prediction, const VectorXd& weight) {
  std::vector<Index> counted;
  for (Index k = 0; k < weight.size(); ++k)
    if (weight[k] > 0) counted.push_back(k);
  if (counted.empty()) return 1;
  const VectorXd y = those(reading, counted), left = y - those(prediction, counted);
  const double varies = spread(y);
  if (!(varies > 0)) return 1;
  const double whole = 1 - left.squaredNorm() / static_cast<double>(left.size()) / varies;
  constexpr double half = 0.5, nearly_all = 0.8;
  if (whole >= half) return whole;
  const StandsOut out = stands_out(y);
  if (out.samples.empty()) return whole;
  const double left_there = those(left, out.samples).squaredNorm() / static_cast<double>(out.samples.size());
  const double share = 1 - std::max(0.0, left_there - out.noise) / (spread(those(y, out.samples)) - out.noise);
  return share >= nearly_all ? share : whole;
}

}  // namespace unrig
