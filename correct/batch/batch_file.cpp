#include "correct/batch/batch_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>

#include "core/effects/effect.h"
#include "core/files/near_word.h"
#include "core/files/text_file.h"
#include "core/files/toml_table.h"

namespace unrig {

const std::vector<std::string> batch_commands{"check", "fit", "correct", "apparent-mass", "diagnose"};

namespace {

namespace fs = std::filesystem;
using Strings = std::vector<std::string>;

bool has(const Strings& words, const std::string& word) { return std::find(words.begin(), words.end(), word) != words.end(); }

bool is_pattern(const std::string& text) { return text.find_first_of("*?[") != std::string::npos; }

/// So that glob() takes it for itself.
std::string literal(const std::string& text) {
  std::string quoted;
  for (const char c : text) {
    if (std::string_view("*?[]\\").find(c) != std::string_view::npos) quoted += '\\';
    quoted += c;
  }
  return quoted;
}

/// `name` from `folder`, a relative path without `./`; what is absolute stays.
std::string below(const std::string& folder, const std::string& name) { return (folder.empty() ? fs::path(name) : fs::path(folder) / name).lexically_normal().string(); }

/// What matches `pattern` from `folder`, in alphabetical order, without that folder.
Strings matches(const std::string& folder, const std::string& pattern) {
  const bool absolute = fs::path(pattern).is_absolute();
  const std::string before = absolute ? "" : folder + "/";
  glob_t found{};
  Strings names;
  if (::glob((literal(before) + pattern).c_str(), 0, nullptr, &found) == 0)
    for (std::size_t i = 0; i < found.gl_pathc; ++i) names.push_back(std::string(found.gl_pathv[i]).substr(before.size()));
  ::globfree(&found);
  std::sort(names.begin(), names.end());
  return names;
}

/// Reads one [[campaign]], or as many as its `folder` stands for.
class Reader {
 public:
  Reader(const TomlTable& file, std::string folder) : file_(file), folder_(std::move(folder)) {}

  std::vector<BatchCampaign> campaigns(const TomlTable& table) const {
    table.allow_only({"name", "folder", "rig", "runs", "heldout", "further", "commands", "effects", "laws", "candidates", "anyway"});
    if (!table.has("folder")) return {campaign(table, "")};
    if (table.has("name")) table.fail("name", table.full_name("name") + " stands beside a folder", "wanted one of them: a campaign is called as its folder");
    const std::string pattern = table.text("folder");
    std::vector<BatchCampaign> all;
    for (const std::string& found : matches(folder_, pattern))
      if (fs::is_directory(fs::path(folder_) / found)) all.push_back(campaign(table, below("", found)));
    if (all.empty()) table.fail("folder", fmt::format("no folder is called {}", pattern), "wanted one or more below " + folder_, "Paths begin in the folder of this file.");
    return all;
  }

 private:
  BatchCampaign campaign(const TomlTable& table, const std::string& inside) const {
    BatchCampaign c;
    const TomlTable& rigs = table.has("rig") || !file_.has("rig") ? table : file_;
    c.rig = below(&rigs == &table ? inside : "", rigs.text("rig"));
    c.commands = commands(table);
    c.runs = files(table, "runs", inside);
    if (c.runs.empty()) table.fail("runs", table.full_name("runs") + " is empty", "wanted one run or more");
    c.heldout = files(table, "heldout", inside);
    c.further = files(table, "further", inside);
    c.laws = files(table, "laws", inside);
    c.effects = effects(table, "effects");
    c.candidates = effects(table, "candidates");
    c.anyway = table.boolean_or("anyway", file_.boolean_or("anyway", false));
    c.name = !inside.empty() ? inside : table.has("name") ? table.text("name") : fs::path(c.runs.front()).parent_path().filename().string();
    if (c.name.empty()) table.fail("name", table.full_name("name") + " is missing, and its runs lie in no folder that it could be called after", "wanted a name");
    std::set<std::string> known;
    for (const char* key : {"runs", "heldout", "further"})
      for (const std::string& run : key == std::string_view("runs") ? c.runs : key == std::string_view("heldout") ? c.heldout : c.further)
        if (!known.insert(run).second) table.fail(key, fmt::format("{} has {} twice in this campaign", table.full_name(key), run), "wanted each run once", "A pattern may stand for it too.");
    unread(table, c);
    return c;
  }

  /// Refuses keys that say something to commands of which none is asked for.
  void unread(const TomlTable& table, const BatchCampaign& c) const {
    const std::map<std::string, Strings> readers{{"heldout", {"diagnose", "correct"}}, {"further", {"correct"}}, {"effects", {"fit"}}, {"laws", {"fit"}}, {"candidates", {"diagnose"}}};
    for (const auto& [key, commands] : readers)
      if (table.has(key) && std::none_of(commands.begin(), commands.end(), [&](const std::string& command) { return has(c.commands, command); }))
        table.fail(key, fmt::format("nothing reads {}", table.full_name(key)), fmt::format("wanted {} among the commands", fmt::join(commands, " or ")), fmt::format("This campaign has: {}.", fmt::join(c.commands, ", ")));
  }

  Strings commands(const TomlTable& table) const {
    const TomlTable& from = table.has("commands") || !file_.has("commands") ? table : file_;
    const Strings named = from.has("commands") ? from.texts("commands") : Strings{"check", "fit", "correct"};
    if (named.empty()) from.fail("commands", from.full_name("commands") + " is empty", fmt::format("wanted one or more of: {}", fmt::join(batch_commands, ", ")));
    for (const std::string& name : named)
      if (!has(batch_commands, name)) {
        const std::string meant = nearest_word(name, batch_commands);
        from.fail("commands", fmt::format("{} has \"{}\"", from.full_name("commands"), name), fmt::format("wanted one or more of: {}", fmt::join(batch_commands, ", ")), meant.empty() ? "" : "Did you mean " + meant + "?");
      }
    Strings ordered;
    for (const std::string& command : batch_commands)
      if (has(named, command) || (command == "fit" && has(named, "correct"))) ordered.push_back(command);  // a correction rests on a fit
    return ordered;
  }

  Strings files(const TomlTable& table, const std::string& key, const std::string& inside) const {
    Strings all;
    if (!table.has(key) && key != "runs") return all;
    for (const std::string& text : table.texts(key)) {
      if (!is_pattern(text)) {
        all.push_back(below(inside, text));
        continue;
      }
      const Strings found = matches(below(folder_, inside), text);
      if (found.empty()) table.fail(key, fmt::format("{}: no file matches \"{}\"", table.full_name(key), text), "wanted one or more in " + below(folder_, inside), "Paths begin in the folder of this file, or of the campaign's `folder`.");
      for (const std::string& name : found) all.push_back(below(inside, name));
    }
    return all;
  }

  Strings effects(const TomlTable& table, const std::string& key) const {
    if (!table.has(key)) return {};
    Strings known;
    for (const std::string& id : table.texts(key)) try {
        known.push_back(effect(id).id);
      } catch (const std::invalid_argument& e) {
        table.fail(key, fmt::format("{}: {}", table.full_name(key), e.what()), "wanted one of these");
      }
    return known;
  }

  const TomlTable& file_;
  std::string folder_;
};

}  // namespace

Strings BatchCampaign::all_runs() const {
  Strings all = runs;
  all.insert(all.end(), heldout.begin(), heldout.end());
  all.insert(all.end(), further.begin(), further.end());
  return all;
}

Batch read_batch(const std::string& path) {
  const TomlTable file = TomlTable::parse(read_text(path), path, "Text stands in double quotes, a remark begins with #.");
  if (!file.has("unrig_batch")) throw InputError({path, 1}, "no key \"unrig_batch\"", "wanted a file of campaigns, whose first line is `unrig_batch = 1`", "`unrig batch --help` shows one.");
  if (file.integer("unrig_batch") != 1) file.fail("unrig_batch", fmt::format("unrig_batch is {}", file.integer("unrig_batch")), "wanted 1, the version that this program knows");
  file.allow_only({"unrig_batch", "rig", "commands", "anyway", "campaign"});
  Batch batch;
  batch.file = path;
  batch.folder = fs::path(path).parent_path().string();
  if (batch.folder.empty()) batch.folder = ".";
  const Reader reader(file, batch.folder);
  std::map<std::string, int> names;
  for (const TomlTable& table : file.tables("campaign"))
    for (BatchCampaign& campaign : reader.campaigns(table)) {
      const int line = table.place("name").line;
      if (const auto [known, fresh] = names.emplace(campaign.name, line); !fresh)
        throw InputError({path, line}, fmt::format("the campaign \"{}\" stands already in line {}", campaign.name, known->second), "wanted a name for each", "Give each a `name`.");
      batch.campaigns.push_back(std::move(campaign));
    }
  return batch;
}

}  // namespace unrig
