#pragma once
#include <Eigen/Core>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/propagate/feedback_force.h"

namespace unrig {

/// Input columns that an effect may push.
struct Ports {
  Eigen::Index force;        ///< [N] at the calibration element (modal rigs: on every mode)
  Eigen::Index mount;        ///< velocity [m/s] of the mount, and behind it its acceleration [m/s^2]
  Eigen::Index strip;        ///< first of `strips`: normal force on a strip [N]
  Eigen::Index strips;
  Eigen::Index coordinate;   ///< first of `coordinates`: generalised force
  Eigen::Index coordinates;
};

/// What an effect may look at while it changes a system.
struct EffectContext {
  const AeroelasticModel& model;
  const Conditions& conditions;
  const Eigen::VectorXd& theta;
  Eigen::Index first_parameter;  ///< index into theta of the effect's first parameter
  Eigen::Index gauge;            ///< row of the gauge among the outputs, -1 where it is not among them
  Ports ports;

  double parameter(Eigen::Index k) const { return theta[first_parameter + k]; }
  /// `value` on every strip, which changes with the effect's parameter k by `slope`: strips x strips, diagonal.
  DualMatrix on_strips(Eigen::Index k, double value, double slope) const;
};

/// What a rig must have for an effect to make sense: elements and strips, not only modes; and of these a sensor of the twist.
enum class Needs { any_rig, beam, twist_reading };
bool has(const Rig& rig, Needs needs);

/// One candidate for missing physics (correct/manual/effects.md): what it is, where it can act, how it changes the linear system of a run, how it is searched for,
/// and what a trial hides of it. Nothing outside core/effects knows an effect by its id.
///
/// To add one: a file in core/effects/ that defines it, and a line each in core/effects/list.h and table.cpp. Fit, simulation, diagnosis and trial pick it up from there.
struct Effect {
  using Random = std::mt19937_64;
  using Band = std::pair<double, double>;

  std::string id;
  std::string summary;   ///< one line
  std::string equation;  ///< as a person would write it
  std::string kind;      ///< what physics it is: stiffness, damping, friction, memory, inertia, lift, speed, angle, signal, curve
  std::string source;
  /// Names without the id; `advice` says what to record to determine each.
  std::vector<Parameter> parameters;
  /// The same on a rig known only as modes, where they are others.
  std::vector<Parameter> modal_parameters;
  const std::vector<Parameter>& parameters_on(const Rig& rig) const { return rig.is_modal() && !modal_parameters.empty() ? modal_parameters : parameters; }
  /// Where the first parameter may be, if not everywhere between its bounds: ascending, apart. A search stays in the band that it starts in.
  std::vector<Band> bands;
  /// Values from which a search should start, besides the parameters' own: one vector per start. The linear unknowns (amplitudes) follow by themselves.
  std::vector<Eigen::VectorXd> starts;
  /// Terms that it may do without, by the places of their parameters, the amplitude first: without it (0) the others mean nothing. A diagnosis counts those that it needs.
  std::vector<std::vector<Eigen::Index>> terms = {};
  /// Of a nonlinear effect whose starts depend on the size of the response: from the largest argument that its law sees in the runs.
  std::function<std::vector<Eigen::VectorXd>(const AeroelasticModel&, double largest_argument)> starts_for;
  /// Of an effect that shows as a line in the spectrum: its frequency [Hz] in a run, for its parameters. A search then follows the lines of the residual's spectrum
  /// through the bands of the first parameter; `starts` say from which further parameters. Only on rigs on which it has parameters.
  std::function<double(const AeroelasticModel&, const Conditions&, const Eigen::VectorXd& parameters)> frequency;
  /// Whether it can act at all in a run under these conditions.
  std::function<bool(const Rig&, const Conditions&)> acts;
  /// Such runs in words, behind "it needs"; empty where it acts in all.
  std::string acts_in;
  /// How many states it adds to the system of such a run; none: 0. It does not see theta, on which the number of states may not depend: searches keep initial
  /// states from one theta to the next. AeroelasticModel::system holds `apply` to it.
  std::function<Eigen::Index(const AeroelasticModel&, const Conditions&)> states;
  std::function<void(LinearSystem& system, const EffectContext& context)> apply;
  /// Of a signal that wanders: what white noise of unit density drives each of its states by, one column for each source, with partials (core/effects/process_noise.h). None: it goes on
  /// as it began.
  std::function<DualMatrix(const EffectContext& context)> noise = {};
  /// Parameters of a hidden one, drawn for `unrig trial`: from far below what noise lets one see to what nobody overlooks. `release`: load [N] that releases the
  /// plucks. Sizes of signals are drawn with their runs. Without it the start values are taken.
  std::function<Eigen::VectorXd(const AeroelasticModel& rig, double release, Random& random)> draw;
  bool enriches_basis = false;  ///< on a beam its model has all modes below the Nyquist frequency, in place of the number in the rig file
  bool in_the_load = false;     ///< it changes the load that a rigid rig would feel, which `correct` must not take out
  Needs needs = Needs::any_rig;
  /// Whether, with these parameters of the model, it is something of its own beside what the model has without it and beside other effects, in records of so many seconds. None: it always is.
  std::function<bool(const AeroelasticModel&, const Eigen::VectorXd& theta, double seconds)> distinct = {};
};

/// "carriage-vibration needs a run in a stream": why it acts in none of these runs of the rig; empty if it does in one.
std::string why_idle(const Effect& effect, const Rig& rig, const std::vector<Conditions>& runs);

/// Lowest and highest value of a parameter of `model`: its bounds, or those of the band of its effect that is nearest to `value`.
Effect::Band bounds_at(const AeroelasticModel& model, Eigen::Index parameter, double value);

/// Evenly in the logarithm from `low` to `high`, both positive; and one such value for each of `ranges`, in their order.
double log_between(Effect::Random& random, double low, double high);
Eigen::VectorXd log_between(Effect::Random& random, const std::vector<Effect::Band>& ranges);

/// All effects, in the order in which users are shown them.
const std::vector<Effect>& effects();
/// By id; throws std::invalid_argument naming the choices.
const Effect& effect(const std::string& id);

/// Appends an autonomous system z' = F z to the states of `system`: z drives the inputs in `columns` with the rows of `H` (u = H z), and its initial value
/// is unknown in every run. F is k x k, H is columns x k, both with partials over the model's parameters. Returns the index of the first new state.
Eigen::Index append_signal(LinearSystem& system, const DualMatrix& F, const std::vector<Eigen::Index>& columns, const DualMatrix& H);

/// append_signal for a force that is spread evenly over the strips: `read` z newtons in all.
void append_strip_signal(LinearSystem& system, const EffectContext& context, const DualMatrix& F, const Eigen::RowVectorXd& read);

/// A nonlinear force: f(z) times `direction` (ports x 1, over all input columns of `system`, with partials), z = sees x.
void append_feedback(LinearSystem& system, const DualMatrix& direction, Feedback feedback);

/// A force with memory: `force` times z (1 x 1, with partials) along `direction`, z' = `rate`, z = 0 where the run begins. The arguments of `rate` are what it sees,
/// and z behind them. Returns the index of z among the states.
Eigen::Index append_memory(LinearSystem& system, const DualMatrix& direction, const DualMatrix& force, Feedback rate);

/// What each strip has, linear in states and inputs: strips x states, strips x inputs.
struct OnStrips {
  DualMatrix of_states, of_inputs;
};
/// Downwash w [m/s] at three-quarter chord of each strip (AeroelasticModel). Of a beam in a stream.
OnStrips downwash(const LinearSystem& system, const EffectContext& context);
/// Angle of attack that circulation has caught up with on each strip [rad], a_E = (1/U) Int phi(U(t-t')/b) dw(t'), phi Wagner's function, also where the build-up is searched: strips x states. What a law sees of
/// states has no partials. Of a beam in a stream.
Eigen::MatrixXd caught_up_angle(const LinearSystem& system, const EffectContext& context);
/// A lag of the downwash on each strip, y' = r (U/b) (w - y), at rest where the rig is. `rate`: r [1/semichord] on the strips. Returns the index of the first strip's y.
Eigen::Index append_lag(LinearSystem& system, const EffectContext& context, const DualMatrix& rate);
/// What a downwash of 1 m/s on each strip does in the end, s rho U b l at quarter chord: over all input columns x strips; s the slope of the run's normal force.
DualMatrix circulation_ports(const LinearSystem& system, const EffectContext& context);
/// The circulatory force on each strip grows by s rho U b l times `change` [m/s], at quarter chord; s the slope of the run's normal force.
void add_circulation(LinearSystem& system, const EffectContext& context, const OnStrips& change);

/// `amount` on input column `column`, as a direction for append_feedback.
DualMatrix port(const LinearSystem& system, Eigen::Index column, double amount);
/// What reads the effective angle of attack at three-quarter chord of a strip, w / U (AeroelasticModel), as a deviation from that before the motion; `strip` -1: the mean of all. Of a beam in a stream.
Eigen::RowVectorXd angle_of_attack(const LinearSystem& system, const AeroelasticModel& model, double speed, Eigen::Index strip);

/// What reads the displacement, or the rate, of a point that moves by `shape` times the coordinates.
Eigen::RowVectorXd displacement_of(const LinearSystem& system, const Eigen::RowVectorXd& shape);
Eigen::RowVectorXd rate_of(const LinearSystem& system, const Eigen::RowVectorXd& shape);

/// The first normal mode as a row over the coordinates: what it displaces the element by that the dead weights hung at. Modal rigs: the first mode's coordinate itself.
Eigen::RowVectorXd first_mode(const AeroelasticModel& model, Eigen::Index coordinates);
/// Angular frequency of that mode [rad/s], dry.
double first_mode_frequency(const AeroelasticModel& model);
/// Mass that moves there [kg], and the same times the mode's angular frequency [kg/s].
double first_mode_mass(const AeroelasticModel& model);
double first_mode_momentum(const AeroelasticModel& model);

/// As append_signal, for a signal that is simply added to output `row`.
Eigen::Index append_reading(LinearSystem& system, const DualMatrix& F, Eigen::Index row, const DualMatrix& H);

}  // namespace unrig
