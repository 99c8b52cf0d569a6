#pragma once
#include <Eigen/Core>
#include <memory>

#include "core/model/aeroelastic_model.h"
#include "core/run/run.h"

namespace unrig {

/// The shaft in a step: where it rests before its first motion, and until its next.
struct StepMotion {
  bool found = false;          ///< it rests, moves, and rests again for long enough
  Eigen::Index begin = 0;      ///< first sample of the motion
  Eigen::Index end = 0;        ///< first sample of the rest behind it
  Eigen::Index last = 0;       ///< behind the last sample of that rest
  double onset = 0, step = 0;  ///< rad
  Eigen::VectorXd angle;       ///< rad, smooth: what a simulation is driven with
};

/// The first motion between two rests of at least `rest` seconds; missing angles lie on the line between their neighbours.
StepMotion step_motion(const Run& run, double rest);

/// Strongest line of a record's spectrum.
struct StrongestLine {
  double hertz = 0;       ///< 0: none
  double over_noise = 0;  ///< its power over the median
};

/// Of the whole record, its first half, quarter, ..., the part in which a line stands out most; slow drifts are left out.
StrongestLine strongest_line(const Eigen::VectorXd& x, double dt);

/// Whether a shaft moves by more than ten times its noise.
bool shaft_turns(const Eigen::VectorXd& angle);

/// What one recording says by itself, as ratios to what rig file and header let expect, in natural logarithms. NaN: it says nothing of it.
///
/// Ratios of a step are those of the recording to a simulation that is driven with its own angle: at the rig file's numbers, slope 2 pi (0.55 of it beyond 12 degrees, the mean
/// of the stalled samples), and that stiffness which puts the lowest mode onto the line that the recording rings at.
struct RunEstimate {
  RunKind kind = RunKind::step;
  bool looked_at = false;  ///< a decay or step with a gauge, of a beam rig
  bool moves = false;      ///< step: rests, moves and rests again
  bool turns = false;      ///< the shaft moves, whatever the kind
  bool exchanged = false;  ///< behind the step the angle rings and the gauge rests
  bool stalled = false;    ///< step: begins or ends beyond 12 degrees
  double nyquist_ratio = 0;  ///< half the sampling rate over the modelled frequency
  double periods = 0;        ///< of the modelled frequency in the record
  double largest_angle = 0;  ///< rad
  double line = 0;         ///< Hz, at which the rig rings; 0: none stands out
  double modelled = 0;     ///< Hz, of the lowest mode in still fluid of the header's density
  double fluid_share = 0;  ///< of that mode's inertia
  double stiffness;        ///< ln of the scale: 2 ln(line / modelled)
  double steady;           ///< ln of the gauge's change over the step, over 2 pi q c l times the step and the lever
  bool reversed = false;   ///< that change has the wrong sign
  double ring;             ///< ln of the amplitude of the ringing behind the step
  double ring_phase = 0;   ///< rad, by which that ringing is ahead
  double onset = 0;        ///< rad
  double step = 0;         ///< rad
  double load_change = 0;  ///< N
  RunEstimate();
};

/// A rig's model with few modes, which serves all estimates.
class CheckModel {
 public:
  explicit CheckModel(const Rig& rig);
  const Rig& rig() const { return model_.rig(); }
  const Basis& basis() const { return model_.basis(); }
  const AeroelasticModel& model() const { return model_; }

 private:
  AeroelasticModel model_;
};

/// Of a beam rig's free decays and steps with a gauge; of other rigs, kinds and channels nothing. Records longer than 16384 samples are looked at around their first motion.
/// A step may ring at several lines: that one counts which is nearest to the stiffness `reference` (ln of the scale) of the free decays. Costs some milliseconds.
RunEstimate estimate(const CheckModel& model, const Run& run, double reference = 0);

/// How a step's gauge follows its own angle, at given ln of stiffness scale and of apparent-mass coefficient, slope by the steady load.
struct Waveform {
  bool found = false;
  double misfit = 0;  ///< r.m.s. of gauge less simulation, over that of the gauge's variation, from the motion on for four periods of the lowest mode
  double late = 0;    ///< s, by which the gauge follows the simulation best
  double misfit_if_late = 0;  ///< with the simulation that much later
};

/// Of a step with rests, that of a stalled section with the slope that stall leaves; costs two simulations.
Waveform waveform(const CheckModel& model, const Run& run, const RunEstimate& estimated, double stiffness, double apparent);

}  // namespace unrig
