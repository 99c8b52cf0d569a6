#pragma once
#include <vector>

#include "core/check/gate.h"
#include "fit/fit.h"

namespace unrig {

/// The gate behind a fit: identified parameters of a beam rig, none of an effect, that no rig and no fluid has. Each is grave.
///
///   stiffness scales 0.1 to 10, apparent-mass coefficient 0.2 to 4 (flat plates and thick sections 0.9 to 1.5), damping ratios up to 0.5, |slope| up to 12 per radian (twice 2 pi)
std::vector<Suspicion> implausible_parameters(const FitResult& result);

}  // namespace unrig
