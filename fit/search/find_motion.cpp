#include "fit/search/find_motion.h"

#include <utility>

#include "fit/likelihood/motion_prior.h"

namespace unrig {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void lead_in(RunResidual& run, const VectorXd& theta, const std::function<void()>& search) {
  constexpr double unheard = 1e6;  // what the gauge read has no say
  run.temper(unheard);
  const MatrixXd prior = motion_prior(run, theta);
  run.set_motion_prior(prior);
  run.solve(theta);
  for (const double noise : {100.0, 30.0, 10.0, 3.0, 1.0}) {
    run.temper(noise);
    search();
  }
  for (const double held : {0.3, 0.1, 0.03, 0.0}) {
    run.set_motion_prior(held > 0 ? MatrixXd(held * prior) : MatrixXd());
    search();
  }
}

bool find_motion(RunResidual& run, const VectorXd& theta, bool thoroughly) {
  if (run.model().system(run.conditions(), theta, run.channels()).feedback.empty()) return false;
  if (run.motion().unknowns() == 0 || run.takes_small_steps(theta)) return run.find_linear(theta, thoroughly);
  const double tempered = run.tempered();
  RunResidual found = run;
  lead_in(found, theta, [&] { found.solve(theta); });
  run.temper(1);
  if (found.solve(theta).chi2 < run.solve(theta).chi2) run = std::move(found);
  run.temper(tempered);
  return true;
}

}  // namespace unrig
