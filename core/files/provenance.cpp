#include "core/files/provenance.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace unrig {
namespace {

/// As a shell takes it for one word.
std::string quoted(std::string_view word) {
  constexpr std::string_view plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string_view::npos) return std::string(word);
  std::string text = "'";
  for (const char c : word) {
    if (c == '\'') text += "'\\''";
    else text += c == '\n' || c == '\r' ? ' ' : c;  // it stands in one line
  }
  return text + "'";
}

/// "-o FILE", "-oFILE", "--output=FILE": whether `word` is the option, and whether its value is the next word.
enum class Is { another, whole, before_its_value };
Is is_option(std::string_view word, std::string_view option) {
  if (word == option) return Is::before_its_value;
  const bool is_short = !option.starts_with("--");
  if (word.starts_with(option) && (is_short || word[option.size()] == '=')) return Is::whole;
  return Is::another;
}

/// What stands behind "; key=" up to the next semicolon; the command, which comes last, up to the end.
std::string value_of(std::string_view text, std::string_view key) {
  const std::string marked = fmt::format("; {}=", key);
  const std::size_t at = text.find(marked);
  if (at == std::string_view::npos) return "";
  const std::string_view value = text.substr(at + marked.size());
  return std::string(key == "command" ? value : value.substr(0, value.find(';')));
}

}  // namespace

Provenance provenance_of(int argc, const char* const* argv, const std::vector<std::string_view>& outputs) {
  std::vector<std::string_view> left_out{"-o", "--output", "--threads", "--shard"};
  left_out.insert(left_out.end(), outputs.begin(), outputs.end());
  Provenance provenance{"unrig " UNRIG_VERSION, "unrig"};
  for (int i = 0; i < argc; ++i) {
    const std::string_view word = argv[i];
    Is found = Is::another;
    for (const std::string_view option : left_out)
      if (found == Is::another) found = is_option(word, option);
    if (found == Is::before_its_value) ++i;
    if (found == Is::another) provenance.command += " " + quoted(word);
  }
  return provenance;
}

std::string MadeBy::column() const {
  if (provenance.program.empty()) return "";
  return fmt::format("{}{}; rig={}; run={}; fit={}; command={}", prefix, provenance.program, rig, run, fit, provenance.command);
}

MadeBy MadeBy::of_column(std::string_view text) {
  MadeBy made;
  made.provenance.program = text.substr(0, text.find(';'));
  made.provenance.command = value_of(text, "command");
  made.rig = value_of(text, "rig");
  made.run = value_of(text, "run");
  made.fit = value_of(text, "fit");
  return made;
}

}  // namespace unrig
