#pragma once
#include <string>
#include <vector>

#include "core/run/run.h"
#include "correct/report/report_page.h"
#include "fit/fit_files.h"

namespace unrig {

/// Tells rig and run in the head of the page: speed, density, the reduced frequency pi f c / U of the rig's lowest mode, and the Reynolds number U c rho / mu.
void tell_conditions(ReportPage& page, const Rig& rig, const FittedRig& fit, const Run& run);

/// Answer of a rig's gauge to a normal force F(t) that is spread evenly over its strips (of a rig known only as modes: a force on every mode) in the fluid and stream of `run`:
///
///   H(f) = C (2 pi i f - A)^-1 B + D
///
/// Without effects. Empty where the rig has no gauge or the force no answer.
struct RigResponse {
  Eigen::VectorXd frequency;  ///< Hz, evenly in the logarithm, closer round the modes
  Eigen::VectorXcd answer;    ///< H(f) / H(0)
  std::vector<double> modes;  ///< Hz
  double usable = 0;          ///< Hz: up to here |H(f)/H(0)| is within 5 % of one; the last frequency where it never leaves that
};
RigResponse rig_response(const Rig& rig, const FittedRig& fit, const Run& run);

/// A rig as its file describes it: seen along the normal force, elements, strips, mass centres, gauge, sensors; and the shapes of its lowest modes below `nyquist` [Hz], in vacuum. Nothing of a rig known only as modes.
void add_drawing(ReportPage& page, const Rig& rig);
void add_described_shapes(ReportPage& page, const Rig& rig, double nyquist);

/// The fitted rig: its frequency response with the band in which the gauge reads the load itself, in each fluid and stream of the runs, and the shapes of its lowest modes.
void add_fitted_rig(ReportPage& page, const Rig& rig, const FittedRig& fit, const std::vector<Run>& runs);

}  // namespace unrig
