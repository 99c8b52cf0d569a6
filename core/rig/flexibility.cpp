#include "core/rig/flexibility.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double allowed_asymmetry = 1e-2;

void check_diagonal(const GivenFlexibility& given) {
  for (Index i = 0; i < given.rows.rows(); ++i) {
    if (given.rows(i, i) > 0) continue;
    throw InputError(given.place, fmt::format("{} of element {} under its own load is {}", given.name, i + 1, given.rows(i, i)),
                     "wanted a value above zero on the diagonal", "");
  }
}

double largest_std(const GivenFlexibility& given, Index i, Index j) {
  return given.std.size() == 0 ? 0 : std::hypot(given.std(i, j), given.std(j, i));
}

void check_symmetry(const GivenFlexibility& given) {
  const MatrixXd& a = given.rows;
  for (Index i = 0; i < a.rows(); ++i) {
    for (Index j = 0; j < i; ++j) {
      const double allowed = std::max(allowed_asymmetry * std::sqrt(a(i, i) * a(j, j)), 3 * largest_std(given, i, j));
      if (std::abs(a(i, j) - a(j, i)) <= allowed) continue;
      throw InputError(
          given.place,
          fmt::format("{} is not symmetric: element {} under a load at {} moves by {:.6g}, element {} under a load at {} by {:.6g} (SI)",
                      given.name, i + 1, j + 1, a(i, j), j + 1, i + 1, a(j, i)),
          "wanted equal entries across the diagonal", "Look for a slip of the pen in these two.");
    }
  }
}

/// How far an entry of the scaled matrix may be off.
double entry_error(const GivenFlexibility& given, const VectorXd& root) {
  if (given.std.size() == 0) return printed_rounding;
  return std::max(printed_rounding, (given.std.array() / (root * root.transpose()).array()).maxCoeff());
}

void check_definite(const GivenFlexibility& given, const MatrixXd& a, std::vector<std::string>& warnings) {
  const VectorXd root = a.diagonal().cwiseSqrt();
  const MatrixXd scaled = a.cwiseQuotient(root * root.transpose());
  const VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<MatrixXd>(scaled, Eigen::EigenvaluesOnly).eigenvalues();
  const double smallest = eigenvalues[0];
  const double n = static_cast<double>(a.rows());
  const double bound = n * entry_error(given, root);
  if (smallest < -bound) {
    throw InputError(
        given.place,
        fmt::format("{} is not positive definite: scaled to a unit diagonal its smallest eigenvalue is {:.3g}, beyond the {:.2g} that "
                    "the rounding of its entries explains",
                    given.name, smallest, bound),
        "wanted a matrix under which no load does negative work", "Look for a wrong sign or digit.");
  }
  const double round_off = n * std::numeric_limits<double>::epsilon();
  if (smallest < round_off) {
    warnings.push_back(fmt::format("{}:{}: the printed digits of {} leave the stiffest shapes of the rig undetermined (smallest scaled eigenvalue {:.2g})",
                                   given.place.file, given.place.line, given.name, smallest));
  }
}

}  // namespace

Eigen::MatrixXd checked_flexibility(const GivenFlexibility& given, std::vector<std::string>& warnings) {
  check_diagonal(given);
  check_symmetry(given);
  const MatrixXd symmetric = (given.rows + given.rows.transpose()) / 2;
  check_definite(given, symmetric, warnings);
  return symmetric;
}

}  // namespace unrig
