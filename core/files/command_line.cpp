#include "core/files/command_line.h"

#include <algorithm>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "core/files/near_word.h"

namespace unrig {
namespace {

/// "--rig", "--rig=x", "-o", "-ofile"; not "-0.5" or "-".
bool looks_like_an_option(const std::string& word) {
  const auto letter = [&](std::size_t at) { return word.size() > at && ((word[at] >= 'a' && word[at] <= 'z') || (word[at] >= 'A' && word[at] <= 'Z')); };
  return word.starts_with('-') && (letter(1) || (word.starts_with("--") && letter(2)));
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

}  // namespace

void parse_command_line(CLI::App& app, int argc, char** argv) {
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) { return fmt::format("{0}: {1}\n`{0} --help` explains the command.\n", failed->get_name(), error.what()); });
  const std::vector<std::string> words(argv + 1, argv + argc), options = options_of(app);
  const auto end = std::find(words.begin(), words.end(), "--");
  const auto asks_for_help = [](const std::string& word) { return word == "--help" || word == "-h"; };
  if (std::none_of(words.begin(), end, asks_for_help))
    for (auto word = words.begin(); word != end; ++word) {
      if (!looks_like_an_option(*word)) continue;
      const std::string name = word->starts_with("--") ? word->substr(0, word->find('=')) : word->substr(0, 2);
      if (std::find(options.begin(), options.end(), name) != options.end()) continue;
      const std::string meant = nearest_word(name, options);
      throw CLI::ParseError(fmt::format("{} is no option of this command{}", *word, meant.empty() ? "" : "; did you mean " + meant + "?"), CLI::ExitCodes::ExtrasError);
    }
  app.parse(argc, argv);
}

std::string wrong_with_limit(const std::string& text) {
  double value = 0;
  if (CLI::detail::lexical_cast(text, value) && value > 0) return {};
  return fmt::format("{}, where a number above zero is wanted, or inf for any", text);
}

}  // namespace unrig
