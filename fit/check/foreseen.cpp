#include "fit/check/foreseen.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "fit/fit.h"
#include "fit/likelihood/joint_problem.h"
#include "fit/search/first_guess.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Standard deviations by way of a unit diagonal.
VectorXd deviations(const MatrixXd& jacobian) {
  const VectorXd scale = jacobian.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  const MatrixXd scaled = jacobian * scale.asDiagonal();
  const MatrixXd inverse = (scaled.transpose() * scaled).ldlt().solve(MatrixXd::Identity(jacobian.cols(), jacobian.cols()));
  return inverse.diagonal().cwiseMax(0).cwiseSqrt().cwiseProduct(scale);
}

}  // namespace

std::vector<Foreseen> foresee(const Rig& rig, const std::vector<Run>& runs) {
  const AeroelasticModel model = model_of(rig, runs, Wagner::within_1e4);
  std::vector<RunResidual> residuals;
  for (const Run& run : runs) residuals.emplace_back(model, run, windows_to_fit(run), RunOptions{});
  JointProblem joint(model, std::move(residuals));
  guess_from_spectra(joint);
  hold_undetermined(joint);

  const MatrixXd jacobian = joint.linearise().jacobian;
  std::vector<Index> free;
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i)
    if (!joint.unknowns()[i].held) free.push_back(static_cast<Index>(i));
  const VectorXd deviation = deviations(jacobian(Eigen::all, free));

  std::vector<Foreseen> found;
  Index column = 0;
  for (const Unknown& u : joint.unknowns()) {
    const Parameter& p = joint.parameter(u);
    Foreseen f{p.name, p.unit, u.run < 0 ? std::string() : runs[static_cast<std::size_t>(u.run)].file, u.value, std::numeric_limits<double>::quiet_NaN(), false, {}};
    if (!u.held) f.std_error = deviation[column++];
    f.determined = !u.held && f.std_error < ignorance(p, u.value);
    if (!f.determined) f.advice = (u.why_held.empty() ? "These runs hardly respond to it" : u.why_held) + ". " + what_to_record(joint, u);
    found.push_back(std::move(f));
  }
  return found;
}

}  // namespace unrig
