#include "core/rig/given_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include "core/files/error.h"
#include "core/rig/fingerprint.h"
#include "core/files/text_file.h"

namespace unrig {
namespace {

namespace fs = std::filesystem;

/// How it is written elsewhere, where that is not the same.
std::string as_given(const std::string& path, const std::string& other) { return path == other ? "" : " " + other; }

void check_output(const Output& output, const std::vector<Output>& others, const std::vector<std::string>& inputs) {
  const std::string advice = "Choose another name for " + output.option + ".";
  for (const std::string& input : inputs)
    if (same_file(output.path, input)) throw InputError({output.path, 0}, output.option + " would overwrite the input" + as_given(output.path, input), "wanted an output that is none of the inputs", advice);
  for (const Output& other : others)
    if (other.option != output.option && same_file(output.path, other.path))
      throw InputError({output.path, 0}, fmt::format("{} would overwrite what {} writes{}", output.option, other.option, as_given(output.path, other.path)), "wanted a file for each of them", advice);
}

}  // namespace

bool same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) return false;
  std::error_code failure;
  const bool a_exists = fs::exists(a, failure), b_exists = fs::exists(b, failure);
  if (a_exists && b_exists) return fs::equivalent(a, b, failure);  // of pipes and devices the system knows no such thing: they are never the same
  if (a_exists || b_exists) return false;
  const fs::path first = fs::weakly_canonical(fs::absolute(a, failure), failure), second = fs::weakly_canonical(fs::absolute(b, failure), failure);
  return !first.empty() && first == second;
}

void check_outputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs) {
  for (const Output& output : outputs)
    if (output.path == "-") throw InputError({output.option, 0}, "\"-\" names no file", "wanted a file: standard output takes the summary", "Write /dev/stdout for a result behind the summary there, or ./- for a file of that name.");
  for (const Output& output : outputs)
    // Into /dev/stdout and its like one may write after another.
    if (!output.path.empty() && !output.path.starts_with("/dev/") && !output.path.starts_with("/proc/")) check_output(output, outputs, inputs);
  for (const Output& output : outputs)
    if (!output.path.empty()) check_writable(output.path);
}

void check_given_once(const std::vector<std::string>& recordings) {
  for (std::size_t i = 0; i < recordings.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (same_file(recordings[i], recordings[j]))
        throw InputError({recordings[i], 0}, "the recording is given twice" + (recordings[i] == recordings[j] ? "" : ", also as " + recordings[j]), "wanted each once: one recording counts once", "Leave one of them out.");
}

const Run* same_recording(const Run& run, const std::vector<Run>& runs, const Rig& rig) {
  const std::string wanted = fingerprint(run, rig);
  const auto found = std::find_if(runs.begin(), runs.end(), [&](const Run& other) { return fingerprint(other, rig) == wanted; });
  return found == runs.end() ? nullptr : &*found;
}

void check_recorded_once(const std::vector<Run>& runs, const Rig& rig) {
  std::map<std::string, const Run*> seen;
  for (const Run& run : runs) {
    const auto [same, is_new] = seen.emplace(fingerprint(run, rig), &run);
    if (!is_new)
      throw InputError({run.file, 0}, "it holds the same readings as " + same->second->file, "wanted each recording once: one that counts twice makes errors too small", "Leave one of them out.");
  }
}

}  // namespace unrig
