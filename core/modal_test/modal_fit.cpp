#include "core/modal_test/modal_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include <unsupported/Eigen/NonLinearOptimization>

#include <fmt/format.h>

#include "core/numerics/spectrum.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::complex;
using std::numbers::pi;

constexpr int most_modes = 12, most_outside = 4;
constexpr Index residuals = 2;             ///< terms of each function for modes below and above
constexpr double last_digit = 1e-6;        ///< of a coherence as files print it
constexpr double most_damped = 0.3;        ///< beyond it a peak is none

int order_of(Measured response) { return response == Measured::velocity ? 1 : response == Measured::acceleration ? 2 : 0; }

/// A function ready to be fitted: angular frequency, (i w)^p, H and the standard deviation of its parts, up to a factor.
struct Data {
  VectorXd w, sigma;
  VectorXcd factor, h;
  double scale = 1;  ///< of sigma
  bool measured_sigma = false;
};

/// Variance of real and imaginary part of each line. The mean over two neighbours to either side: that of a line alone has 2 (n - 1) degrees of freedom, and weights that scatter so make errors too small.
VectorXd noise_of(const VectorXcd& h, const VectorXd& coherence, int averages) {
  constexpr Index neighbours = 2;
  VectorXd alone(h.size()), mean(h.size());
  for (Index k = 0; k < h.size(); ++k) {
    const double g = std::max(last_digit, coherence[k]), lost = std::max(last_digit, 1 - coherence[k]);
    alone[k] = std::norm(h[k]) * lost / (2 * std::max(1, averages - 1) * g);
  }
  for (Index k = 0; k < h.size(); ++k) {
    const Index first = std::max<Index>(0, k - neighbours), last = std::min(h.size(), k + neighbours + 1);
    mean[k] = alone.segment(first, last - first).mean();
  }
  return mean;
}

Data data_of(const FrequencyResponse& f, int averages) {
  Data d;
  d.w = 2 * pi * f.frequency;
  d.h = f.value;
  d.factor.resize(d.w.size());
  for (Index k = 0; k < d.w.size(); ++k) d.factor[k] = std::pow(complex<double>(0, d.w[k]), order_of(f.response));
  // A coherence of 1 throughout is that of a single blow and says nothing.
  d.measured_sigma = f.coherence.size() > 0 && f.coherence.minCoeff() < 1 - last_digit;
  d.sigma = VectorXd::Constant(d.w.size(), std::sqrt(d.h.squaredNorm() / static_cast<double>(d.h.size())));
  if (!d.measured_sigma) return d;
  const VectorXd noise = noise_of(d.h, f.coherence, averages);
  d.sigma = noise.cwiseMax(1e-24 * d.sigma.cwiseAbs2()).cwiseSqrt();
  return d;
}

/// Real and imaginary parts in turn, over the standard deviation.
VectorXd stacked(const VectorXcd& z, const Data& d) {
  VectorXd out(2 * z.size());
  for (Index k = 0; k < z.size(); ++k) {
    out[2 * k] = z[k].real() / (d.sigma[k] * d.scale);
    out[2 * k + 1] = z[k].imag() / (d.sigma[k] * d.scale);
  }
  return out;
}

complex<double> denominator(double w, double wk, double zeta) { return {wk * wk - w * w, 2 * zeta * wk * w}; }

/// One function at given poles x = (ln w_k, ln zeta_k): the linear unknowns (residues, u, l) that fit it best, what is left, and how that changes.
struct Solved {
  MatrixXd columns;   ///< weighted: of the residues, then u and l
  VectorXd unknowns, left;
  MatrixXd poles;     ///< weighted derivatives of the function in x, the linear unknowns held
  MatrixXd slope;     ///< of `left` in x, the linear unknowns following (Kaufman's approximation)
};

Solved solved(const Data& d, const VectorXd& x, bool slopes) {
  const Index modes = x.size() / 2, lines = d.w.size();
  Solved s;
  s.columns.resize(2 * lines, modes + residuals);
  VectorXd scale(modes + residuals);
  for (Index k = 0; k < modes + residuals; ++k) {
    VectorXcd column(lines);
    const double wk = k < modes ? std::exp(x[2 * k]) : 0, zeta = k < modes ? std::exp(x[2 * k + 1]) : 0;
    for (Index i = 0; i < lines; ++i) column[i] = k < modes ? d.factor[i] / denominator(d.w[i], wk, zeta) : k == modes ? d.factor[i] : -d.factor[i] / (d.w[i] * d.w[i]);
    s.columns.col(k) = stacked(column, d);
    scale[k] = std::max(s.columns.col(k).norm(), std::numeric_limits<double>::min());
  }
  const MatrixXd scaled = s.columns * scale.cwiseInverse().asDiagonal();
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(scaled);
  const VectorXd h = stacked(d.h, d);
  s.unknowns = qr.solve(h).cwiseQuotient(scale);
  s.left = h - s.columns * s.unknowns;
  if (!slopes) return s;
  s.poles.resize(2 * lines, 2 * modes);
  for (Index k = 0; k < modes; ++k) {
    const double wk = std::exp(x[2 * k]), zeta = std::exp(x[2 * k + 1]);
    VectorXcd in_w(lines), in_zeta(lines);
    for (Index i = 0; i < lines; ++i) {
      const complex<double> below = denominator(d.w[i], wk, zeta), cross(0, 2 * zeta * wk * d.w[i]), common = -s.unknowns[k] * d.factor[i] / (below * below);
      in_w[i] = common * (2 * wk * wk + cross);
      in_zeta[i] = common * cross;
    }
    s.poles.col(2 * k) = stacked(in_w, d);
    s.poles.col(2 * k + 1) = stacked(in_zeta, d);
  }
  const MatrixXd q = qr.householderQ() * MatrixXd::Identity(2 * lines, qr.rank());
  s.slope = -(s.poles - q * (q.transpose() * s.poles));
  return s;
}

/// Variable projection for Eigen's Levenberg-Marquardt (G. Golub and V. Pereyra, Inverse Problems 19 (2003) R1; L. Kaufman, BIT 15 (1975) 49).
struct Projected {
  using Scalar = double;
  using InputType = VectorXd;
  using ValueType = VectorXd;
  using JacobianType = MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  const std::vector<Data>& data;
  Index unknown, rows;

  int inputs() const { return static_cast<int>(unknown); }
  int values() const { return static_cast<int>(rows); }
  int operator()(const VectorXd& x, VectorXd& left) const {
    Index at = 0;
    for (const Data& d : data) {
      const VectorXd part = solved(d, x, false).left;
      left.segment(at, part.size()) = part;
      at += part.size();
    }
    return left.allFinite() ? 0 : -1;
  }
  int df(const VectorXd& x, MatrixXd& slope) const {
    Index at = 0;
    for (const Data& d : data) {
      const MatrixXd part = solved(d, x, true).slope;
      slope.middleRows(at, part.rows()) = part;
      at += part.rows();
    }
    return slope.allFinite() ? 0 : -1;
  }
};

Index rows_of(const std::vector<Data>& data) {
  return std::accumulate(data.begin(), data.end(), Index{0}, [](Index sum, const Data& d) { return sum + 2 * d.w.size(); });
}

/// A few steps tell which start leads somewhere; the end is settled to all digits.
enum class Search { first_look, to_the_end };

VectorXd searched(const std::vector<Data>& data, VectorXd x, Search how) {
  Projected projected{data, x.size(), rows_of(data)};
  Eigen::LevenbergMarquardt<Projected> search(projected);
  search.parameters.maxfev = how == Search::first_look ? 15 : 100;
  search.parameters.xtol = how == Search::first_look ? 1e-4 : 1e-10;
  search.parameters.ftol = how == Search::first_look ? 1e-4 : 1e-12;
  search.minimize(x);
  return x;
}

/// Bayes's criterion with the noise of each function unknown: sum n_j ln(left_j^2 / n_j) + k ln n.
double bic_of(const std::vector<Data>& data, const VectorXd& x) {
  double sum = 0;
  for (const Data& d : data) {
    const double n = 2 * static_cast<double>(d.w.size());
    sum += n * std::log(std::max(solved(d, x, false).left.squaredNorm() * d.scale * d.scale / n, std::numeric_limits<double>::min()));
  }
  const Index modes = x.size() / 2, functions = static_cast<Index>(data.size());
  return sum + static_cast<double>(2 * modes + functions * (modes + residuals)) * std::log(static_cast<double>(rows_of(data)));
}

/// Each function weighs by what it leaves.
void settle_scales(std::vector<Data>& data, const VectorXd& x, int averages) {
  for (Data& d : data) {
    const double free = std::max(1.0, static_cast<double>(2 * d.w.size() - x.size() / 2 - residuals));
    const double own = d.scale * std::sqrt(solved(d, x, false).left.squaredNorm() / free);
    d.scale = std::max(own, d.measured_sigma && averages > 0 ? 1.0 : 1e-12);
  }
}

struct Band {
  double low = std::numeric_limits<double>::infinity(), high = 0;  ///< rad/s
  bool holds(double w) const { return w > low && w < high; }
};

Band band_of(const std::vector<Data>& data) {
  Band band;
  for (const Data& d : data) band.low = std::min(band.low, d.w[0]), band.high = std::max(band.high, d.w[d.w.size() - 1]);
  return band;
}

/// Whether poles are such as modes may have, and no two share a peak: closer than a tenth of its width, where two modes with opposite residues would make anything. Poles outside of the band
/// stand for the modes there; of their damping nothing is asked.
bool sensible(const Band& band, const VectorXd& x) {
  constexpr double far = 10;
  for (Index k = 0; k < x.size() / 2; ++k) {
    const double wk = std::exp(x[2 * k]), zeta = std::exp(x[2 * k + 1]);
    if (!(wk > band.low / far && wk < band.high * far && zeta < 1)) return false;
    if (!band.holds(wk)) continue;
    if (!(zeta < most_damped && zeta > 1e-6)) return false;
    for (Index other = 0; other < k; ++other)
      if (std::abs(wk - std::exp(x[2 * other])) < 0.2 * std::max(zeta, std::exp(x[2 * other + 1])) * wk) return false;
  }
  return true;
}

Index within(const Band& band, const VectorXd& x) {
  Index count = 0;
  for (Index k = 0; k < x.size() / 2; ++k) count += band.holds(std::exp(x[2 * k])) ? 1 : 0;
  return count;
}

/// Angular frequencies at which what is left stands out most, of each function: as a mobility, in which peaks of modes are symmetric. And those of modes just outside of the band.
std::vector<double> candidates(const std::vector<Data>& data, const VectorXd& x, const std::vector<FrequencyResponse>& functions) {
  std::vector<double> found;
  for (std::size_t j = 0; j < data.size(); ++j) {
    const Data& d = data[j];
    const VectorXd left = solved(d, x, false).left;
    VectorXd power(d.w.size());
    for (Index i = 0; i < power.size(); ++i)
      power[i] = (std::pow(left[2 * i], 2) + std::pow(left[2 * i + 1], 2)) * std::pow(d.sigma[i] * std::pow(d.w[i], 1 - order_of(functions[j].response)), 2);
    if (!(power.maxCoeff() > 0)) continue;
    const VectorXd floor = noise_floor(power, std::max<Index>(8, power.size() / 16)).cwiseMax(1e-12 * power.maxCoeff());
    constexpr std::size_t strongest = 2;
    std::vector<Peak> peaks = peaks_above(power, floor, 3);
    for (std::size_t k = 0; k < std::min(strongest, peaks.size()); ++k) found.push_back(d.w[peaks[k].line]);
  }
  const Band band = band_of(data);
  found.insert(found.end(), {1.4 * band.high, 0.7 * band.low});
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end(), [](double a, double b) { return std::abs(a / b - 1) < 1e-3; }), found.end());
  return found;
}

/// The poles within the band alone.
VectorXd inside_of(const Band& band, const VectorXd& x) {
  VectorXd inside(2 * within(band, x));
  Index at = 0;
  for (Index k = 0; k < x.size() / 2; ++k)
    if (band.holds(std::exp(x[2 * k]))) inside.segment(2 * at++, 2) = x.segment(2 * k, 2);
  return inside;
}

/// The poles with one more, where it explains most; none where none is found. Poles that went out of the band on the way to it may stand for a mode within: it is tried without them too.
std::optional<VectorXd> one_more(const std::vector<Data>& data, const VectorXd& x, const std::vector<FrequencyResponse>& functions) {
  std::optional<VectorXd> best;
  double best_bic = std::numeric_limits<double>::infinity();
  const Band band = band_of(data);
  std::vector<VectorXd> from{x};
  if (within(band, x) < x.size() / 2) from.push_back(inside_of(band, x));
  for (const VectorXd& poles : from)
    for (const double w : candidates(data, poles, functions))
      for (const double zeta : {0.002, 0.02}) {
        VectorXd start(poles.size() + 2);
        start << poles, std::log(w), std::log(zeta);
        const VectorXd end = searched(data, start, Search::first_look);
        if (!end.allFinite() || !sensible(band, end)) continue;
        if (const double bic = bic_of(data, end); bic < best_bic) best = end, best_bic = bic;
      }
  if (!best) return best;
  const VectorXd end = searched(data, *best, Search::to_the_end);
  if (end.allFinite() && sensible(band, end)) best = end;
  return best;
}

/// Of poles and linear unknowns together, reordered mode by mode.
MatrixXd covariance_of(const std::vector<Data>& data, const VectorXd& x, const std::vector<Solved>& parts, const std::vector<Index>& listed) {
  const Index modes = x.size() / 2, functions = static_cast<Index>(data.size()), each = modes + residuals, all = 2 * modes + functions * each;
  MatrixXd normal = MatrixXd::Zero(all, all);
  for (Index j = 0; j < functions; ++j) {
    const Solved& s = parts[static_cast<std::size_t>(j)];
    const Index at = 2 * modes + j * each;
    normal.topLeftCorner(2 * modes, 2 * modes) += s.poles.transpose() * s.poles;
    normal.block(0, at, 2 * modes, each) = s.poles.transpose() * s.columns;
    normal.block(at, 0, each, 2 * modes) = normal.block(0, at, 2 * modes, each).transpose();
    normal.block(at, at, each, each) = s.columns.transpose() * s.columns;
  }
  const VectorXd scale = normal.diagonal().cwiseSqrt().cwiseMax(std::numeric_limits<double>::min()).cwiseInverse();
  const MatrixXd inverse = scale.asDiagonal() * MatrixXd((scale.asDiagonal() * normal * scale.asDiagonal()).ldlt().solve(MatrixXd::Identity(all, all))) * scale.asDiagonal();
  // d f = f d ln w, d zeta = zeta d ln zeta.
  MatrixXd to = MatrixXd::Zero(static_cast<Index>(listed.size()) * (2 + functions), all);
  for (std::size_t i = 0; i < listed.size(); ++i) {
    const Index k = listed[i], at = static_cast<Index>(i) * (2 + functions);
    to(at, 2 * k) = std::exp(x[2 * k]) / (2 * pi);
    to(at + 1, 2 * k + 1) = std::exp(x[2 * k + 1]);
    for (Index j = 0; j < functions; ++j) to(at + 2 + j, 2 * modes + j * each + k) = 1;
  }
  return to * inverse * to.transpose();
}

VectorXd ascending(const VectorXd& x) {
  std::vector<Index> order(static_cast<std::size_t>(x.size() / 2));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return x[2 * a] < x[2 * b]; });
  VectorXd sorted(x.size());
  for (std::size_t k = 0; k < order.size(); ++k) sorted.segment(2 * static_cast<Index>(k), 2) = x.segment(2 * order[k], 2);
  return sorted;
}

/// To all digits, scales with it; poles ascending.
VectorXd settled(std::vector<Data>& data, VectorXd x, int averages) {
  constexpr int rounds = 2;  // scales follow what is left
  for (int round = 0; round < rounds; ++round) {
    settle_scales(data, x, averages);
    x = searched(data, x, Search::to_the_end);
  }
  settle_scales(data, x, averages);
  return ascending(x);
}

/// The mode in the band whose residues say least, where none is five standard deviations from 0: of some thousand lines one in 500 such tests has that by chance.
std::optional<Index> by_chance(const std::vector<Data>& data, const VectorXd& x, const Band& band) {
  constexpr double significant = 5;
  std::vector<Solved> parts;
  for (const Data& d : data) parts.push_back(solved(d, x, true));
  std::vector<Index> all(static_cast<std::size_t>(x.size() / 2));
  std::iota(all.begin(), all.end(), 0);
  const MatrixXd covariance = covariance_of(data, x, parts, all);
  const Index functions = static_cast<Index>(data.size());
  std::optional<Index> least;
  double least_ratio = significant;
  for (const Index k : all) {
    if (!band.holds(std::exp(x[2 * k]))) continue;
    double ratio = 0;
    for (Index j = 0; j < functions; ++j) {
      const Index at = k * (2 + functions) + 2 + j;
      ratio = std::max(ratio, std::abs(parts[static_cast<std::size_t>(j)].unknowns[k]) / std::sqrt(covariance(at, at)));
    }
    if (!(ratio >= least_ratio)) least = k, least_ratio = ratio;
  }
  return least;
}

}  // namespace

ModalFit fit_modes(const std::vector<FrequencyResponse>& functions, const ModalFitOptions& options) {
  std::vector<Data> data;
  for (const FrequencyResponse& f : functions) data.push_back(data_of(f, options.averages));
  const Band band = band_of(data);
  VectorXd x(0);
  double bic = bic_of(data, x);
  const Index wanted = options.modes > 0 ? options.modes : most_modes;
  for (int tries = 0; tries < wanted + most_outside; ++tries) {
    settle_scales(data, x, options.averages);
    const std::optional<VectorXd> more = one_more(data, x, functions);
    if (!more || within(band, *more) > wanted) break;
    const double with = bic_of(data, *more);
    if (!(with < bic) && (options.modes == 0 || within(band, x) == wanted)) break;
    x = *more;
    bic = with;
  }
  if (within(band, x) == 0) throw NoAnswer("no mode stands out of the frequency response functions");
  if (options.modes > 0 && within(band, x) < wanted) throw NoAnswer(fmt::format("{} of {} modes stand out of the frequency response functions", within(band, x), wanted));
  x = settled(data, x, options.averages);
  while (options.modes == 0) {
    const std::optional<Index> chance = by_chance(data, x, band);
    if (!chance) break;
    VectorXd without(x.size() - 2);
    without << x.head(2 * *chance), x.tail(x.size() - 2 * *chance - 2);
    x = settled(data, without, options.averages);
    if (within(band, x) == 0) throw NoAnswer("no mode stands out of the frequency response functions");
  }

  ModalFit fit;
  std::vector<Solved> parts;
  double chi2 = 0, free = -static_cast<double>(x.size());
  for (const Data& d : data) {
    parts.push_back(solved(d, x, true));
    const double left = parts.back().left.squaredNorm() * d.scale * d.scale;
    chi2 += left;
    free += static_cast<double>(2 * d.w.size() - x.size() / 2 - residuals);
    fit.share_left.push_back((parts.back().left.array() * d.scale * d.sigma.replicate(1, 2).transpose().reshaped().array()).matrix().norm() / d.h.norm());
  }
  if (options.averages > 0 && std::all_of(data.begin(), data.end(), [](const Data& d) { return d.measured_sigma; })) fit.reduced_chi2 = chi2 / std::max(1.0, free);
  std::vector<Index> listed;
  for (Index k = 0; k < x.size() / 2; ++k) {
    if (!band.holds(std::exp(x[2 * k]))) continue;
    listed.push_back(k);
    FittedMode mode{std::exp(x[2 * k]) / (2 * pi), std::exp(x[2 * k + 1]), VectorXd(static_cast<Index>(data.size()))};
    for (std::size_t j = 0; j < data.size(); ++j) mode.residue[static_cast<Index>(j)] = parts[j].unknowns[k];
    fit.modes.push_back(std::move(mode));
  }
  if (fit.modes.empty()) throw NoAnswer("no mode stands out of the frequency response functions");
  fit.covariance = covariance_of(data, x, parts, listed);
  fit.outside = x.size() / 2 - static_cast<Index>(listed.size());
  return fit;
}

}  // namespace unrig
