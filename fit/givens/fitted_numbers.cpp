#include "fit/givens/fitted_numbers.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/rig/givens.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A number of the fit that stands for one here, and how many times as large it is here.
struct Match {
  Index place = -1;
  double times = 1;
};

Match match_of(const FittedRig& fit, const Given& given, const std::string& run, bool common) {
  const auto found = [&](const auto& is) { return std::find_if(fit.givens.begin(), fit.givens.end(), is); };
  auto same = found([&](const FittedGiven& g) { return g.name == given.name && g.run == run; });
  if (same == fit.givens.end() && common) same = found([&](const FittedGiven& g) { return g.name == given.name && !g.run.empty(); });
  if (same == fit.givens.end()) return {};
  return {same - fit.givens.begin(), same->run == run ? 1 : given.value / same->stated};
}

/// Every number of the fit must be stated here: those of the rig, and of the run where the fit knows it.
void check_all_are_stated(const FittedRig& fit, const Rig& rig, const Run& run, const std::string& known_as) {
  const auto states = [](const std::shared_ptr<const Givens>& givens, const std::string& name) {
    return givens && std::any_of(givens->numbers.begin(), givens->numbers.end(), [&](const Given& g) { return g.name == name; });
  };
  for (const FittedGiven& g : fit.givens) {
    const bool of_rig = g.run.empty();
    if (!of_rig && g.run != known_as) continue;
    if (states(of_rig ? rig.givens : run.givens, g.name)) continue;
    throw InputError({of_rig ? rig.file : run.file, 0}, fmt::format("no uncertainty is stated of {}", g.name), "wanted the file as the fit " + fit.file + " was made with: it adjusted this number",
                     "Give the same file, or fit again.");
  }
}

}  // namespace

FittedNumbers::FittedNumbers(const FittedRig& fit, const Rig& rig, const Run& run) : fit_(&fit), rig_(&rig), run_(&run) {
  const std::string known_as = fit.recorded_as(run.file);
  check_all_are_stated(fit, rig, run, known_as);
  std::vector<Match> matches;
  std::vector<const Given*> numbers;
  const auto list = [&](const Givens& givens, const std::string& file) {
    for (std::size_t i = 0; i < givens.numbers.size(); ++i) {
      Index deviation = 0;
      givens.spread.row(static_cast<Index>(i)).cwiseAbs().maxCoeff(&deviation);
      numbers.push_back(&givens.numbers[i]);
      matches.push_back(match_of(fit, givens.numbers[i], file, !file.empty() && givens.common[static_cast<std::size_t>(deviation)]));
    }
  };
  if (rig.givens) list(*rig.givens, "");
  of_rig_ = static_cast<Index>(numbers.size());
  constexpr const char* not_in_the_fit = "(none)";
  if (run.givens) list(*run.givens, known_as.empty() ? not_in_the_fit : known_as);
  const auto count = static_cast<Index>(numbers.size()), parameters = static_cast<Index>(fit.parameters.size());
  off_ = VectorXd::Zero(count);

  // What the fit knows, in stated standard deviations.
  std::vector<Index> known;
  for (const Match& m : matches)
    if (m.place >= 0 && std::find(known.begin(), known.end(), m.place) == known.end()) known.push_back(m.place);
  const auto size = static_cast<Index>(known.size());
  MatrixXd to_numbers = MatrixXd::Zero(count, size);
  VectorXd stated(size);
  for (Index k = 0; k < size; ++k) stated[k] = fit.givens[static_cast<std::size_t>(known[static_cast<std::size_t>(k)])].stated_std;
  for (Index i = 0; i < count; ++i) {
    const Match& m = matches[static_cast<std::size_t>(i)];
    if (m.place < 0) continue;
    const FittedGiven& g = fit.givens[static_cast<std::size_t>(m.place)];
    off_[i] = m.times * (g.value - g.stated);
    to_numbers(i, std::find(known.begin(), known.end(), m.place) - known.begin()) = m.times * g.stated_std;
  }
  if (size > 0) {
    std::vector<Index> place;
    for (const Index k : known) place.push_back(parameters + k);
    const VectorXd inverse = stated.cwiseInverse();
    const MatrixXd covariance = inverse.asDiagonal() * fit.joint_covariance(place, place) * inverse.asDiagonal();
    const MatrixXd with_parameters = fit.joint_covariance.topRows(parameters)(Eigen::all, place) * inverse.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance);
    constexpr double nothing = 1e-12;  // of the stated variance
    for (Index k = 0; k < size; ++k) {
      if (!(eigen.eigenvalues()[k] > nothing)) continue;
      const double root = std::sqrt(eigen.eigenvalues()[k]);
      directions_.push_back({to_numbers * eigen.eigenvectors().col(k) * root, with_parameters * eigen.eigenvectors().col(k) / root});
    }
  }

  // What it does not.
  std::string unknown;
  Index first = 0;
  for (const auto& givens : {rig.givens, run.givens}) {
    if (!givens) continue;
    const auto own = static_cast<Index>(givens->numbers.size());
    for (Index k = 0; k < givens->deviations(); ++k) {
      VectorXd off = VectorXd::Zero(count);
      for (Index i = 0; i < own; ++i)
        if (matches[static_cast<std::size_t>(first + i)].place < 0) off[first + i] = givens->spread(i, k);
      if (!off.isZero(0)) directions_.push_back({off, VectorXd::Zero(parameters)});
    }
    for (Index i = 0; i < own && givens == rig.givens; ++i)
      if (matches[static_cast<std::size_t>(first + i)].place < 0) unknown += (unknown.empty() ? "" : ", ") + givens->numbers[static_cast<std::size_t>(i)].name;
    first += own;
  }
  if (!unknown.empty()) warnings_.push_back(fmt::format("{}: states uncertainties that the fit {} knows nothing of ({}): its parameters do not go with them. Fit again.", rig.file, fit.file, unknown));
}

Rig FittedNumbers::rig(const VectorXd& off) const { return with_errors(*rig_, off_.head(of_rig_) + off.head(of_rig_)); }

Run FittedNumbers::run(const VectorXd& off) const {
  const Index own = off_.size() - of_rig_;
  return with_errors(*run_, off_.tail(own) + off.tail(own));
}

std::vector<Index> FittedNumbers::places_of_parameters(const AeroelasticModel& model, const std::string& run_file) const {
  std::vector<Index> places(fit_->parameters.size(), -1);
  for (std::size_t j = 0; j < model.parameters().size(); ++j) {
    const Parameter& p = model.parameters()[j];
    if (const FittedParameter* fitted = p.per_run ? nullptr : fit_->find(p.name, run_file)) places[static_cast<std::size_t>(fitted - fit_->parameters.data())] = static_cast<Index>(j);
  }
  return places;
}

FittedRig FittedNumbers::with_numbers_known() const {
  FittedRig known = *fit_;
  const auto count = static_cast<Index>(known.parameters.size());
  if (known.joint_covariance.size() == 0) return known;
  MatrixXd covariance = known.joint_covariance.topLeftCorner(count, count);
  for (const Direction& d : directions_) covariance -= d.parameters * d.parameters.transpose();
  // Of what is nearly all the numbers' error, rounding may leave less than nothing.
  constexpr double rounding = 1e-12;
  VectorXd deviation(count);
  for (Index i = 0; i < count; ++i) {
    deviation[i] = std::sqrt(std::max(covariance(i, i), rounding * known.joint_covariance(i, i)));
    if (double& error = known.parameters[static_cast<std::size_t>(i)].std_error; std::isfinite(error)) error = deviation[i];
  }
  const VectorXd inverse = deviation.unaryExpr([](double d) { return d > 0 ? 1 / d : 0.0; });
  MatrixXd correlation = inverse.asDiagonal() * covariance * inverse.asDiagonal();
  correlation.diagonal().setOnes();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(correlation);
  constexpr double least = 1e-9;
  correlation = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(least).asDiagonal() * eigen.eigenvectors().transpose();
  const VectorXd unit = correlation.diagonal().cwiseSqrt().cwiseInverse();
  known.correlation = unit.asDiagonal() * correlation * unit.asDiagonal();
  return known;
}

}  // namespace unrig
