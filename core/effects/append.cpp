#include "core/effects/effect.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/propagate/feedback_force.h"
#include "core/law/law_effect.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;

DualMatrix columns_of(const DualMatrix& a, const std::vector<Index>& columns) {
  DualMatrix picked(MatrixXd(a.rows(), static_cast<Index>(columns.size())), a.parameters());
  for (std::size_t i = 0; i < columns.size(); ++i) picked.set_block(0, static_cast<Index>(i), a.block(0, columns[i], a.rows(), 1));
  return picked;
}

Index append(LinearSystem& system, const DualMatrix& F) {
  const Index n = system.states(), k = F.rows();
  system.A = system.A.grown(n + k, n + k);
  system.A.set_block(n, n, F);
  system.B = system.B.grown(n + k, system.B.cols());
  system.C = system.C.grown(system.C.rows(), n + k);
  for (Index i = 0; i < k; ++i) system.exogenous.push_back(n + i);
  return n;
}

}  // namespace

DualMatrix EffectContext::on_strips(Index k, double value, double slope) const {
  const MatrixXd unit = MatrixXd::Identity(ports.strips, ports.strips);
  DualMatrix diagonal(value * unit, theta.size());
  diagonal.add_partial(first_parameter + k, slope * unit);
  return diagonal;
}

bool has(const Rig& rig, Needs needs) {
  const auto reads_twist = [](const Sensor& s) { return s.reads == SensorKind::twist || s.reads == SensorKind::twist_rate; };
  if (needs == Needs::any_rig) return true;
  return !rig.is_modal() && (needs == Needs::beam || std::any_of(rig.sensors.begin(), rig.sensors.end(), reads_twist));
}

std::string why_idle(const Effect& e, const Rig& rig, const std::vector<Conditions>& runs) {
  if (!has(rig, e.needs)) return e.id + (rig.is_modal() ? " needs a beam rig; this one is known only as modes" : " needs a sensor of the twist: [[sensor]] with reads = \"twist\"");
  if (std::any_of(runs.begin(), runs.end(), [&](const Conditions& c) { return e.acts(rig, c); })) return {};
  return e.id + " needs " + e.acts_in;
}

Effect::Band bounds_at(const AeroelasticModel& model, Index parameter, double value) {
  const Parameter& p = model.parameters()[static_cast<std::size_t>(parameter)];
  if (p.place == 0 && !effect(model.rig(), p.effect).bands.empty()) {
    const Effect& e = effect(model.rig(), p.effect);
    const auto away = [&](const Effect::Band& b) { return std::max({b.first - value, value - b.second, 0.0}); };
    return *std::min_element(e.bands.begin(), e.bands.end(), [&](const Effect::Band& a, const Effect::Band& b) { return away(a) < away(b); });
  }
  return {p.lower, p.upper};
}

double log_between(Effect::Random& random, double low, double high) { return std::exp(std::uniform_real_distribution<double>(std::log(low), std::log(high))(random)); }

Eigen::VectorXd log_between(Effect::Random& random, const std::vector<Effect::Band>& ranges) {
  Eigen::VectorXd drawn(static_cast<Index>(ranges.size()));
  for (std::size_t k = 0; k < ranges.size(); ++k) drawn[static_cast<Index>(k)] = log_between(random, ranges[k].first, ranges[k].second);
  return drawn;
}

Index append_signal(LinearSystem& system, const DualMatrix& F, const std::vector<Index>& columns, const DualMatrix& H) {
  const DualMatrix push = columns_of(system.B, columns) * H, direct = columns_of(system.D, columns) * H;
  const Index first = append(system, F);
  system.A.set_block(0, first, push);
  system.C.set_block(0, first, direct);
  return first;
}

void append_strip_signal(LinearSystem& system, const EffectContext& c, const DualMatrix& F, const Eigen::RowVectorXd& read) {
  std::vector<Index> strips;
  for (Index s = 0; s < c.ports.strips; ++s) strips.push_back(c.ports.strip + s);
  const MatrixXd spread = Eigen::VectorXd::Constant(c.ports.strips, 1.0 / static_cast<double>(c.ports.strips)) * read;
  append_signal(system, F, strips, DualMatrix(spread, c.theta.size()));
}

void append_feedback(LinearSystem& system, const DualMatrix& direction, Feedback feedback) {
  if (feedback.parameters > most_law_parameters || feedback.sees.rows() > most_law_arguments) throw std::logic_error("a law with more parameters or arguments than core/propagate/feedback_force.h has room for");
  for (DualMatrix* m : {&system.B, &system.D}) {
    const DualMatrix push = *m * direction;
    const Index columns = m->cols();
    *m = m->grown(m->rows(), columns + 1);
    m->set_block(0, columns, push);
  }
  system.feedback.push_back(std::move(feedback));
}

Index append_memory(LinearSystem& system, const DualMatrix& direction, const DualMatrix& force, Feedback rate) {
  const Index memory = system.states(), inputs = system.B.cols();
  const DualMatrix push = system.B * direction * force, direct = system.D * direction * force;
  system.A = system.A.grown(memory + 1, memory + 1);
  system.A.set_block(0, memory, push);
  system.C = system.C.grown(system.C.rows(), memory + 1);
  system.C.set_block(0, memory, direct);
  system.B = system.B.grown(memory + 1, inputs + 1);
  system.B.value(memory, inputs) = 1;
  system.D = system.D.grown(system.D.rows(), inputs + 1);
  rate.sees.conservativeResizeLike(MatrixXd::Zero(rate.sees.rows(), memory + 1));
  rate.sees.conservativeResizeLike(MatrixXd::Zero(rate.sees.rows() + 1, memory + 1));
  rate.sees(rate.sees.rows() - 1, memory) = 1;
  if (rate.parameters > most_law_parameters || rate.sees.rows() > most_law_arguments) throw std::logic_error("a law with more parameters or arguments than core/propagate/feedback_force.h has room for");
  system.feedback.push_back(std::move(rate));
  return memory;
}

OnStrips downwash(const LinearSystem& system, const EffectContext& c) {
  // It stands in the rows of the circulation's first lag, y' = rate (w - y), with whatever moves the mount.
  const Index first = 2 * system.coordinates, strips = c.ports.strips;
  const double rate = c.model.circulation().rate[0] * c.conditions.speed / c.model.rig().semichord();
  OnStrips w{(1 / rate) * system.A.block(first, 0, strips, system.states()), (1 / rate) * system.B.block(first, 0, strips, system.B.cols())};
  w.of_states.value.middleCols(first, strips) += MatrixXd::Identity(strips, strips);
  return w;
}

MatrixXd caught_up_angle(const LinearSystem& system, const EffectContext& c) {
  const Index strips = c.ports.strips, first = 2 * system.coordinates;
  const MatrixXd w = downwash(system, c).of_states.value;
  MatrixXd caught_up = w;
  for (Index k = 0; k < c.model.circulation().rate.size(); ++k) {
    const double amplitude = c.model.circulation().amplitude[k];
    caught_up -= amplitude * w;
    caught_up.middleCols(first + k * strips, strips) += amplitude * MatrixXd::Identity(strips, strips);
  }
  return caught_up / c.conditions.speed;
}

Index append_lag(LinearSystem& system, const EffectContext& c, const DualMatrix& rate) {
  const Index lag = system.states(), strips = c.ports.strips;
  const DualMatrix per_time = (c.conditions.speed / c.model.rig().semichord()) * rate;
  const OnStrips w = downwash(system, c);
  system.A = system.A.grown(lag + strips, lag + strips);
  system.A.set_block(lag, 0, per_time * w.of_states);
  system.A.set_block(lag, lag, -1.0 * per_time);
  system.B = system.B.grown(lag + strips, system.B.cols());
  system.B.set_block(lag, 0, per_time * w.of_inputs);
  system.C = system.C.grown(system.C.rows(), lag + strips);
  for (Index s = 0; s < strips; ++s) system.settling.push_back(lag + s);
  return lag;
}

DualMatrix circulation_ports(const LinearSystem& system, const EffectContext& c) {
  const Rig& rig = c.model.rig();
  const double b = rig.semichord(), strength = c.conditions.density * c.conditions.speed * b * rig.strip_length;
  // By the ports: where the share of Wagner's function is replaced, the columns of its lags no longer tell what circulation does.
  MatrixXd at_quarter_chord = MatrixXd::Zero(system.B.cols(), c.ports.strips);
  for (Index s = 0; s < c.ports.strips; ++s) {
    at_quarter_chord(c.ports.strip + s, s) = 1;
    at_quarter_chord.col(s).segment(c.ports.coordinate, c.ports.coordinates) = (0.5 + rig.axis()) * b * c.model.basis().twist.row(rig.submerged[static_cast<std::size_t>(s)] - 1).transpose();
  }
  const Index slope = c.model.index("normal_force_slope");
  DualMatrix direction(c.theta[slope] * strength * at_quarter_chord, c.theta.size());
  direction.add_partial(slope, strength * at_quarter_chord);
  return direction;
}

void add_circulation(LinearSystem& system, const EffectContext& c, const OnStrips& change) {
  const DualMatrix direction = circulation_ports(system, c), push = system.B * direction, direct = system.D * direction;
  system.A = system.A + push * change.of_states;
  system.B = system.B + push * change.of_inputs;
  system.C = system.C + direct * change.of_states;
  system.D = system.D + direct * change.of_inputs;
}

Eigen::RowVectorXd first_mode(const AeroelasticModel& model, Index coordinates) {
  const Rig& rig = model.rig();
  const double shape = rig.is_modal() ? 1 : model.basis().normal(rig.loaded_element() - 1, 0);
  return shape * Eigen::RowVectorXd::Unit(coordinates, 0);
}

double first_mode_frequency(const AeroelasticModel& model) {
  return model.rig().is_modal() ? 2 * std::numbers::pi * model.rig().modal.front().frequency : model.basis().omega[0];
}

double first_mode_mass(const AeroelasticModel& model) {
  const Rig& rig = model.rig();
  if (rig.is_modal()) return rig.modal.front().mass;
  const double shape = first_mode(model, 1)[0];
  return 1 / (shape * shape);  // modes of unit generalised mass
}

double first_mode_momentum(const AeroelasticModel& model) { return first_mode_mass(model) * first_mode_frequency(model); }

DualMatrix port(const LinearSystem& system, Index column, double amount) {
  MatrixXd direction = MatrixXd::Zero(system.B.cols(), 1);
  direction(column, 0) = amount;
  return DualMatrix(direction, system.A.parameters());
}

RowVectorXd angle_of_attack(const LinearSystem& system, const AeroelasticModel& model, double speed, Index strip) {
  const Rig& rig = model.rig();
  const double behind_axis = (0.5 - rig.axis()) * rig.semichord();
  const auto strips = static_cast<Index>(rig.submerged.size());
  RowVectorXd sum = RowVectorXd::Zero(system.states());
  const Index first = strip < 0 ? 0 : strip, last = strip < 0 ? strips : strip + 1;
  for (Index s = first; s < last; ++s) {
    const Index element = rig.submerged[static_cast<std::size_t>(s)] - 1;
    const RowVectorXd twist = model.basis().twist.row(element), normal = model.basis().normal.row(element);
    sum += displacement_of(system, twist) + rate_of(system, behind_axis * twist - normal) / speed;
    if (system.motion >= 0) sum += RowVectorXd::Unit(system.states(), system.motion) + behind_axis / speed * RowVectorXd::Unit(system.states(), system.motion + 1);
  }
  return sum / static_cast<double>(last - first);
}

Eigen::RowVectorXd displacement_of(const LinearSystem& system, const Eigen::RowVectorXd& shape) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(system.states());
  row.head(shape.size()) = shape;
  return row;
}

Eigen::RowVectorXd rate_of(const LinearSystem& system, const Eigen::RowVectorXd& shape) {
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(system.states());
  row.segment(system.coordinates, shape.size()) = shape;
  return row;
}

Index append_reading(LinearSystem& system, const DualMatrix& F, Index row, const DualMatrix& H) {
  const Index first = append(system, F);
  system.C.set_block(row, first, H);
  return first;
}

}  // namespace unrig
