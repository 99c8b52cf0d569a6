#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"
#include "correct/correct.h"
#include "correct/estimate/prior.h"

namespace unrig {

/// What `correct` knows of a run before it looks at the readings.
struct RestlessProblem {
  const AeroelasticModel& model;   ///< with a free build-up of circulation
  const Run& run;
  Prior prior;
  Eigen::VectorXd start;           ///< theta
  double semichords = 0;           ///< travelled while the shaft moves
  double steady_per_reading = 0;   ///< load per unit of the gauge's offset
  Imposed imposed;
};

/// The answer of `correct` for a run in which the shaft hardly ever rests, with cost and memory that go with its length (correct/long_motion/restless_run.h). Fills what the readings say into
/// `result`, whose description of the run is there already.
///
/// The load is M (y - Z z) + direct: M the smoother of the loads, z the parameters theta and the offsets, Z what they do to the readings. Its errors are those of M, whose variance the
/// smoother knows, and D = d load / d z times those of z, which are independent of them:
///
///   var load_k = V_k + D_k cov(z) D_k',    D = direct - M Z
///
/// cov(z) by sources as in correct/estimate/uncertainty_budget.h; V_k by what the noise of each channel makes of itself on its way through the smoother far from the ends, the rest being the roughness of
/// the motion, which is regularisation. Where the motion found is rougher than in the whole record (the variance of w over 50 samples more than three times as large), that last part is larger by
/// as much: a shaft that sets out is rougher than one that swings. (What one source's parts in V and in cov(z) have in common is left out of both columns: over all sources it sums to zero.)
void correct_restless(const RestlessProblem& problem, CorrectResult& result);

}  // namespace unrig
