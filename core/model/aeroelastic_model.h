#pragma once
#include <Eigen/Core>
#include <complex>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/numerics/dual_matrix.h"
#include "core/rig/rig.h"
#include "core/run/run.h"
#include "core/rig/structure.h"
#include "core/model/wagner.h"

namespace unrig {

/// What a parameter is to the model.
enum class Role { effect, stiffness, damping, mass, slope, load, amplitude };

/// One adjustable quantity of the model. `per_run` parameters have their own value in every run.
struct Parameter {
  std::string name;
  std::string unit;
  double start = 0;
  double lower = 0;
  double upper = 0;
  bool per_run = false;
  std::string advice = {};  ///< what to record where the data do not determine it; empty: said by the role
  Role role = Role::effect;
  int mode = -1;            ///< of a rig known as modes: whose it is, from 0
  bool torsion = false;     ///< of a beam: of its torsional modes
  std::string effect = {};  ///< whose it is; empty: the rig's own
  int place = -1;           ///< among the parameters of that effect, from 0
  double known_to = std::numeric_limits<double>::infinity();  ///< standard deviation of what is known of it beside the runs, about `start`
};

/// What of a run's conditions enters the model.
struct Conditions {
  double density = 0;  ///< kg/m^3
  double speed = 0;    ///< m/s; 0: no circulation
  bool prescribed_pitch = false;  ///< carry angle, rate and acceleration of the shaft as states
  bool force = false;             ///< a measured force at the calibration station
  bool mount = false;             ///< the mount moves: inputs velocity and acceleration
  double onset_angle = 0;  ///< rad, of the shaft before it moves; 0 where the run has no angle
  bool ports = false;      ///< further inputs behind these: a normal force on each strip [N], a generalised force on each coordinate. All inputs are then straight between samples
  double nyquist = 0;  ///< Hz, half the sampling rate; 0: not known
  const DeviationSlopes* deviations = nullptr;  ///< the run's own (Run::deviations)
};

/// A static nonlinear function f(z) that rides on the linear system: it drives one input column and looks at a few combinations of the states and of their rates, its arguments
/// z = sees x + sees_rates x'. A law with memory has it as a state of its own, whose rate is such a function (append_memory in core/effects/effect.h).
struct Feedback {
  Eigen::MatrixXd sees;             ///< arguments x states: displacements, rates, memories
  Eigen::Index first_parameter = 0; ///< of the law, in theta
  Eigen::Index parameters = 0;
  /// f(z) for the parameters p; writes its derivatives in each of z and in each of p.
  using Law = std::function<double(const double* z, const double* p, double* slope, double* partial)>;
  Law law = nullptr;
  /// For searches, the same with its corners rounded; none where it has no corners.
  Law rounded = nullptr;
  Eigen::Index steps_per_sample = 1;  ///< in which its response is followed: more where z crosses a corner of the law within a sample
  Eigen::MatrixXd sees_rates = {};    ///< arguments x states: accelerations are rates of velocities; empty: none
};

/// The coupled model of one run as a linear state equation with exact partial derivatives in theta:
///
///   x' = A x + J jerk + B u,   y = C x + D u
///
/// States: modal displacements, modal velocities, aerodynamic lags (term by term, strip by strip; none at speed 0), and where the pitch is
/// prescribed its angle p, rate and acceleration, driven by the jerk (piecewise constant for a cubic spline).
/// Inputs u: force [N]; mount velocity [m/s] and acceleration [m/s^2] (whichever `Conditions` has, in this order), their second derivatives in time, then what `feedback` drives.
/// Outputs y: the run's fitted channels, in the order of `outputs`.
struct LinearSystem {
  DualMatrix A, B, C, D;
  std::vector<Feedback> feedback;  ///< nonlinear forces; they drive the last columns of B and D
  Eigen::Index coordinates = 0;
  Eigen::Index lags = 0;
  Eigen::Index motion = -1;  ///< index of the state p, or -1
  Eigen::Index curved = 0;   ///< so many of the first inputs are cubic splines; their second derivatives are the next so many, whose columns in B and D are zero
  std::vector<Eigen::Index> settling;   ///< further states that are at rest where the rig is (a filter's)
  std::vector<Eigen::Index> filters;    ///< of them those of filters behind the reading of the first output
  std::vector<Eigen::Index> exogenous;  ///< further states whose initial value is unknown in every run (a signal's)
  std::vector<std::vector<Eigen::Index>> parts;  ///< groups of exogenous states that a signal may do without in a run (a harmonic)
  std::vector<std::string> outputs;

  Eigen::Index states() const { return A.rows(); }
  /// States that a free decay may start with: displacements, velocities and lags.
  Eigen::Index free_states() const { return 2 * coordinates + lags; }
};

/// The rig's aeroelastic model (seed, chapters 2 to 4).
///
/// Normal force per strip of length l, nose-up twist theta (elastic + shaft), displacement h in the direction of the normal force, axis a:
///
///   apparent mass      C_a pi rho b^2 l (-h'' - a b theta''), at mid-chord, and the couple -C_a pi rho b^4 l theta''/8   (Eq. 2.11, 2.13)
///   centrifugal force  pi rho b^2 l U theta', at three-quarter chord                                                   (Eq. 2.12)
///   circulatory force  s rho U b l Int phi(U(t-t')/b) dw(t'),  w = U theta - h' + (1/2 - a) b theta', at quarter chord    (Eq. 2.6-2.9)
///
/// with s the normal-force slope per radian in place of 2 pi. C_a multiplies the reaction to acceleration only: the centrifugal term is
/// momentum carried by the stream, and the recordings in `sample_data/campaigns` hold it at pi rho b^2 whatever C_a is.
/// All are deviations from the state before the motion; the steady load is a constant of the run.
/// The inertia of mass centres off the pitch axis couples the chains (Eq. 3.12, 3.15). Apparent mass and inertia stand in the mass matrix.
///
/// Gauge: bending moment at its station over the lever to the calibration station, as the sum over all forces outboard, inertial ones included,
/// so that the static part of modes left out is kept (tests/verification/one_mode_test.cpp).
///
/// Errors of the numbers of rig file and head that are parameters ("deviation[k]", Rig::deviations) move the matrices in proportion, each as the run says (Run::deviations); they are known to one standard deviation.
///
/// A rig that is known only as modes: m q'' + c q' + k q = force - g acceleration of the mount, gauge = sum of gain times q.
class AeroelasticModel {
 public:
  /// Whether the build-up of circulation is a given function, or its amplitudes are parameters ("circulation.amplitude[k]", the rates stay).
  enum class Circulation { given, free };

  /// Beam rigs need a basis; modal rigs ignore it.
  AeroelasticModel(Rig rig, Basis basis, IndicialFunction circulation, Circulation build_up = Circulation::given);

  /// The same rig with these effects at work (ids of core/effects/table.cpp), their parameters behind the model's own, named "id.parameter".
  /// Throws std::invalid_argument for an id that does not exist or one that needs what this rig does not have (strips, a gauge).
  AeroelasticModel with_effects(const std::vector<std::string>& ids) const;
  const std::vector<std::string>& effect_ids() const { return effects_; }

  const Rig& rig() const { return rig_; }
  const Basis& basis() const { return basis_; }
  const IndicialFunction& circulation() const { return circulation_; }
  /// theta: what can be adjusted, in the order in which `system` takes it.
  const std::vector<Parameter>& parameters() const { return parameters_; }
  Eigen::VectorXd start_values() const;
  /// Index of a parameter; throws std::out_of_range naming it.
  Eigen::Index index(const std::string& name) const;

  /// Amplitude k of the build-up of circulation at theta, and the parameter that it is (-1: given).
  double circulation_amplitude(const Eigen::VectorXd& theta, Eigen::Index k) const;
  Eigen::Index circulation_parameter(Eigen::Index k) const;

  /// The linear system at theta. `channels`: which outputs are wanted ("gauge" and sensor columns).
  LinearSystem system(const Conditions& conditions, const Eigen::VectorXd& theta, const std::vector<std::string>& channels) const;

  /// The fitted output channels that a run of this rig has: its gauge and every sensor column. Throws InputError where the run does not belong to
  /// the rig: there is no such channel, the gauge reads something else, or what drives a run of its kind is missing.
  std::vector<std::string> output_channels(const Run& run) const;

 private:
  LinearSystem beam_system(const Conditions&, const Eigen::VectorXd&, const std::vector<std::string>&) const;
  LinearSystem modal_system(const Conditions&, const Eigen::VectorXd&, const std::vector<std::string>&) const;
  LinearSystem with_effects_at_work(const Conditions&, const Eigen::VectorXd&, const std::vector<std::string>&, bool rig_is_off) const;
  void list_deviations();

  Rig rig_;
  Basis basis_;
  IndicialFunction circulation_;
  Circulation build_up_;
  std::vector<Parameter> parameters_;
  Eigen::Index first_deviation_ = 0;  ///< among the parameters
  std::vector<std::string> effects_;
};

/// Conditions of a run: speed, density, and which inputs it has.
Conditions conditions_of(const Run& run);

/// The rig at rest in still fluid, undamped, over the basis' coordinates x (normal modes, then torsional; units of unit generalised mass):
///
///   (mass + C_a fluid_mass) x'' + (k_n normal_stiffness + k_t torsion_stiffness) x = 0
///
/// with the apparent-mass coefficient C_a and the stiffness scales k_n, k_t (1: pi rho b^2 and the rig file's stiffness).
/// All are symmetric and constant; the couplings are those of AeroelasticModel (seed, Eq. 2.11, 2.13, 3.12, 3.15).
struct UndampedSystem {
  Eigen::MatrixXd mass, fluid_mass, normal_stiffness, torsion_stiffness;
};
UndampedSystem undamped_system(const Rig& rig, const Basis& basis, double density);

/// Poles of the rig in the fluid [rad/s]: eigenvalues of A without the prescribed motion, those with a positive imaginary part, ascending in
/// frequency.
std::vector<std::complex<double>> oscillatory_poles(const LinearSystem& system);

}  // namespace unrig
