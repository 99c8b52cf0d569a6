#include "fit/givens/price.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>

#include "core/rig/givens.h"
#include "fit/givens/inexact_uncertainty.h"
#include "fit/givens/stated_numbers.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double of_clock = 0.1;  // per cent: clocks are better than the rest

/// The joint fit as `result` left it.
Arrival arrival_of(const FitProblem& problem, const FitResult& result) {
  const auto model = std::make_shared<const AeroelasticModel>(model_of(problem.rig, problem.runs, problem.circulation, problem.effects));
  std::vector<std::vector<MotionBasis::Window>> windows;
  std::vector<RunResidual> runs;
  for (const Run& run : problem.runs) {
    windows.push_back(windows_to_fit(run));
    runs.emplace_back(*model, run, windows.back());
  }
  Arrival arrival{model, std::move(windows), JointProblem(*model, std::move(runs))};
  for (Unknown& u : arrival.joint.unknowns()) {
    const std::string run = u.run < 0 ? "" : problem.runs[static_cast<std::size_t>(u.run)].file, &name = arrival.joint.parameter(u).name;
    const auto fitted = std::find_if(result.parameters.begin(), result.parameters.end(), [&](const FittedParameter& p) { return p.name == name && p.run == run; });
    if (fitted == result.parameters.end()) throw std::invalid_argument("a fit without " + name);
    u.value = fitted->value;
    u.held = !std::isfinite(fitted->std_error);
  }
  for (std::size_t r = 0; r < arrival.joint.runs().size(); ++r) arrival.joint.runs()[r].settle_noise(arrival.joint.theta(r));
  return arrival;
}

/// By how many per cent a load of the section goes up with one per cent of the group, its coefficient being what it is: s rho U^2 b L.
double of_load(const std::string& group) {
  if (group == "speed") return 2;
  return group == "density" || group == "section.chord" || group == "submerged.strip_length" ? 1 : 0;
}

}  // namespace

PriceList price_of_numbers(const FitProblem& problem, const FitResult& result) {
  FitProblem priced = problem;
  priced.rig.givens = std::make_shared<const Givens>(one_per_cent_of_everything(problem.rig));
  for (Run& run : priced.runs) run.givens = std::make_shared<const Givens>(one_per_cent_of_everything(run));
  const Arrival arrival = arrival_of(priced, result);
  const StatedNumbers numbers(priced.rig, priced.runs);
  const JointInformation information = joint_information(arrival.joint, number_slopes(arrival, numbers, VectorXd::Zero(numbers.deviations())));
  const auto free = static_cast<Index>(information.free.size());
  const MatrixXd of_unknowns = information.of_data.topLeftCorner(free, free);
  const VectorXd scale = of_unknowns.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd shift = -(scale.asDiagonal() *
                           MatrixXd(scale.asDiagonal() * of_unknowns * scale.asDiagonal()).ldlt().solve(MatrixXd(scale.asDiagonal() * information.of_data.topRightCorner(free, numbers.deviations()))));

  PriceList list;
  std::vector<Index> shared, slopes;
  for (Index a = 0; a < free; ++a) {
    const Unknown& u = arrival.joint.unknowns()[static_cast<std::size_t>(information.free[static_cast<std::size_t>(a)])];
    const std::string& name = arrival.joint.parameter(u).name;
    if (u.run < 0) shared.push_back(a), list.names.push_back(name);
    else if (name == "normal_force_slope") slopes.push_back(a);
  }
  if (!slopes.empty()) list.names.insert(list.names.end(), {"normal_force_slope", "load"});
  const auto part = [&](Index a, Index k) { return 100 * shift(a, k) / arrival.joint.unknowns()[static_cast<std::size_t>(information.free[static_cast<std::size_t>(a)])].value; };
  for (Index k = 0; k < numbers.deviations(); ++k) {
    Price price{numbers.groups()[static_cast<std::size_t>(k)], 1, VectorXd(static_cast<Index>(list.names.size()))};
    if (price.group == "clock") price.per_cent = of_clock;
    for (std::size_t i = 0; i < shared.size(); ++i) price.change[static_cast<Index>(i)] = price.per_cent * part(shared[i], k);
    if (!slopes.empty()) {
      double mean = 0;
      for (const Index a : slopes) mean += price.per_cent * part(a, k) / static_cast<double>(slopes.size());
      price.change.tail(2) << mean, mean + price.per_cent * of_load(price.group);
    }
    list.prices.push_back(std::move(price));
  }
  return list;
}

std::string report(const PriceList& list) {
  std::string text = "[[The price of what you told me]] change in per cent of itself, were the numbers of a row off by so much, all alike\n";
  std::size_t width = 0;
  for (const Price& price : list.prices) width = std::max(width, price.group.size());
  text += fmt::format("    {:<{}}", "", width + 8);
  for (const std::string& name : list.names) text += "  " + name;
  text += "\n";
  for (const Price& price : list.prices) {
    text += fmt::format("    {:<{}} {:+5.1f} %", price.group, width, price.per_cent);
    for (std::size_t i = 0; i < list.names.size(); ++i) text += fmt::format("  {:>{}.3f}", price.change[static_cast<Index>(i)], list.names[i].size());
    text += "\n";
  }
  return text;
}

}  // namespace unrig
