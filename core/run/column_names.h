#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace unrig {

/// The column that `name` may have been meant for: a misspelling, another case, another word for one of those that run files give a meaning (core/run/run.h) and that
/// are not among `present`. Empty where there is none.
std::string meant_column(std::string_view name, const std::vector<std::string>& present);

}  // namespace unrig
