#include <algorithm>
#include <cmath>

#include "core/effects/effect.h"
#include "core/effects/process_noise.h"
#include "core/law/law_effect.h"
#include "fit/likelihood/readings_noise.h"
#include "fit/likelihood/run_linearised.h"
#include "fit/likelihood/wandering_force.h"

// RunResidual where a force wanders: readings and model pass the same filter, and all that is exact without it holds behind it.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Readings that do not count, on a straight line between their neighbours.
MatrixXd without_gaps(const MatrixXd& readings, const MatrixXd& weight) {
  MatrixXd whole = readings;
  for (Index c = 0; c < whole.cols(); ++c) {
    Index last = -1;  // that counts
    for (Index k = 0; k <= whole.rows(); ++k) {
      if (k < whole.rows() && !(weight(k, c) > 0)) continue;
      for (Index i = last + 1; i < k; ++i) {
        const double before = last < 0 ? readings(std::min(k, whole.rows() - 1), c) : readings(last, c), after = k < whole.rows() ? readings(k, c) : before;
        whole(i, c) = before + (after - before) * static_cast<double>(i - last) / static_cast<double>(k - last);
      }
      last = k;
    }
  }
  return whole;
}

}  // namespace

bool RunResidual::Linearised::wanders(const RunResidual& run) {
  const std::vector<std::string>& ids = run.model_->effect_ids();
  return std::any_of(ids.begin(), ids.end(), [&](const std::string& id) {
    const Effect& e = effect(run.model_->rig(), id);
    return e.noise && e.acts(run.model_->rig(), run.conditions_);
  });
}

std::shared_ptr<const WanderingForce> RunResidual::Linearised::wander(const RunResidual& run, const VectorXd& theta, const LinearSystem& system, ExactStep& step, Partials partials) {
  if (!system.feedback.empty() || !wanders(run)) return nullptr;
  const LinearSystem physical = run.filters_.empty() ? LinearSystem{} : run.searched_system(theta);
  std::optional<DualMatrix> noise = process_noise(*run.model_, run.conditions_, theta, run.channels_, run.filters_.empty() ? system : physical);
  if (!noise || noise->value.isZero(0)) return nullptr;
  if (partials == Partials::none) noise->partial.clear();
  for (Index j = 0; j < noise->parameters() && !run.differentiated_.empty(); ++j)
    if (std::find(run.differentiated_.begin(), run.differentiated_.end(), j) == run.differentiated_.end()) noise->partial[static_cast<std::size_t>(j)].resize(0, 0);
  const std::vector<double>& white = run.shared_ && !run.shared_->white.empty() ? run.shared_->white : run.sigma_;
  return std::make_shared<const WanderingForce>(*noise, Eigen::Map<const VectorXd>(white.data(), static_cast<Index>(white.size())), system, without_gaps(run.readings(), run.weight_), partials, step);
}

const MatrixXd& RunResidual::Linearised::readings(const RunResidual& run) const { return wandering ? wandering->readings() : run.readings(); }

MatrixXd RunResidual::Linearised::offset_columns(Index channel, const Interval& samples) const {
  if (!wandering) return VectorXd::Ones(samples.length());
  return wandering->raised(channel).middleRows(samples.first, samples.length());
}

MatrixXd RunResidual::Linearised::innovations(const RunResidual& run, const VectorXd& at) const {
  const Motion motion = run.motion_.unknowns() > 0 ? motion_of(run.motion_.coefficients(at.head(run.motion_.unknowns())), run.run_->dt) : Motion{};
  MatrixXd left = wandering->readings() - response(run, system, step, at, motion);
  if (known.size() > 0) left -= known;
  for (Index c = 0; c < left.cols(); ++c) left.col(c) -= wandering->raised(c) * at.segment(run.first_offset_, left.cols());
  return left;
}

std::shared_ptr<RunResidual::SharedResponses> RunResidual::Linearised::only_noise_of(const RunResidual& run) {
  if (!run.shared_ || run.shared_->white.empty()) return nullptr;
  auto own = std::make_shared<SharedResponses>();
  own->white = run.shared_->white;
  return own;
}

void RunResidual::Linearised::keep_white(RunResidual& run, const RunResidual& other) {
  if (!other.shared_ || other.shared_->white.empty()) {
    if (!run.shared_ || run.shared_->white.empty()) return;
    auto own = std::make_shared<SharedResponses>();
    own->input_noise = run.shared_->input_noise;
    run.shared_ = std::move(own);
    return;
  }
  const std::vector<double>& white = other.shared_->white;
  if (wanders(run)) {
    auto own = std::make_shared<SharedResponses>();
    own->input_noise = other.shared_->input_noise;
    own->white = white;
    run.shared_ = std::move(own);
    return;
  }
  for (std::size_t c = 0; c < white.size(); ++c) {
    run.weight_.col(static_cast<Index>(c)) *= run.sigma_[c] / white[c];
    run.sigma_[c] = white[c];
  }
}

void RunResidual::Linearised::settle_wandering(RunResidual& run, const VectorXd& theta) {
  if (!wanders(run)) return;
  const Solution solution = run.solve(theta);
  const std::vector<double> white = run.shared_ && !run.shared_->white.empty() ? run.shared_->white : run.sigma_;
  for (std::size_t c = 0; c < white.size(); ++c) {
    const double sigma = solution.model->wandering ? solution.model->wandering->sigma(static_cast<Index>(c)) : white[c];
    run.weight_.col(static_cast<Index>(c)) *= run.sigma_[c] / sigma;
    run.sigma_[c] = sigma;
  }
  auto own = std::make_shared<SharedResponses>();
  if (run.shared_) own->input_noise = run.shared_->input_noise;
  own->white = white;
  run.shared_ = std::move(own);
  run.weights_changed();
}

void settle_wandering(RunResidual& run, const VectorXd& theta) { RunResidual::Linearised::settle_wandering(run, theta); }

}  // namespace unrig
