#include "correct/batch/batch_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

#include "core/files/error.h"
#include "core/files/provenance.h"
#include "fit/trial/parts.h"

namespace unrig {
namespace {

using nlohmann::ordered_json;
using Strings = std::vector<std::string>;
using Values = std::vector<BatchValue>;

constexpr const char* wanted = "wanted what `unrig batch -o FILE.json` wrote";

ordered_json json_of(const Values& values) {
  ordered_json list = ordered_json::array();
  for (const BatchValue& v : values) list.push_back({{"name", v.name}, {"unit", v.unit}, {"value", v.value}});
  return list;
}

Values values_of(const ordered_json& list) {
  Values values;
  for (const ordered_json& v : list) values.push_back({v.at("name"), v.at("unit"), v.at("value")});
  return values;
}

ordered_json json_of(const BatchCase& one) {
  ordered_json json = {{"command", one.command}, {"status", to_string(one.status)}, {"messages", one.messages}, {"warnings", one.warnings}, {"values", json_of(one.values)}};
  json["by_run"] = ordered_json::array();
  for (const Values& values : one.by_run) json["by_run"].push_back(json_of(values));
  return json;
}

CaseStatus status_of(const std::string& word) {
  for (const CaseStatus status : {CaseStatus::done, CaseStatus::left_out, CaseStatus::no_answer, CaseStatus::unusable, CaseStatus::failed})
    if (to_string(status) == word) return status;
  throw InputError({"status", 0}, "\"" + word + "\"", wanted, "");
}

BatchCase case_of(const ordered_json& json) {
  BatchCase one;
  json.at("command").get_to(one.command);
  one.status = status_of(json.at("status"));
  json.at("messages").get_to(one.messages);
  json.at("warnings").get_to(one.warnings);
  one.values = values_of(json.at("values"));
  for (const ordered_json& values : json.at("by_run")) one.by_run.push_back(values_of(values));
  return one;
}

/// `text` with every name of `before` exchanged for that of `now` in the same place: the longest that begins where a word begins.
std::string renamed(const std::string& text, const Strings& before, const Strings& now) {
  const auto in_a_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '/' || c == '.' || c == '-'; };
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t longest = before.size();
    if (at == 0 || !in_a_name(text[at - 1]))
      for (std::size_t f = 0; f < before.size(); ++f)
        if (text.compare(at, before[f].size(), before[f]) == 0 && (longest == before.size() || before[f].size() > before[longest].size())) longest = f;
    if (longest == before.size()) out += text[at++];
    else out += now[longest], at += before[longest].size();
  }
  return out;
}

std::string cell(const ordered_json& value, int digits) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return digits > 0 ? fmt::format("{:.{}g}", value.get<double>(), digits) : fmt::format("{}", value.get<double>());
  return value.is_null() ? "" : value.dump();
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

std::string heading(const std::string& name, const std::string& unit) { return unit.empty() || unit == "1" ? name : fmt::format("{} [{}]", name, unit); }

std::string message_of(const BatchCase& one, const std::string& message) { return message.starts_with("check: ") ? message : one.command + ": " + message; }

/// Each once, in their order.
std::string joined(const Strings& texts) {
  Strings once;
  for (const std::string& text : texts)
    if (std::find(once.begin(), once.end(), text) == once.end()) once.push_back(text);
  return fmt::format("{}", fmt::join(once, "; "));
}

/// A row while it is put together.
struct Filling {
  CaseStatus status = CaseStatus::done;
  Strings messages, warnings;
  std::map<std::string, ordered_json> cells;  // by heading
};

/// The headings of one command's block, in the order in which its values were met.
struct Block {
  Strings headings;
  void meet(const std::string& name) {
    if (std::find(headings.begin(), headings.end(), name) == headings.end()) headings.push_back(name);
  }
};

std::vector<Filling> filled(const BatchResult& result, std::map<std::string, Block>& blocks) {
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> row_of;
  std::map<std::size_t, std::vector<std::size_t>> rows_of_campaign;
  for (std::size_t r = 0; r < result.rows.size(); ++r) {
    row_of[{result.rows[r].campaign, result.rows[r].run}] = r;
    rows_of_campaign[result.rows[r].campaign].push_back(r);
  }
  std::vector<Filling> rows(result.rows.size());
  for (const auto& numbered : result.cases) {
    const auto& one = numbered.second;
    Block& block = blocks[one.command];
    const auto put = [&](Filling& row, const Values& values) {
      for (const BatchValue& v : values) {
        const std::string name = heading(one.command + "." + v.name, v.unit);
        block.meet(name);
        row.cells[name] = v.value;
      }
    };
    const std::vector<std::size_t> own = one.run ? std::vector<std::size_t>{row_of.at({one.campaign, *one.run})} : rows_of_campaign.at(one.campaign);
    for (const std::size_t r : own) {
      Filling& row = rows[r];
      row.status = std::max(row.status, one.status);
      row.cells[one.command] = to_string(one.status);
      for (const std::string& m : one.messages) row.messages.push_back(message_of(one, m));
      row.warnings.insert(row.warnings.end(), one.warnings.begin(), one.warnings.end());
      put(row, one.values);
      if (const std::size_t place = result.rows[r].run; place < one.by_run.size()) put(row, one.by_run[place]);
    }
  }
  return rows;
}

}  // namespace

std::string kept_text(const BatchCase& one, const Strings& files) {
  ordered_json json = json_of(one);
  json["files"] = files;
  return json.dump() + "\n";
}

std::optional<BatchCase> kept_case(const std::string& text, const Strings& files) try {
  const ordered_json json = ordered_json::parse(text);
  BatchCase one = case_of(json);
  const Strings before = json.at("files").get<Strings>();
  if (before.size() != files.size()) return std::nullopt;
  if (before != files)
    for (Strings* const said : {&one.messages, &one.warnings})
      for (std::string& line : *said) line = renamed(line, before, files);
  return one;
} catch (const std::exception&) {
  return std::nullopt;  // damaged: computed again
}

std::string to_json(const BatchResult& r) {
  ordered_json rows = ordered_json::array(), cases = ordered_json::array();
  for (const BatchRow& row : r.rows) {
    ordered_json json = {{"campaign", row.campaign_name}, {"number", row.campaign}, {"run", row.file}, {"place", row.run}, {"part", row.part}, {"kind", row.kind}, {"medium", row.medium}, {"density", nullptr}, {"speed", nullptr}};
    if (row.density) json["density"] = {{"value", *row.density}, {"unit", "kg/m^3"}};
    if (row.speed) json["speed"] = {{"value", *row.speed}, {"unit", "m/s"}};
    rows.push_back(std::move(json));
  }
  for (const auto& [number, one] : r.cases) {
    ordered_json json = {{"case", number}, {"campaign", one.campaign}};
    if (one.run) json["run"] = *one.run;
    json.update(json_of(one));
    cases.push_back(std::move(json));
  }
  ordered_json json = {{"unrig", "batch"}, {"program", provenance_of(0, nullptr).program}, {"study", r.study}, {"planned", r.planned}, {"rows", rows}, {"cases", cases}};
  if (r.shards > 1) json["shard"] = fmt::format("{}/{}", r.shard, r.shards);
  return json.dump(1) + "\n";
}

BatchResult batch_result(const ordered_json& json, const std::string& path) try {
  BatchResult r;
  json.at("study").get_to(r.study);
  json.at("planned").get_to(r.planned);
  for (const ordered_json& one : json.at("rows")) {
    BatchRow row;
    row.campaign_name = one.at("campaign"), row.campaign = one.at("number"), row.file = one.at("run"), row.run = one.at("place");
    row.part = one.at("part"), row.kind = one.at("kind"), row.medium = one.at("medium");
    if (!one.at("density").is_null()) row.density = one.at("density").at("value").get<double>();
    if (!one.at("speed").is_null()) row.speed = one.at("speed").at("value").get<double>();
    r.rows.push_back(std::move(row));
  }
  for (const ordered_json& one : json.at("cases")) {
    BatchCase found = case_of(one);
    found.campaign = one.at("campaign");
    if (one.contains("run")) found.run = one.at("run").get<std::size_t>();
    const auto belongs = [&](const BatchRow& row) { return row.campaign == found.campaign && (!found.run || row.run == *found.run); };
    if (std::none_of(r.rows.begin(), r.rows.end(), belongs)) throw InputError({path, 0}, "a case of no row", wanted, "");
    r.cases.emplace_back(one.at("case").get<std::size_t>(), std::move(found));
  }
  return r;
} catch (const nlohmann::json::exception& e) {
  throw InputError({path, 0}, e.what(), wanted, "Run the batch again with this version.");
}

BatchResult collected(const std::vector<BatchResult>& shards, const Strings& paths) {
  using Numbered = std::pair<std::size_t, BatchCase>;
  std::vector<Part<Numbered>> parts;
  for (std::size_t s = 0; s < shards.size(); ++s) {
    Part<Numbered> part{paths[s], shards[s].study, shards[s].planned, {}};
    for (const Numbered& one : shards[s].cases) part.cases.emplace_back(one.first, one);
    parts.push_back(std::move(part));
  }
  BatchResult all = shards.front();
  all.shard = all.shards = 1;
  const PartsOf of{"case", "cases", "the same version, campaigns, rigs and recordings"};
  all.cases = all_cases(parts, of, [](const Numbered& a, const Numbered& b) { return json_of(a.second) == json_of(b.second); });
  return all;
}

BatchTable table_of(const BatchResult& result, int digits) {
  std::map<std::string, Block> blocks;
  const std::vector<Filling> filled_rows = filled(result, blocks);
  BatchTable table;
  table.header = {"campaign", "run", "part", "kind", "medium", "density [kg/m^3]", "speed [m/s]", "status", "message", "warnings"};
  Strings further;
  for (const std::string& command : batch_commands)
    if (const auto block = blocks.find(command); block != blocks.end()) {
      further.push_back(command);
      further.insert(further.end(), block->second.headings.begin(), block->second.headings.end());
    }
  table.header.insert(table.header.end(), further.begin(), further.end());
  for (std::size_t r = 0; r < result.rows.size(); ++r) {
    const BatchRow& row = result.rows[r];
    const Filling& with = filled_rows[r];
    const auto number = [&](const std::optional<double>& x) { return x ? cell(*x, digits) : std::string(); };
    Strings cells{row.campaign_name, row.file, row.part, row.kind, row.medium, number(row.density), number(row.speed), to_string(with.status), joined(with.messages), joined(with.warnings)};
    for (const std::string& name : further) {
      const auto found = with.cells.find(name);
      cells.push_back(found == with.cells.end() ? "" : cell(found->second, digits));
    }
    table.rows.push_back(std::move(cells));
  }
  return table;
}

std::string to_csv(const BatchResult& result) {
  const BatchTable table = table_of(result);
  std::string text;
  const auto line = [&](const Strings& cells) {
    for (std::size_t c = 0; c < cells.size(); ++c) text += (c > 0 ? "," : "") + quoted(cells[c]);
    text += "\n";
  };
  line(table.header);
  for (const Strings& row : table.rows) line(row);
  return text;
}

std::string count_of_rows(const BatchResult& result) {
  std::map<std::string, Block> blocks;
  std::map<CaseStatus, std::size_t> counts;
  for (const Filling& row : filled(result, blocks)) ++counts[row.status];
  Strings texts;
  for (const auto& [status, count] : counts) texts.push_back(fmt::format("{} {}", count, to_string(status)));
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::string report(const BatchResult& result) {
  std::size_t campaigns = 0;
  for (const BatchRow& row : result.rows) campaigns = std::max(campaigns, row.campaign + 1);
  std::string text = fmt::format("{} run{} in {} campaign{}: {}\n", result.rows.size(), result.rows.size() == 1 ? "" : "s", campaigns, campaigns == 1 ? "" : "s", count_of_rows(result));
  std::map<std::string, std::map<CaseStatus, std::size_t>> by_command;
  for (const auto& [number, one] : result.cases) ++by_command[one.command][one.status];
  for (const std::string& command : batch_commands)
    if (const auto counts = by_command.find(command); counts != by_command.end()) {
      Strings texts;
      for (const auto& [status, count] : counts->second) texts.push_back(fmt::format("{} {}", count, to_string(status)));
      text += fmt::format("    {:<14} {}\n", command, fmt::join(texts, ", "));
    }
  constexpr int most = 20;
  int told = 0;
  for (const auto& numbered : result.cases) {
    const auto& one = numbered.second;
    if (one.status == CaseStatus::done || one.status == CaseStatus::left_out) continue;
    if (++told > most) continue;
    const auto row = std::find_if(result.rows.begin(), result.rows.end(), [&](const BatchRow& r) { return r.campaign == one.campaign; });
    text += fmt::format("    {}: {}: {}\n", row->campaign_name, one.command, one.messages.empty() ? to_string(one.status) : one.messages.front());
  }
  if (told > most) text += fmt::format("    and {} more, in the table\n", told - most);
  return text;
}

}  // namespace unrig
