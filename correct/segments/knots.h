#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/run/motion.h"
#include "core/run/run.h"

namespace unrig {

/// Windows in which a shaft may move, in turn.
using Windows = std::vector<MotionBasis::Window>;

/// The windows of the fit, and 40 samples more: a drive that still rings below the noise of the angle is load.
Windows generous_windows(const Run& run);

/// Samples that knots in such windows may lie apart for the bands in tests/studies/CORRECT.md to hold. A shaft that moves and rests by turns moves fast: a step within 20 samples with a knot on every
/// seventh is off by tens of standard deviations.
Eigen::Index farthest_knots(const Windows& windows);
bool too_far_apart(const Windows& windows);
/// The same windows with as many knots as a fit may have (most_knots_to_fit), and the samples in motion that they follow.
Windows with_most_knots(Windows windows);
Eigen::Index most_moving(const Windows& windows);

/// The same windows by legs of a run (correct/segments/run_in_legs.h): of some hundred knots, or of the motions between which the shaft does not rest for `shortest_rest` samples, or where
/// the fifty samples before the next one, or behind the last, are not `read`. Empty where a leg has more motion than its knots can follow.
std::vector<Windows> legs_of(const Windows& windows, Eigen::Index shortest_rest, const std::function<bool(const Interval& samples)>& read);

}  // namespace unrig
