#pragma once
#include <Eigen/Core>
#include <set>
#include <string>
#include <vector>

#include "correct/estimate/prior.h"
#include "fit/fit_files.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// What moves the answers of a run beyond the noise of its readings.
struct BeyondNoise {
  double own = 1;                     ///< how much more what the run is left with moves the circulatory load than noise of its size would; at least 1
  Eigen::MatrixXd of_fit;             ///< what the fit left of its runs' readings, on (theta, c) of this one (disturbance_root); empty: nothing
  std::set<std::string> unexplained;  ///< the names of those runs
};

/// At the estimate of a run that is corrected in one leg; `at`: the samples whose circulatory load is asked for. Neither part where the reduced chi-square is no number.
BeyondNoise moved_beyond_noise(const RunResidual& residual, const RunResidual::Evaluation& e, const Prior& prior, const Eigen::VectorXd& theta, double reduced_chi2, const FittedRig& fit,
                               const std::vector<Eigen::Index>& at);

}  // namespace unrig
