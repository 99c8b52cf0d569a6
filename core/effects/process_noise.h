#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"

namespace unrig {

/// What white noise drives the states x of `system` by, that of `model` under these conditions at theta and with these channels:
///
///   x' = A x + B u + G e,   e white, of density 1 (variance of its integral over a second: 1 s),
///
/// G states x sources, with partials in theta. None where no effect that acts there wanders (Effect::noise).
std::optional<DualMatrix> process_noise(const AeroelasticModel& model, const Conditions& conditions, const Eigen::VectorXd& theta, const std::vector<std::string>& channels, const LinearSystem& system);

}  // namespace unrig
