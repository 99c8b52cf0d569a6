#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"
#include "fit/apparent_mass/damped_frequencies.h"
#include "fit/fit.h"

namespace unrig {

/// How much fluid moves with this rig? Asked of its free decays in air and in still fluid.
struct ApparentMassProblem {
  Rig rig;
  Run dry;
  Run wet;
  bool joint_fit = true;  ///< also fit the whole coupled model to both decays, for comparison
  std::function<void(const std::string&)> progress;  ///< told what is being done; empty: silent
};

struct Estimate {
  double value = 0;
  double std_error = 0;  ///< one standard deviation
};

/// A vibration of a run, and the mode of the rig that it is.
struct ModeLine {
  DampedMode measured;
  int mode = 0;               ///< of the coupled rig, from 1 at the lowest; 0: none
  double model_frequency = 0; ///< Hz, damped with the measured damping ratio, where there is a mode; where it was folded, before that
  std::string note;           ///< why there is no mode, or what is odd about it
};

/// The frequencies of one run.
struct RunModes {
  std::string file, fingerprint;  ///< of its readings (core/rig/fingerprint.h)
  std::string medium;
  double density = 0;  ///< kg/m^3
  std::optional<Hold> hold;  ///< before the release, left out
  std::vector<ModeLine> modes;  ///< ascending in frequency
  std::size_t fundamental = 0;  ///< which of them is the lowest mode of the rig
  std::vector<std::string> channels, units;
  Eigen::VectorXd noise, residual;  ///< per channel, in its unit

  const DampedMode& lowest() const { return modes[fundamental].measured; }
};

enum class ApparentMassMethod { mode_shapes, frequency_ratio };

struct ApparentMassResult {
  ApparentMassMethod method = ApparentMassMethod::mode_shapes;
  std::string rig_file, rig_fingerprint;
  std::optional<Estimate> coefficient;  ///< C_a: apparent mass over pi rho b^2; where the rig file gives a chord
  Estimate mass;                        ///< kg/m along the span (mode shapes) or kg (frequency ratio)
  std::string mass_unit;
  std::optional<double> theory;         ///< pi rho b^2 [kg/m]
  RunModes dry, wet;

  /// (natural dry / natural wet frequency)^2 - 1 of the lowest mode: apparent over structural generalised mass, were the shape the same.
  Estimate mass_ratio;
  std::optional<double> same_shape_coefficient;  ///< the C_a that this ratio gives with the dry mode's shape

  // Mode shapes only: the fit of the rig's natural frequencies.
  std::vector<FittedParameter> parameters;  ///< stiffness scales and coefficient
  double reduced_chi2 = 0;                  ///< with the frequencies' own errors
  Eigen::Index degrees_of_freedom = 0;
  double error_scale = 1;                   ///< by which those errors had to grow; in all standard errors

  struct JointFit {
    bool converged = false;
    std::optional<Estimate> value;  ///< of the coefficient, or of the mass [kg] for a rig that is known only as modes
    double reduced_chi2 = 0;
    bool agrees = false;  ///< it describes the recordings, and lies within three combined standard errors
    std::string message;  ///< where there is no value, why
  };
  std::optional<JointFit> joint_fit;
  std::string agreement;  ///< one sentence on the joint fit beside the frequency shift
  std::vector<std::string> warnings;
};

/// Apparent mass from the frequency shift between two free decays (seed, section 4.3, which proposes it).
///
/// Where the rig has chains ("mode shapes"): the wet mode is not the dry mode with more mass, because the water weighs on the submerged part only and
/// bends the shape. So k_n, k_t and C_a are fitted together to the natural frequencies of the coupled rig,
///
///   det[ k_n K_n + k_t K_t - omega^2 (M + C_a M_fluid(rho)) ] = 0,
///
/// in both runs, each at its own density (the air, too, has a little apparent mass). The basis is richer than the rig file's `modes`, which thin
/// out the forward model: the frequencies heard are those of the whole structure. Apparent mass C_a pi rho b^2 [kg/m].
///
/// Where the rig is known only as modes ("frequency ratio"), from its lowest mode, of generalised mass m:
///
///   m_a = m (r^2 - 1),  r = f_dry / f_wet,  u(m_a)/m_a = 2 r^2/(r^2 - 1) sqrt(u_d^2 + u_w^2)
///
/// with natural frequencies f = |pole|/2 pi, for which viscous damping drops out exactly, and their relative errors u.
///
/// Standard errors cover the recordings, not the rig file: 1 % in all of its masses is 1 % in the apparent mass. Where a decay is not exponential the
/// frequency to which it tends counts, with an error for that (damped_frequencies); harmonics, tones and what is damped like a filter are
/// reported and left out.
///
/// Throws InputError where a run is no free decay in still fluid, does not belong to the rig, or the wet density is not above the dry one;
/// NoAnswer where no frequency can be measured or matched, or the shift is not significant (three standard errors).
ApparentMassResult apparent_mass(const ApparentMassProblem& problem);

}  // namespace unrig
