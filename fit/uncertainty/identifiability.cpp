#include "fit/uncertainty/identifiability.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/solver/gauss_newton.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Indices = std::vector<Index>;

constexpr double takes_part = 1e-4;  // component of a unit vector of the scaled null space
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Singular values and right singular vectors of a Jacobian with its columns scaled to unit length.
struct Decomposition {
  VectorXd length;  ///< of the columns; 1 where a column is zero
  VectorXd singular_values;
  MatrixXd v;
  Index rank = 0;
};

Decomposition decompose(const MatrixXd& jacobian, double threshold) {
  const Index n = jacobian.cols();
  Decomposition d;
  d.length = VectorXd::Ones(n);
  MatrixXd scaled = MatrixXd::Zero(std::max(jacobian.rows(), n), n);
  for (Index j = 0; j < n; ++j) {
    const double length = jacobian.col(j).stableNorm();
    if (length > 0) d.length[j] = length;
    scaled.col(j).head(jacobian.rows()) = jacobian.col(j) / d.length[j];
  }
  const MatrixXd r = scaled.householderQr().matrixQR().topRows(n).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<MatrixXd> svd(r, Eigen::ComputeFullV);
  d.singular_values = svd.singularValues();
  d.v = svd.matrixV();
  d.rank = (d.singular_values.array() > threshold).count();
  return d;
}

/// Rows of a basis (n x k) of a null space that fix it: those to be held first where they take part, else those that take part most.
Indices choose_pivots(const MatrixXd& basis, const std::vector<bool>& hold_first) {
  constexpr double clearly = 1e-2;
  MatrixXd rest = basis;
  Indices pivots;
  for (Index k = 0; k < basis.cols(); ++k) {
    const VectorXd part = rest.rowwise().norm();
    Index best = 0;
    const auto rank = [&](Index i) { return std::make_pair(hold_first[static_cast<std::size_t>(i)] && part[i] > clearly, part[i]); };
    for (Index i = 1; i < part.size(); ++i)
      if (rank(i) > rank(best)) best = i;
    pivots.push_back(best);
    const VectorXd direction = rest.row(best).transpose().normalized();
    rest -= (rest * direction).eval() * direction.transpose();
  }
  return pivots;
}

std::string signed_number(double x) { return fmt::format("{:+.3g}", x); }

/// A product of powers with simple exponents ("k m^-2" as k / m^2), or, where they are not simple, a sum.
std::string power(const std::string& name, double exponent) { return exponent == 1 ? name : fmt::format("{}^{:.3g}", name, exponent); }

bool simple(double exponent) { return std::abs(2 * exponent - std::round(2 * exponent)) < 2e-3 && std::abs(exponent) < 4; }

/// -relative, to the half that it is.
double exponent_of(const Tie& tie, std::size_t k) { return -std::round(2 * tie.relative(k)) / 2; }

/// Names what the null space of the free unknowns leaves open.
void name_undetermined(const LeastSquaresProblem& problem, const LeastSquaresPoint& point, const Indices& free, const Decomposition& d,
                       const CovarianceOptions& options, Covariance& result) {
  const Index count = static_cast<Index>(free.size()), open = count - d.rank;
  if (open == 0) return;
  std::vector<bool> hold_first(static_cast<std::size_t>(count), false);
  for (std::size_t held : options.hold_first)
    for (std::size_t a = 0; a < free.size(); ++a)
      if (free[a] == static_cast<Index>(held)) hold_first[a] = true;
  const MatrixXd basis = d.v.rightCols(open);
  const Indices pivots = choose_pivots(basis, hold_first);
  const MatrixXd follow = basis * MatrixXd(basis(pivots, Eigen::all)).inverse();  // of scaled unknowns: 1 at the own pivot, 0 at the others

  const auto unknown = [&](Index a) -> Identifiability& { return result.unknowns[static_cast<std::size_t>(free[static_cast<std::size_t>(a)])]; };
  const auto is_pivot = [&](Index a) { return std::find(pivots.begin(), pivots.end(), a) != pivots.end(); };
  const auto own = [&](Index a) {
    const LeastSquaresUnknown& u = problem.unknowns[static_cast<std::size_t>(free[static_cast<std::size_t>(a)])];
    return unknown(a).value != 0 ? unknown(a).value : u.scale > 0 ? u.scale : 1;
  };
  std::vector<std::string> stuck(static_cast<std::size_t>(count));
  for (Index k = 0; k < open; ++k) {
    const Index p = pivots[static_cast<std::size_t>(k)];
    const double unit = own(p) * d.length[p];  // scaled change that is the pivot's own value
    UndeterminedDirection direction{VectorXd::Zero(point.values.size()), static_cast<std::size_t>(free[static_cast<std::size_t>(p)]), {}};
    const auto describe = [&](Index a, double change) {
      const bool zero = unknown(a).value == 0;
      return unknown(a).name + " " + signed_number(zero ? change : 100 * change / unknown(a).value) + (zero ? "" : " %");
    };
    const double percent = unknown(p).value != 0 ? 0.01 : 1;
    std::string others;
    for (Index a = 0; a < count; ++a) {
      const double change = follow(a, k) * unit / d.length[a];
      if (a != p && std::abs(follow(a, k)) < takes_part) continue;
      direction.change[free[static_cast<std::size_t>(a)]] = change;
      if (a != p) others += (others.empty() ? "" : ", ") + describe(a, percent * change);
    }
    direction.text = others.empty() ? "the data do not respond to " + unknown(p).name : describe(p, percent * own(p)) + " with " + others;
    if (others.empty()) stuck[static_cast<std::size_t>(p)] = "the data do not respond to it";
    result.undetermined.push_back(std::move(direction));
  }
  // What is determined: every follower less what its pivots give it.
  for (Index a = 0; a < count; ++a) {
    if (is_pivot(a)) continue;
    Tie tie{unknown(a).name, unknown(a).value, {}, {}, {}};
    Indices tied;
    for (Index k = 0; k < open; ++k) {
      const Index p = pivots[static_cast<std::size_t>(k)];
      if (std::abs(follow(a, k)) < takes_part) continue;
      tied.push_back(p);
      tie.add(unknown(p).name, unknown(p).value, follow(a, k) * d.length[p] / d.length[a]);
    }
    if (tied.empty()) continue;
    tied.push_back(a);
    for (Index b : tied) {
      std::string& text = stuck[static_cast<std::size_t>(b)];
      text += (text.empty() ? "only together with others; determined: " : ", ") + tie.determined();
    }
  }
  for (Index a = 0; a < count; ++a) {
    if (stuck[static_cast<std::size_t>(a)].empty()) continue;
    unknown(a).determined = false;
    unknown(a).combination = stuck[static_cast<std::size_t>(a)];
  }
}

/// How far from its bound an unknown may go until chi2 has risen by `rise`: 2 |g| d + h d^2 = rise, h with the others at their least.
double one_sided_error(const LeastSquaresPoint& point, const Indices& free, Index j, double rise) {
  const double slope = std::abs(point.jacobian.col(j).dot(point.residual));
  VectorXd own = point.jacobian.col(j);
  if (!free.empty()) {
    MatrixXd others = point.jacobian(Eigen::all, free);
    for (Index a = 0; a < others.cols(); ++a)
      if (const double length = others.col(a).norm(); length > 0) others.col(a) /= length;
    own -= others * others.colPivHouseholderQr().solve(own);
  }
  const double curvature = own.squaredNorm();
  return rise / (slope + std::sqrt(slope * slope + curvature * rise));
}

}  // namespace

void Tie::add(const std::string& pivot, double pivot_value, double slope_with_it) {
  pivots.push_back(pivot);
  pivot_values.push_back(pivot_value);
  slope.push_back(slope_with_it);
}

double Tie::relative(std::size_t k) const { return own != 0 && pivot_values[k] != 0 ? slope[k] * pivot_values[k] / own : nan; }

bool Tie::is_product() const {
  for (std::size_t k = 0; k < pivots.size(); ++k)
    if (const double exponent = relative(k); std::isnan(exponent) || !simple(exponent) || exponent_of(*this, k) == 0) return false;
  return true;
}

std::string Tie::determined() const {
  if (is_product()) {
    std::string above = name, below;
    for (std::size_t k = 0; k < pivots.size(); ++k) {
      const double exponent = exponent_of(*this, k);
      (exponent > 0 ? above : below) += (exponent > 0 || !below.empty() ? " " : "") + power(pivots[k], std::abs(exponent));
    }
    return below.empty() ? above : above + " / " + (below.find(' ') == std::string::npos ? below : "(" + below + ")");
  }
  std::string sum = name;
  for (std::size_t k = 0; k < pivots.size(); ++k) {
    const double factor = std::abs(slope[k]);
    sum += (slope[k] > 0 ? " - " : " + ") + (std::abs(factor - 1) < 1e-3 ? pivots[k] : fmt::format("{:.6g} {}", factor, pivots[k]));
  }
  return sum;
}

double Tie::value() const {
  double combination = own;
  for (std::size_t k = 0; k < pivots.size(); ++k)
    combination = is_product() ? combination * std::pow(pivot_values[k], exponent_of(*this, k)) : combination - slope[k] * pivot_values[k];
  return combination;
}

double Tie::gain() const { return is_product() ? value() / own : 1; }

std::string Covariance::text() const {
  std::string all;
  for (const Identifiability& u : unknowns) {
    if (u.combination.empty()) continue;
    all += fmt::format("{}{}: {}.", all.empty() ? "" : " ", u.name, u.combination);
  }
  return all;
}

Covariance covariance(const LeastSquaresProblem& problem, const LeastSquaresPoint& point, const CovarianceOptions& options) {
  const auto count = static_cast<Index>(problem.unknowns.size());
  const VectorXd slope = point.jacobian.transpose() * point.residual;
  Covariance result;
  result.matrix = MatrixXd::Zero(count, count);
  Indices free, pressed;
  for (Index j = 0; j < count; ++j) {
    const LeastSquaresUnknown& unknown = problem.unknowns[static_cast<std::size_t>(j)];
    Identifiability what{unknown.name, point.values[j], nan, unknown.held, !unknown.held, false, {}};
    what.at_bound = !unknown.held && pressed_against_bound(unknown, point.values[j], slope[j]);
    if (what.at_bound) what.combination = fmt::format("at its {} bound {:.6g}, beyond which the data would have it", slope[j] > 0 ? "lower" : "upper", point.values[j]);
    if (what.at_bound) pressed.push_back(j);
    else if (!unknown.held) free.push_back(j);
    result.unknowns.push_back(std::move(what));
  }
  for (Index j : pressed) result.unknowns[static_cast<std::size_t>(j)].std_error = one_sided_error(point, free, j, options.variance_factor);
  if (free.empty()) return result;

  const Decomposition d = decompose(point.jacobian(Eigen::all, free), options.rank_threshold);
  result.rank = d.rank;
  result.singular_values = d.singular_values;
  name_undetermined(problem, point, free, d, options, result);
  const VectorXd inverse_length = d.length.cwiseInverse();
  const MatrixXd half = inverse_length.asDiagonal() * d.v.leftCols(d.rank) * d.singular_values.head(d.rank).cwiseInverse().asDiagonal();
  result.matrix(free, free) = options.variance_factor * half * half.transpose();
  for (Index j : free) {
    Identifiability& unknown = result.unknowns[static_cast<std::size_t>(j)];
    if (unknown.determined) {
      unknown.std_error = std::sqrt(result.matrix(j, j));
    } else {
      result.matrix.row(j).setConstant(nan);
      result.matrix.col(j).setConstant(nan);
    }
  }
  return result;
}

}  // namespace unrig
