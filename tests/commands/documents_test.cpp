// What users read is true: the README's five minutes come out as printed, links lead somewhere, and the manual names every key, effect and result.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/effects/effect.h"
#include "core/files/text_file.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using test::run_unrig;
using test::source_path;
using test::TemporaryDirectory;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

/// The same words, numbers to one per cent: their last digits move with the processor's rounding.
bool same_line(const std::string& a, const std::string& b) {
  const std::vector<std::string> left = words_of(a), right = words_of(b);
  return std::equal(left.begin(), left.end(), right.begin(), right.end(), [](const std::string& x, const std::string& y) {
    if (x == y) return true;
    char *x_end = nullptr, *y_end = nullptr;
    const double u = std::strtod(x.c_str(), &x_end), v = std::strtod(y.c_str(), &y_end);
    return x_end != x.c_str() && y_end != y.c_str() && std::string(x_end) == y_end && std::abs(u - v) <= 0.01 * std::abs(u);
  });
}

/// A command of a document, and the lines printed below it; "..." stands for what is left out.
struct Shown {
  std::string command;
  std::vector<std::string> lines;
};

std::vector<Shown> shown_in(const std::string& text) {
  std::vector<Shown> all;
  bool code = false, below = false;
  for (const std::string& line : lines_of(text)) {
    if (line.starts_with("```")) {
      code = !code;
      below = false;
    } else if (code && line.starts_with("$ ")) {
      all.push_back({line.substr(2), {}});
      below = true;
    } else if (below && line.find_first_not_of(" .") != std::string::npos) {
      all.back().lines.push_back(line);
    }
  }
  return all;
}

/// While it lives, programs are started in `directory`.
class WorkingDirectory {
 public:
  explicit WorkingDirectory(const std::string& directory) : before_(std::filesystem::current_path()) { std::filesystem::current_path(directory); }
  ~WorkingDirectory() { std::filesystem::current_path(before_); }
  WorkingDirectory(const WorkingDirectory&) = delete;
  WorkingDirectory& operator=(const WorkingDirectory&) = delete;

 private:
  std::filesystem::path before_;
};

/// `run` as a logger with another separator and decimal sign writes it.
std::string as_a_logger_writes(const std::string& run) {
  std::string text;
  for (std::string line : lines_of(run)) {
    if (line.starts_with('#')) continue;
    if (line.starts_with("time")) line = "Time (s),Angle (deg),Load cell (N)";
    std::replace(line.begin(), line.end(), ',', ';');
    std::replace(line.begin(), line.end(), '.', ',');
    text += line + "\n";
  }
  return text;
}

TEST(Documents, TheFiveMinutesOfTheReadmeComeOutAsPrinted) {
  const TemporaryDirectory directory;
  const WorkingDirectory there(directory.path(""));
  for (const char* file : {"rig.toml", "dry_pluck.csv", "wet_pluck.csv", "step_b.csv", "step_c.csv", "heldout.csv"})
    std::filesystem::copy_file(test::null_campaign(file), directory.path(file));
  directory.file("logger.csv", as_a_logger_writes(read_text(test::null_campaign("step_a.csv"))));

  int commands = 0;
  for (const Shown& shown : shown_in(read_text(source_path("README.md")))) {
    std::vector<std::string> words = words_of(shown.command);
    if (words.front() == "cat") {
      std::string text;
      for (const std::string& line : shown.lines) text += line + "\n";
      directory.file(words.at(1), text);
      continue;
    }
    ASSERT_EQ(words.front(), "unrig");
    ++commands;
    const test::Finished finished = run_unrig(directory, {words.begin() + 1, words.end()});
    EXPECT_EQ(finished.status, 0) << shown.command << "\n" << finished.err;
    const std::vector<std::string> printed = lines_of(finished.out);
    for (const std::string& line : shown.lines)
      EXPECT_TRUE(std::any_of(printed.begin(), printed.end(), [&](const std::string& other) { return same_line(line, other); })) << shown.command << "\ndoes not print\n" << line << "\nbut\n" << finished.out;
  }
  EXPECT_GE(commands, 6) << "the README shows import, fit, correct, diagnose and report";

  const std::string manual = read_text(source_path("correct/manual/results.md"));
  for (const char* file : {"fit.json", "diagnosis.json"}) {
    const nlohmann::json result = nlohmann::json::parse(read_text(directory.path(file)));
    for (const auto& [key, value] : result.items())
      EXPECT_TRUE(key == "unrig" || manual.find("`" + key) != std::string::npos) << "correct/manual/results.md does not name " << key << " of " << file;
  }
}

/// As a newcomer types them: through the shell, from an empty folder, with `unrig` found by its name.
TEST(Documents, TheTwentyMinutesComeOutAsPrinted) {
  const TemporaryDirectory directory;
  const WorkingDirectory there(directory.path(""));
  const std::filesystem::path programs = directory.path("programs");
  std::filesystem::create_directory(programs);
  std::filesystem::create_symlink(std::filesystem::canonical(test::unrig_binary()), programs / "unrig");
  int commands = 0;
  for (const Shown& shown : shown_in(read_text(source_path("correct/manual/twenty_minutes.md")))) {
    const std::string call = "export PATH='" + programs.string() + "':\"$PATH\"; { " + shown.command + "; } >.out 2>.err";
    const int status = std::system(call.c_str());
    ++commands;
    EXPECT_EQ(status, 0) << shown.command << "\n" << read_text(".err");
    const std::vector<std::string> printed = lines_of(read_text(".out"));
    for (const std::string& line : shown.lines)
      EXPECT_TRUE(std::any_of(printed.begin(), printed.end(), [&](const std::string& other) { return same_line(line, other); })) << shown.command << "\ndoes not print\n" << line << "\nbut\n" << read_text(".out");
  }
  EXPECT_EQ(commands, 13);
  for (const char* made : {"rig.toml", "fit.json", "corrected.csv", "indicial.csv", "report.html"}) EXPECT_TRUE(std::filesystem::exists(made)) << made;
}

TEST(Documents, TheManualsLookAtARigComesOutAsPrinted) {
  const TemporaryDirectory directory;
  const std::vector<Shown> shown = shown_in(read_text(source_path("correct/manual/rig_files.md")));
  ASSERT_EQ(shown.size(), 1u);
  std::vector<std::string> words = words_of(shown.front().command);
  for (std::string& word : words)
    if (word.starts_with("sample_data/")) word = source_path(word);
  const WorkingDirectory there(directory.path(""));
  const test::Finished finished = run_unrig(directory, {words.begin() + 1, words.end()});
  EXPECT_EQ(finished.status, 0) << finished.err;
  const std::vector<std::string> printed = lines_of(finished.out);
  for (const std::string& line : shown.front().lines)
    EXPECT_TRUE(std::any_of(printed.begin(), printed.end(), [&](const std::string& other) { return same_line(line, other); })) << line << "\nis not in\n" << finished.out;
}

/// The documents of the project.
std::vector<std::filesystem::path> documents() {
  std::vector<std::filesystem::path> all{source_path("README.md")};
  for (const char* folder : {"core", "fit", "correct", "tests", "sample_data"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(source_path(folder)))
      if (entry.path().extension() == ".md") all.push_back(entry.path());
  return all;
}

/// A heading's anchor, as GitHub makes it.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading) {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-') anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (c == ' ') anchor += '-';
  }
  return anchor;
}

bool has_anchor(const std::filesystem::path& document, const std::string& anchor) {
  const std::vector<std::string> lines = lines_of(read_text(document.string()));
  return std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
    const std::size_t text = line.find_first_not_of('#');
    return text != 0 && text != std::string::npos && line[text] == ' ' && anchor_of(line.substr(text + 1)) == anchor;
  });
}

TEST(Documents, LinksLeadSomewhere) {
  const std::regex link(R"(\]\(([^)#\s]*)(#[^)\s]*)?\))");
  int links = 0;
  for (const std::filesystem::path& document : documents()) {
    const std::string text = read_text(document.string());
    for (std::sregex_iterator found(text.begin(), text.end(), link), end; found != end; ++found) {
      const std::string target = (*found)[1], anchor = (*found)[2];
      if (target.starts_with("http")) continue;
      const std::filesystem::path file = target.empty() ? document : document.parent_path() / target;
      EXPECT_TRUE(std::filesystem::exists(file)) << document << ": " << target;
      if (!anchor.empty() && std::filesystem::exists(file)) {
        EXPECT_TRUE(has_anchor(file, anchor.substr(1))) << document << ": " << target << anchor;
      }
      ++links;
    }
  }
  EXPECT_GE(links, 50) << "otherwise this looks for nothing";
}

TEST(Documents, TheReadmeStaysAPage) { EXPECT_LE(words_of(read_text(source_path("README.md"))).size(), 1800u); }

/// As code writes it: `key`, key = value, [key], key.unit.
bool names(const std::string& page, const std::string& key) { return std::regex_search(page, std::regex("[\n`.\\[{ ]" + key + "(`|\\]| =|\\.[a-z])")); }

/// Every name in quotes among the arguments of `allow_only(...)` and in lists called `keys` of a reader.
std::vector<std::string> keys_of(const std::string& source) {
  const std::string text = read_text(source_path(source));
  const std::regex list(R"((allow_only\(|allow\(table, of, |keys)\s*\{([^}]*)\})"), name("\"([a-z_]+)\"");
  std::vector<std::string> keys;
  for (std::sregex_iterator one(text.begin(), text.end(), list), end; one != end; ++one) {
    const std::string names = (*one)[2];
    for (std::sregex_iterator key(names.begin(), names.end(), name); key != end; ++key) keys.push_back((*key)[1]);
  }
  return keys;
}

TEST(Documents, TheManualNamesEveryKeyOfTheReaders) {
  const std::string limits = read_text(source_path("correct/manual/propose.md")), laws = read_text(source_path("correct/manual/laws.md")), runs = read_text(source_path("correct/manual/run_files.md")), rigs = read_text(source_path("correct/manual/rig_files.md"));
  struct {
    const char* source;
    const std::string& page;
    std::size_t at_least;
  } const readers[] = {{"core/run/run.cpp", runs, 8}, {"core/import/import.cpp", runs, 25}, {"core/rig/rig.cpp", rigs, 15}, {"core/rig/rig_chain.cpp", rigs, 20}, {"core/rig/drawn_sections.cpp", rigs, 10}, {"core/rig/rig_gauge.cpp", rigs, 3}, {"core/law/law.cpp", laws, 10}, {"fit/propose/limits.cpp", limits, 10}};
  for (const auto& [source, page, at_least] : readers) {
    const std::vector<std::string> keys = keys_of(source);
    EXPECT_GE(keys.size(), at_least) << source << ": otherwise this looks for nothing";
    for (const std::string& key : keys) EXPECT_TRUE(names(page, key)) << "the manual does not name the key " << key << " of " << source;
  }
}

TEST(Documents, TheManualNamesEveryEffectAndItsParameters) {
  const std::vector<std::string> lines = lines_of(read_text(source_path("correct/manual/effects.md")));
  for (const Effect& e : effects()) {
    const auto of_effect = [&](const std::string& line) { return line.starts_with("| `" + e.id + "` |"); };
    EXPECT_EQ(std::count_if(lines.begin(), lines.end(), of_effect), 2) << e.id << ": one row for what it is, one for its equation";
    const auto row = std::find_if(lines.begin(), lines.end(), of_effect);
    if (row == lines.end()) continue;
    for (const std::vector<Parameter>* parameters : {&e.parameters, &e.modal_parameters})
      for (const Parameter& p : *parameters) EXPECT_NE(row->find("`" + p.name + "`"), std::string::npos) << e.id << "." << p.name;
  }
}

}  // namespace
}  // namespace unrig
