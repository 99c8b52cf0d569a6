#pragma once
#include <cstddef>

#include "fit/diagnose/diagnose.h"
#include "fit/likelihood/run_order.h"

namespace unrig {

/// What was found in the order of the search, told in that in which the `runs` were given.
void tell_as_given(const GivenOrder& given, std::size_t runs, Diagnosis& d);

}  // namespace unrig
