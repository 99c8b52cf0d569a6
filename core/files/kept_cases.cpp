#include "core/files/kept_cases.h"

#include <filesystem>

#include "core/files/error.h"
#include "core/files/text_file.h"

namespace unrig {

KeptCases::KeptCases(const std::string& folder) : folder_(folder) {
  if (folder_.empty()) return;
  std::error_code failure;
  std::filesystem::create_directories(folder_, failure);
  if (failure) throw InputError({folder_, 0}, "the folder cannot be made: " + failure.message(), "wanted one to keep the outcomes in", "Name another with --cases.");
}

std::string KeptCases::path(const std::string& name) const { return (std::filesystem::path(folder_) / name).string(); }

std::optional<std::string> KeptCases::find(const std::string& name) const {
  if (folder_.empty() || !std::filesystem::exists(path(name))) return std::nullopt;
  return read_text(path(name));
}

void KeptCases::keep(const std::string& name, const std::string& text) const {
  if (!folder_.empty()) write_text(path(name), text);
}

}  // namespace unrig
