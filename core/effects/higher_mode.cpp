#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/effects/list.h"

namespace unrig {

namespace {

/// Appends to `system` one mode more of a rig known as modes, with the parameters f, zeta, p, p_m. Only the gauge reads it.
void append_mode(LinearSystem& system, const EffectContext& c) {
  const ModalMode& like = c.model.rig().modal.front();
  const double per_hertz = 2 * std::numbers::pi, omega = per_hertz * c.parameter(0), zeta = c.parameter(1);
  const Eigen::Index n = system.states(), q = n, v = n + 1;
  system.A = system.A.grown(n + 2, n + 2);
  system.B = system.B.grown(n + 2, system.B.cols());
  system.C = system.C.grown(system.C.rows(), n + 2);
  system.A.value(q, v) = 1;
  system.A.value(v, q) = -omega * omega;
  system.A.value(v, v) = -2 * zeta * omega;
  system.B.value(v, c.ports.force) = c.parameter(2) / like.mass;
  system.B.value(v, c.ports.mount + 1) = -c.parameter(3);
  if (c.gauge >= 0) system.C.value(c.gauge, q) = like.gauge_gain;
  const auto slope = [&](DualMatrix& m, Eigen::Index parameter, Eigen::Index column, double amount) {
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(m.rows(), m.cols());
    change(v, column) = amount;
    m.add_partial(c.first_parameter + parameter, change);
  };
  slope(system.A, 0, q, -2 * omega * per_hertz);
  slope(system.A, 0, v, -2 * zeta * per_hertz);
  slope(system.A, 1, v, -2 * omega);
  slope(system.B, 2, c.ports.force, 1 / like.mass);
  slope(system.B, 3, c.ports.mount + 1, -1);
  system.settling.insert(system.settling.end(), {q, v});
}

/// Whether its half-power bandwidth, 2 zeta f, and that of each known mode leave each other free: |f - f_i| > zeta f + zeta_i f_i. Modes that overlap make one peak, by which damping and stiffness that change
/// with amplitude pass for two. Source: R. H. Lyon, R. G. DeJong, Theory and Application of Statistical Energy Analysis (1995), modal overlap. And whether its decay time, 1/(2 pi zeta f), is within the record:
/// one that does not decay there is a tone, of the mains for instance.
bool stands_apart(const AeroelasticModel& model, const Eigen::VectorXd& theta, double seconds) {
  if (!model.rig().is_modal()) return true;
  const double f = theta[model.index("higher-mode.frequency")], half_width = theta[model.index("higher-mode.damping_ratio")] * f;
  if (2 * std::numbers::pi * half_width * seconds < 1) return false;
  for (std::size_t i = 0; i < model.rig().modal.size(); ++i) {
    const auto known = [&](const char* what) { return theta[model.index(fmt::format("modal[{}].{}", i + 1, what))]; };
    const double mass = known("mass"), f_i = std::sqrt(known("stiffness") / mass) / (2 * std::numbers::pi), half_width_i = known("damping") / (4 * std::numbers::pi * mass);
    if (std::abs(f - f_i) <= half_width + half_width_i) return false;
  }
  return true;
}

constexpr const char* excite = "Record a run that excites this mode: a pluck or a blow elsewhere.";

}  // namespace

/// Structural modes that the rig file left out. Of a beam: all that its flexibility matrices hold below the Nyquist frequency, and as many more as the frequencies in
/// the fluid need, in place of the number in `normal.modes`. Stiffness scale and damping ratio of the chain hold for them too, so that it has no parameters.
/// Of a rig known only as modes: one mode more, q'' + 2 zeta omega q' + omega^2 q = p F/m_1 - p_m a, read by the gauge with the gain of the first mode; m_1 the mass of that in the
/// rig file, F the force [N], a the acceleration of the mount, omega = 2 pi f.
/// Source: seed, Eq. 3.3-3.4 and section 4.2.3 (what one normal mode leaves near 15 Hz).
Effect higher_mode() {
  Effect e;
  e.id = "higher-mode";
  e.summary = "structural modes that the model left out";
  e.equation = "x'' + 2 zeta omega_k x' + omega_k^2 x = phi_k^T F for every k";
  e.kind = "stiffness";
  e.source = "seed, Eq. 3.3-3.4 and section 4.2.3";
  e.starts = {Eigen::VectorXd(0)};
  e.modal_parameters = {{"frequency", "Hz", 10, 1e-2, 1e6, false, excite},
                        {"damping_ratio", "1", 0.01, 0, 0.9, false, excite, Role::damping},
                        {"participation", "1", 0, -1e6, 1e6, false, "Record a run with a measured force."},
                        {"mount_participation", "1", 0, -1e6, 1e6, false, "Record a run with the mount moving."}};
  e.frequency = [](const AeroelasticModel&, const Conditions&, const Eigen::VectorXd& p) { return p[0]; };  // of a rig of modes: the line that it leaves
  e.acts_in = "a rig file that leaves modes out (modes = N)";
  e.acts = [](const Rig& rig, const Conditions&) { return rig.is_modal() || rig.normal.modes > 0; };
  e.states = [](const AeroelasticModel& model, const Conditions&) -> Eigen::Index { return model.rig().is_modal() ? 2 : 0; };
  e.apply = [](LinearSystem& system, const EffectContext& c) {
    if (c.model.rig().is_modal()) append_mode(system, c);
  };
  e.enriches_basis = true;
  e.distinct = stands_apart;
  return e;
}

}  // namespace unrig
