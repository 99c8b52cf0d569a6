#include "fit/laws/law_regression.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "core/numerics/work.h"
#include "core/propagate/nonlinear_response.h"
#include "fit/force/missing_force.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// The linear rig with one input, the place where a law acts, and one output.
struct Port {
  LinearSystem system;
  MatrixXd reads;  // x, v, twist, twist rate over the states
};

Port port_of(const RunResidual& run, const VectorXd& theta, ActsOn place) {
  Rig rig = run.model().rig();
  rig.laws.clear();
  const char* text = place == ActsOn::torsion ? "unrig_law = 1\nname = \"port\"\nacts_on = \"torsion\"\nforce = \"-c * twist\"\n[parameters]\nc = { start = \"0 N.m\" }\n[scales]\ntwist = \"1 rad\"\n"
                                              : "unrig_law = 1\nname = \"port\"\nacts_on = \"normal\"\nforce = \"-c * x\"\n[parameters]\nc = { start = \"0 N\" }\n[scales]\nx = \"1 m\"\n";
  add_law(rig, parse_law(text, "the port of a law"));
  const std::string id = rig.laws.front()->id;
  const AeroelasticModel model = AeroelasticModel(rig, run.model().basis(), run.model().circulation()).with_effects({id});
  VectorXd values = model.start_values();
  const std::vector<Parameter>& own = run.model().parameters();
  for (std::size_t k = 0; k < own.size(); ++k)
    for (std::size_t i = 0; i < model.parameters().size(); ++i)
      if (model.parameters()[i].name == own[k].name) values[static_cast<Index>(i)] = theta[static_cast<Index>(k)];
  Port port{model.system(run.conditions(), values, {run.channels().front()}), {}};
  LinearSystem& s = port.system;
  const Index last = s.B.cols() - 1;
  s = under_one_input(std::move(s), last);
  const RowVectorXd shape = first_mode(model, s.coordinates);
  port.reads = MatrixXd::Zero(4, s.states());
  port.reads.row(0) = displacement_of(s, shape);
  port.reads.row(1) = rate_of(s, shape);
  const Basis& basis = model.basis();
  if (basis.torsion_modes > 0) {
    RowVectorXd twist = RowVectorXd::Zero(s.coordinates);
    twist[basis.normal_modes] = basis.twist(rig.submerged.back() - 1, basis.normal_modes);
    port.reads.row(2) = displacement_of(s, twist);
    port.reads.row(3) = rate_of(s, twist);
  }
  return port;
}

constexpr std::array<double, 5> densities{1, 0.1, 0.01, 1e-3, 1e-4};  // times the one that the readings ask for where no law is known

/// What one decay says.
struct Said {
  std::vector<LawRegression::Level> levels;
  double samples = 0;
};

std::optional<Said> ask(const RunResidual& run, const VectorXd& theta, ActsOn place, const LawRegression::Forces& forces, const MatrixXd& states) {
  const RunResidual::Prediction p = run.predict(theta);
  if (!p.output.allFinite()) return std::nullopt;
  const Port port = port_of(run, theta, place);
  const double dt = run.run().dt;
  const Index samples = states.cols(), n = port.system.states();
  if (port.system.B.value.norm() == 0) return std::nullopt;
  VectorXd left = (run.run().channel(run.channels().front()).value - p.output.col(0)).head(samples), counts = VectorXd::Ones(samples), offset = VectorXd::Ones(samples);
  for (Index k = 0; k < samples; ++k)
    if (!(run.channel_weight(0)[k] > 0) || !std::isfinite(left[k])) left[k] = offset[k] = std::nan(""), counts[k] = 0;
  const MissingForce force = estimate_force(port.system, dt, left, run.noise(0));
  const MatrixXd moved = port.reads * states.topRows(n);

  // Shifts of stiffness and damping (not of mass: an acceleration that the readings show has the law's force in it), the law's columns.
  constexpr Index shifts = 2;
  const MatrixXd along = forces(moved, run.conditions(), dt);
  const Index count = along.cols();
  MatrixXd all(samples, shifts + count);
  all << moved.middleRows(place == ActsOn::torsion ? 2 : 0, shifts).transpose(), along;
  const VectorXd size = all.colwise().norm().cwiseMax(1e-300);
  all = (all * size.cwiseInverse().asDiagonal()).eval();
  if (!all.allFinite()) all = all.unaryExpr([](double v) { return std::isfinite(v) ? v : 0; });

  Said said{{}, counts.sum()};
  VectorXd per_column = VectorXd::Ones(count + 1);
  per_column.head(count) = size.tail(count);
  for (const double density : densities) {
    const ForceFilter filter(port.system, dt, density * force.roughness, run.noise(0));
    const MatrixXd e = filter.innovations_of_forces(all, counts);
    const Index initial = filter.states();
    MatrixXd nuisance(samples, shifts + initial + 1), rest(samples, count + 1);
    nuisance << e.leftCols(shifts), e.rightCols(initial), filter.innovations(offset);
    rest << e.middleCols(shifts, count), filter.innovations(left);
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(nuisance);
    rest.applyOnTheLeft(qr.householderQ().adjoint());
    const MatrixXd behind = rest.bottomRows(samples - qr.rank());
    MatrixXd products = MatrixXd::Zero(count + 1, count + 1);
    products.selfadjointView<Eigen::Lower>().rankUpdate(behind.transpose(), 1 / filter.variance());
    products.triangularView<Eigen::StrictlyUpper>() = products.transpose();
    count_work(behind.rows() * (count + 1) * (count + 2) / 2);
    said.levels.push_back({per_column.asDiagonal() * products * per_column.asDiagonal(), said.samples * std::log(filter.variance()), density});
  }
  return said;
}

}  // namespace

LawRegression::LawRegression(ActsOn place, const BesideUnknownForces& beside, const Forces& forces) {
  std::vector<std::optional<Said>> said(beside.joint.runs().size());
  in_parallel(said.size(), [&](std::size_t r) {
    const RunResidual& run = beside.joint.runs()[r];
    if (beside.states[r].size() > 0 && !run.is_aside()) said[r] = ask(run, beside.joint.theta(r), place, forces, beside.states[r]);
  });
  for (const std::optional<Said>& s : said) {
    if (!s) continue;
    samples_ += s->samples;
    if (levels_.empty()) {
      levels_ = s->levels;
      continue;
    }
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      levels_[i].products += s->levels[i].products;
      levels_[i].entropy += s->levels[i].entropy;
    }
  }
}

double LawRegression::deviance() const {
  double least = std::numeric_limits<double>::infinity();
  for (const Level& level : levels_) least = std::min(least, level.deviance());
  return least;
}

}  // namespace unrig
