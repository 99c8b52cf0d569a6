#include "fit/likelihood/noise_colour.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "core/numerics/spectrum.h"
#include "core/run/motion.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index shortest_stretch = 64;

/// Stretches without left-out samples.
std::vector<Interval> stretches_of(const VectorXd& residual) {
  std::vector<Interval> stretches;
  for (Index k = 0; k < residual.size();) {
    const Index first = k;
    while (k < residual.size() && std::isfinite(residual[k])) ++k;
    if (k - first >= shortest_stretch) stretches.push_back({first, k});
    while (k < residual.size() && !std::isfinite(residual[k])) ++k;
  }
  return stretches;
}

constexpr double apart = 4;  // corners

/// Corners a factor of four apart, from an eighth of the sampling rate down to what the longest stretch still tells from a constant.
VectorXd corners_for(double rate, double duration) {
  constexpr double slowest = 0.5;  // periods of the corner in the stretch
  std::vector<double> corners;
  for (double corner = rate / 8; corner * duration > slowest; corner /= apart) corners.push_back(corner);
  return Eigen::Map<const VectorXd>(corners.data(), static_cast<Index>(corners.size()));
}

/// A part of noise, driven by white noise u of unit variance: n_k = s_k + direct u_k, s_{k+1} = pole s_k + drive u_k.
struct Part {
  double pole, drive, direct = 0;

  double state_variance() const { return drive * drive / (1 - pole * pole); }
  /// Spectrum over that of white noise of unit variance, at the sine of half the angle between samples.
  double spectrum(double half) const {
    const double last = drive - pole * direct;
    return (std::pow(direct + last, 2) - 4 * direct * last * half * half) / (std::pow(1 - pole, 2) + 4 * pole * half * half);
  }
};

constexpr std::array falling_corners{1.0 / 4, 3.0 / 8, 9.0 / 20};  // of the sampling rate: a filter against aliasing lets half of the spectrum through, or more

/// The parts of colours with these corners, each of unit variance; the falling ones last.
std::vector<Part> unit_parts(const VectorXd& corner, double dt) {
  std::vector<Part> parts;
  for (const double f : corner) {
    const double pole = std::exp(-2 * std::numbers::pi * f * dt);
    parts.push_back({pole, std::sqrt(1 - pole * pole)});
  }
  for (const double place : falling_corners) {
    const double tangent = std::tan(std::numbers::pi * place), pole = (1 - tangent) / (1 + tangent), direct = std::sqrt((1 - pole) / 2);
    parts.push_back({pole, (1 + pole) * direct, direct});
  }
  return parts;
}

/// Those that a colour has.
std::vector<Part> parts_of(const NoiseColour& colour, double dt) {
  std::vector<Part> parts = unit_parts(colour.corner, dt), own;
  VectorXd power = VectorXd::Zero(static_cast<Index>(parts.size()));
  power.head(colour.power.size()) = colour.power;
  power.segment(colour.power.size(), colour.falling.size()) = colour.falling;
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (const double size = std::sqrt(power[static_cast<Index>(i)]); size > 0) own.push_back({parts[i].pole, size * parts[i].drive, size * parts[i].direct});
  return own;
}

/// Expected periodogram over n samples of a part of unit variance, on the lines between the mean and the last: the transform of its covariance under the triangle of what the samples have in
/// common (A. M. Sykulski et al., Biometrika 106 (2019) 251).
VectorXd expected_periodogram(const Part& part, Index n) {
  VectorXd covariance(n);
  covariance[0] = 1;
  double correlation = part.pole * part.state_variance() + part.drive * part.direct;
  for (Index lag = 1; lag < n; ++lag, correlation *= part.pole) covariance[lag] = (1 - static_cast<double>(lag) / static_cast<double>(n)) * correlation;
  return (2 * fourier(covariance).real().array() - 1).segment(1, (n - 1) / 2);
}

/// Means over groups of neighbouring lines, ever longer ones: the spectra change little over them.
VectorXd grouped(const VectorXd& lines, VectorXd* counts = nullptr) {
  constexpr double wider = 1.0 / 32;
  std::vector<double> means, lengths;
  for (Index k = 0; k < lines.size();) {
    const Index length = std::min<Index>(lines.size() - k, 1 + static_cast<Index>(wider * static_cast<double>(k)));
    means.push_back(lines.segment(k, length).mean());
    lengths.push_back(static_cast<double>(length));
    k += length;
  }
  if (counts) *counts = Eigen::Map<const VectorXd>(lengths.data(), static_cast<Index>(lengths.size()));
  return Eigen::Map<const VectorXd>(means.data(), static_cast<Index>(means.size()));
}

/// The periodogram of a stretch beside those that white noise (first column) and the parts of a colour lead to, each of unit variance.
struct Stretch {
  VectorXd power;
  MatrixXd basis;
};

std::vector<Stretch> periodograms(const RestResidual& residual, const VectorXd& corner) {
  std::vector<Stretch> all;
  for (const Interval& s : stretches_of(residual.value)) {
    const Index n = s.length(), lines = (n - 1) / 2;
    const std::vector<Part> parts = unit_parts(corner, residual.dt);
    Stretch stretch{fourier(VectorXd(residual.value.segment(s.first, n))).cwiseAbs2().segment(1, lines) / static_cast<double>(n), MatrixXd::Ones(lines, static_cast<Index>(parts.size()) + 1)};
    for (std::size_t i = 0; i < parts.size(); ++i) stretch.basis.col(static_cast<Index>(i) + 1) = expected_periodogram(parts[i], n);
    all.push_back(std::move(stretch));
  }
  return all;
}

/// Groups of lines of all stretches, one after the other.
struct Groups {
  VectorXd count, power;
  MatrixXd basis;

  explicit Groups(const std::vector<Stretch>& stretches) {
    std::vector<VectorXd> counts(stretches.size());
    std::vector<VectorXd> powers;
    Index rows = 0;
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      powers.push_back(grouped(stretches[i].power, &counts[i]));
      rows += counts[i].size();
    }
    count.resize(rows), power.resize(rows), basis.resize(rows, stretches.empty() ? 0 : stretches.front().basis.cols());
    Index at = 0;
    for (std::size_t i = 0; i < stretches.size(); at += counts[i].size(), ++i) {
      count.segment(at, counts[i].size()) = counts[i];
      power.segment(at, counts[i].size()) = powers[i];
      for (Index j = 0; j < basis.cols(); ++j) basis.col(j).segment(at, counts[i].size()) = grouped(stretches[i].basis.col(j));
    }
  }
  /// Whittle's.
  double log_likelihood(const VectorXd& spectrum) const { return -(count.array() * (spectrum.array().log() + power.array() / spectrum.array())).sum(); }
  /// The size of a spectrum of this shape that is most likely.
  double size(const VectorXd& shape) const { return count.dot(power.cwiseQuotient(shape)) / count.sum(); }
  VectorXd white() const { return VectorXd::Constant(power.size(), size(VectorXd::Ones(power.size()))); }
};

/// Powers of the first columns of the basis with the greatest likelihood; none of the others.
VectorXd most_likely_powers(Groups lines, Index columns) {
  const Index all = lines.basis.cols();
  lines.basis.conservativeResize(Eigen::NoChange, columns);
  constexpr int most = 3000;
  constexpr double precise = 1e-3;  // of the logarithm, over ten steps
  VectorXd powers = VectorXd::Constant(lines.basis.cols(), lines.white()[0] / static_cast<double>(lines.basis.cols()));
  double before = -INFINITY;
  for (int i = 0; i < most; ++i) {
    const VectorXd spectrum = lines.basis * powers, weight = lines.count.cwiseQuotient(spectrum);
    if (i % 10 == 0) {
      const double now = lines.log_likelihood(spectrum);
      if (now - before < precise) break;
      before = now;
    }
    const VectorXd pull = lines.basis.transpose() * weight.cwiseProduct(lines.power).cwiseQuotient(spectrum), push = lines.basis.transpose() * weight;
    powers = powers.cwiseProduct(pull.cwiseQuotient(push));
  }
  powers.conservativeResizeLike(VectorXd::Zero(all));
  return powers;
}

/// The value that chi-square with n degrees of freedom exceeds once in a thousand (E. B. Wilson and M. M. Hilferty, PNAS 17 (1931) 684).
double once_in_a_thousand(double n) {
  constexpr double normal = 3.0902;
  const double spread = 2 / (9 * n);
  return n * std::pow(1 - spread + normal * std::sqrt(spread), 3);
}

/// How far lines in units of their spectrum are from those of white noise, 1 where one of two tests fails as it does with the probability `chance`: Bartlett's of the cumulative periodogram for what is broad, by the
/// first term of Kolmogorov's distribution, and that of the largest line for what is narrow (R. A. Fisher, Proc. R. Soc. A 125 (1929) 54).
double far_from_white(const VectorXd& relative, double chance) {
  const auto count = static_cast<double>(relative.size());
  const double total = relative.sum();
  double sum = 0, distance = 0;
  for (Index k = 0; k < relative.size(); ++k) {
    sum += relative[k];
    distance = std::max(distance, std::abs(sum / total - static_cast<double>(k + 1) / count));
  }
  return std::max(relative.maxCoeff() / relative.mean() / std::log(count / chance), std::sqrt(count) * distance / std::sqrt(std::log(2 / chance) / 2));
}

}  // namespace

double NoiseColour::density(double frequency, double dt) const {
  const double half = std::sin(std::numbers::pi * frequency * dt);
  double sum = white;
  for (const Part& part : parts_of(*this, dt)) sum += part.spectrum(half);
  return 2 * dt * sum;
}

namespace {

/// All parts, none smaller than a spectrum of a hundredth of the white one's: what a few lines said no of may be asked again. Of falling ones those of more than a hundredth of the white variance.
NoiseColour colour_from(const VectorXd& corner, const VectorXd& powers, double dt) {
  constexpr double least = 1e-6, hardly = 0.01;
  NoiseColour colour;
  colour.white = std::max(powers[0], least * powers.sum());
  colour.corner = corner;
  colour.power = powers.segment(1, corner.size()).cwiseMax(hardly * colour.white * std::numbers::pi * dt * corner);  // a part's spectrum is power / (pi corner dt) below its corner
  const auto falling = powers.tail(falling_corners.size());
  if ((falling.array() > hardly * colour.white).any()) colour.falling = (falling.array() > hardly * colour.white).select(falling, 0);
  return colour;
}

/// With a part slower than the stretches tell from a constant: noise that rises as far down as one can see goes on rising. The slowest that they tell has taken some of it for its own.
NoiseColour going_on(NoiseColour colour) {
  constexpr double share = 0.5;  // of the power of that: means over the parts of a record of 1/f noise then differ as they should, within a tenth
  const Index told = colour.corner.size();
  colour.corner.conservativeResize(told + 1);
  colour.power.conservativeResize(told + 1);
  colour.corner[told] = colour.corner[told - 1] / apart;
  colour.power[told] = share * colour.power[told - 1];
  return colour;
}

struct Longest {
  double duration = 0, dt = 0;
};

/// Of the greatest likelihood, where that has a colour.
struct CommonColour {
  NoiseColour colour;
  double farthest = 0;    // from white, of what it leaves of the residuals
  std::size_t which = 0;  // of them that is
};

Longest longest_stretch(const std::vector<RestResidual>& residuals) {
  Longest longest;
  for (const RestResidual& r : residuals)
    for (const Interval& s : stretches_of(r.value))
      if (const double duration = static_cast<double>(s.length()) * r.dt; duration > longest.duration) longest = {duration, r.dt};
  return longest;
}

std::optional<CommonColour> colour_in_common(const std::vector<RestResidual>& residuals) {
  const Longest longest = longest_stretch(residuals);
  if (!(longest.duration > 0)) return std::nullopt;
  const VectorXd corner = corners_for(1 / longest.dt, longest.duration);
  std::vector<Stretch> stretches;
  std::vector<std::size_t> owner;
  double of_white = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    std::vector<Stretch> own = periodograms(residuals[i], corner);
    if (own.empty()) continue;
    const Groups groups(own);
    if (!(groups.white()[0] > 0)) return std::nullopt;
    of_white += groups.log_likelihood(groups.white());
    owner.insert(owner.end(), own.size(), i);
    std::move(own.begin(), own.end(), std::back_inserter(stretches));
  }
  const Groups lines(stretches);
  const auto log_likelihood = [&](const VectorXd& powers) { return lines.log_likelihood(lines.basis * powers); };
  const auto is_more = [](double gained, Index parts) { return 2 * gained > once_in_a_thousand(static_cast<double>(parts)); };
  const Index correlated = corner.size(), all = lines.basis.cols() - 1;
  VectorXd powers = most_likely_powers(lines, 1 + correlated);
  const VectorXd with_falling = most_likely_powers(lines, 1 + all);
  const bool any = is_more(log_likelihood(powers) - of_white, correlated);
  const double gained = log_likelihood(with_falling) - (any ? log_likelihood(powers) : of_white);
  if (is_more(gained, any ? all - correlated : all)) powers = with_falling;
  else if (!any) return std::nullopt;
  CommonColour common{going_on(colour_from(corner, powers, longest.dt))};
  const double chance = 1e-3 / (2 * static_cast<double>(stretches.size()));  // Bonferroni: of two tests each
  for (std::size_t i = 0; i < stretches.size(); ++i)
    if (const double far = far_from_white(stretches[i].power.cwiseQuotient(stretches[i].basis * powers), chance); far > common.farthest) common.farthest = far, common.which = owner[i];
  return common;
}

}  // namespace

std::optional<NoiseColour> colour_of(const std::vector<RestResidual>& residuals) {
  const std::optional<CommonColour> common = colour_in_common(residuals);
  return common && common->farthest < 1 ? std::optional(common->colour) : std::nullopt;
}

std::optional<NoiseColour> colour_of_most(std::vector<RestResidual> residuals) {
  const std::size_t half = (residuals.size() + 1) / 2;
  for (;;) {
    const std::optional<CommonColour> common = colour_in_common(residuals);
    if (!common) return std::nullopt;
    if (common->farthest < 1) return common->colour;
    if (residuals.size() <= half) return std::nullopt;
    residuals.erase(residuals.begin() + static_cast<std::ptrdiff_t>(common->which));
  }
}

std::optional<NoiseColour> sized(const NoiseColour& colour, const RestResidual& residual) {
  const std::vector<Stretch> stretches = periodograms(residual, colour.corner);
  if (stretches.empty()) return std::nullopt;
  const Groups lines(stretches);
  VectorXd powers = VectorXd::Zero(lines.basis.cols());
  powers[0] = colour.white;
  powers.segment(1, colour.power.size()) = colour.power;
  powers.segment(1 + colour.power.size(), colour.falling.size()) = colour.falling;
  return colour_from(colour.corner, lines.size(lines.basis * powers) * powers, residual.dt);
}

WhiteningFilter::WhiteningFilter(const NoiseColour& colour, double dt) {
  const std::vector<Part> parts = parts_of(colour, dt);
  const auto m = static_cast<Index>(parts.size());
  const auto of_parts = [&](const auto& of) { return VectorXd::NullaryExpr(m, [&](Index i) { return of(parts[static_cast<std::size_t>(i)]); }).eval(); };
  pole_ = of_parts([](const Part& p) { return p.pole; });
  const VectorXd drive = of_parts([](const Part& p) { return p.drive; }), direct = of_parts([](const Part& p) { return p.direct; });
  const double at_once = colour.white + direct.squaredNorm();
  const MatrixXd stationary = of_parts([](const Part& p) { return p.state_variance(); }).asDiagonal();
  MatrixXd known = stationary;  // covariance of the parts before each sample, given those before it
  double innovation = 0;
  constexpr double settled = 1e-13;
  constexpr int most = 1000000;
  for (int i = 0; i < most; ++i) {
    innovation = known.sum() + at_once;
    gain_ = (pole_.cwiseProduct(known.rowwise().sum()) + drive.cwiseProduct(direct)) / innovation;
    MatrixXd next = pole_.asDiagonal() * known * pole_.asDiagonal();
    next -= innovation * gain_ * gain_.transpose();
    next.diagonal() += drive.cwiseAbs2();
    const bool done = (next - known).norm() <= settled * next.norm();
    known = 0.5 * (next + next.transpose());
    if (done) break;
  }
  feed_ = -gain_ * VectorXd::Ones(m).transpose();
  feed_.diagonal() += pole_;
  g_ = 1 + (gain_.array() / (1 - pole_.array())).sum();
  sigma_ = g_ * std::sqrt(innovation);
  unknown_ = stationary - known;
}

VectorXd WhiteningFilter::settled() const { return (MatrixXd::Identity(states(), states()) - feed_).partialPivLu().solve(gain_); }

void WhiteningFilter::filter(Eigen::Ref<MatrixXd> columns, MatrixXd& state) const {
  for (Index j = 0; j < columns.cols(); ++j)
    for (Index k = 0; k < columns.rows(); ++k) {
      const double innovation = columns(k, j) - state.col(j).sum();
      columns(k, j) = g_ * innovation;
      state.col(j) = pole_.cwiseProduct(state.col(j)) + gain_ * innovation;
    }
}

VectorXd WhiteningFilter::filtered(const VectorXd& readings) const {
  VectorXd white = readings;
  MatrixXd state = settled() * readings[0];
  filter(white, state);
  return white;
}

MatrixXd WhiteningFilter::start_information() const {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> parts(unknown_);
  constexpr double rounding = 1e-10;
  const VectorXd variance = parts.eigenvalues().cwiseMax(rounding * unknown_.diagonal().maxCoeff());
  return variance.cwiseSqrt().cwiseInverse().asDiagonal() * parts.eigenvectors().transpose();
}

void WhiteningFilter::append(Index channel, LinearSystem& system, ExactStep& step) const {
  const Index n = step.transition.rows(), m = states(), channels = system.C.rows();
  const DualMatrix row = system.C.block(channel, 0, 1, n);
  const MatrixXd gain = gain_, all = Eigen::RowVectorXd::Ones(m);
  step.transition = step.transition.grown(n + m, n + m);
  step.transition.set_block(n, 0, gain * row);
  step.transition.set_block(n, n, feed_);
  if (step.jerk.rows() > 0) step.jerk = step.jerk.grown(n + m, step.jerk.cols());
  const bool at_once = system.D.cols() > 0;
  for (DualMatrix* input : {&step.input0, &step.input1})
    if (input->rows() > 0 || at_once) *input = input->grown(n + m, input->cols());
  if (at_once) {
    const DualMatrix through = system.D.block(channel, 0, 1, system.D.cols());
    step.input0.set_block(n, 0, gain * through);
    system.D.set_block(channel, 0, g_ * through);
  }
  DualMatrix observe = system.C.grown(channels, n + m);
  observe.set_block(channel, 0, g_ * row);
  observe.set_block(channel, n, MatrixXd(-g_ * all));
  system.C = std::move(observe);
  system.A = system.A.grown(n + m, n + m);
  system.B = system.B.grown(n + m, system.B.cols());
}

}  // namespace unrig
