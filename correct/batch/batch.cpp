#include "correct/batch/batch.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <sstream>
#include <thread>

#include "core/files/error.h"
#include "core/files/kept_cases.h"
#include "core/files/provenance.h"
#include "core/files/run_command.h"
#include "core/files/text_file.h"
#include "core/files/verbosity.h"
#include "core/numerics/in_parallel.h"
#include "core/rig/fingerprint.h"
#include "correct/batch/batch_files.h"
#include "correct/batch/batch_values.h"
#include "correct/batch/child.h"
#include "correct/correct_command.h"
#include "fit/apparent_mass/apparent_mass_command.h"
#include "fit/check/check_command.h"
#include "fit/diagnose/diagnose_command.h"
#include "fit/fit_command.h"

namespace unrig {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using Strings = std::vector<std::string>;

constexpr std::size_t corrections_together = 16;
constexpr int not_kept = 3;  // exit status of a child that crashed without a signal

int run_of(const std::string& command, Strings words, bool* fault) {
  static constexpr Command commands[] = {{"check", "", check_command}, {"fit", "", fit_command}, {"correct", "", correct_command}, {"apparent-mass", "", apparent_mass_command}, {"diagnose", "", diagnose_command}};
  words.insert(words.begin(), command);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  for (const Command& c : commands)
    if (command == c.name) return run_command(c, static_cast<int>(words.size()), argv.data(), fault);
  throw std::logic_error("no command " + command);
}

/// A case with what is needed to compute it.
struct Planned {
  BatchCase result;
  Strings words;              ///< arguments but for outputs and --fit
  Strings files;              ///< that it reads, as the campaign names them
  std::string key;
  std::optional<std::size_t> fit;  ///< the case that a correction rests on
  std::size_t turn = 0;       ///< who takes it: shard i + 1 of n where turn mod n = i, or a rank that it is handed out to; ascending
  bool settled = false;       ///< nothing to compute
};

/// The recording's head, or nothing of it: what is wrong is the commands' to say.
void read_head(const std::string& text, BatchRow& row) {
  const auto take = [&](const std::string& part) {
    const Run run = parse_run(part, row.file);
    row.kind = to_string(run.kind);
    row.medium = run.medium;
    row.density = run.density;
    row.speed = run.speed;
  };
  std::size_t end = 0;
  for (int rows = 0; rows < 10 && end != std::string::npos && end < text.size();) {
    rows += text[end] == '#' ? 0 : 1;
    end = text.find('\n', end);
    if (end != std::string::npos) ++end;
  }
  for (const bool whole_file : {false, true}) try {
      return take(whole_file ? text : text.substr(0, end));
    } catch (const std::exception&) {  // the first rows alone may say too little
    }
}

/// Turns the file of campaigns into cases.
class Planner {
 public:
  explicit Planner(const Batch& batch) : batch_(batch) {
    for (std::size_t c = 0; c < batch.campaigns.size(); ++c) add_campaign(c);
  }
  std::vector<Planned> cases;
  std::vector<BatchRow> rows;

  std::string study() const {
    Strings all{program_};
    for (const BatchRow& row : rows) all.push_back(fmt::format("{} {} {}", row.campaign_name, row.file, row.part));
    for (const Planned& one : cases) all.push_back(fmt::format("{} {} {}", one.result.campaign, one.result.command, one.key));
    return fingerprint(std::string_view(fmt::format("{}", fmt::join(all, "\n"))));
  }

 private:
  void add_campaign(std::size_t index) {
    const BatchCampaign& c = batch_.campaigns[index];
    const std::size_t first = rows.size();
    for (const std::string& file : c.all_runs()) {
      BatchRow row;
      row.campaign = index, row.run = rows.size() - first, row.campaign_name = c.name, row.file = file;
      row.part = row.run < c.runs.size() ? "fitted" : row.run < c.runs.size() + c.heldout.size() ? "held out" : "further";
      content(file, [&](const std::string& text) { read_head(text, row); });
      rows.push_back(std::move(row));
    }
    turn_ += index > 0 ? 1 : 0;
    std::optional<std::size_t> fit;
    for (const std::string& command : c.commands) {
      if (command == "correct") {
        add_corrections(index, first, *fit);
        continue;
      }
      Planned one = planned(index, command);
      if (command == "check") {
        one.files = c.runs;
        one.files.insert(one.files.end(), c.heldout.begin(), c.heldout.end());
        one.words.insert(one.words.end(), one.files.begin(), one.files.end());
      } else if (command == "fit") {
        one.files = c.runs;
        one.words.insert(one.words.end(), c.runs.begin(), c.runs.end());
        for (const std::string& effect : c.effects) one.words.insert(one.words.end(), {"--effect", effect});
        for (const std::string& law : c.laws) {
          one.files.push_back(law);
          one.words.insert(one.words.end(), {"--law", law});
        }
      } else if (command == "diagnose") {
        one.files = c.runs;
        one.words.insert(one.words.end(), c.runs.begin(), c.runs.end());
        for (const std::string& run : c.heldout) {
          one.files.push_back(run);
          one.words.insert(one.words.end(), {"--heldout", run});
        }
        if (!c.candidates.empty()) one.words.insert(one.words.end(), {"--effects", fmt::format("{}", fmt::join(c.candidates, ","))});
      } else {
        choose_decays(one, first);
      }
      if (c.anyway && (command == "fit" || command == "diagnose")) one.words.push_back("--anyway");
      add(std::move(one));
      if (command == "fit") fit = cases.size() - 1;
    }
  }

  Planned planned(std::size_t campaign, const std::string& command) const {
    Planned one;
    one.result.campaign = campaign;
    one.result.command = command;
    one.words = {"--rig", batch_.campaigns[campaign].rig};
    return one;
  }

  /// Of every run in a stream, and of a rig of modes of every one that is driven: no free decays.
  void add_corrections(std::size_t index, std::size_t first, std::size_t fit) {
    const BatchCampaign& c = batch_.campaigns[index];
    std::size_t count = 0;
    for (std::size_t r = first; r < rows.size(); ++r) {
      const BatchRow& row = rows[r];
      if (row.kind == "pluck" || (row.kind == "step" && row.speed == 0.0 && !rigs_.at(c.rig).modal)) continue;
      if (count > 0 && count % corrections_together == 0) ++turn_;
      ++count;
      Planned one = planned(index, "correct");
      one.result.run = row.run;
      one.files = {row.file};
      one.words.push_back(row.file);
      if (c.anyway) one.words.push_back("--anyway");
      one.fit = fit;
      add(std::move(one));
    }
  }

  /// The first of the thinnest medium and the first of the densest.
  void choose_decays(Planned& one, std::size_t first) const {
    const BatchRow *dry = nullptr, *wet = nullptr;
    for (std::size_t r = first; r < rows.size(); ++r) {
      if (rows[r].kind != "pluck" || rows[r].part != "fitted") continue;
      if (!dry || *rows[r].density < *dry->density) dry = &rows[r];
      if (!wet || *rows[r].density > *wet->density) wet = &rows[r];
    }
    if (!dry || *dry->density == *wet->density) {
      one.settled = true;
      one.result.status = CaseStatus::unusable;
      one.result.messages = {"no two free decays in media of different density among the runs; wanted one in air and one in the fluid"};
      return;
    }
    one.files = {dry->file, wet->file};
    one.words.insert(one.words.end(), {"--dry", dry->file, "--wet", wet->file});
  }

  /// With its key: what it depends on by content, in order; files by the place that they have among the words.
  void add(Planned one) {
    const std::string rig = batch_.campaigns[one.result.campaign].rig;
    Strings parts{program_, one.result.command, rig_of(rig).fingerprint};
    for (const std::string& word : one.words)
      if (word != rig) parts.push_back(std::find(one.files.begin(), one.files.end(), word) != one.files.end() ? "file " + content(word) : word);
    if (one.fit) parts.push_back(cases[*one.fit].key);
    for (const std::string& message : one.result.messages) parts.push_back(message);
    one.key = fingerprint(std::string_view(fmt::format("{}", fmt::join(parts, "\n"))));
    one.files.insert(one.files.begin(), rig);
    one.turn = turn_;
    cases.push_back(std::move(one));
  }

  struct KnownRig {
    std::string fingerprint;
    bool modal = false;
  };
  /// Its text, and its numbers, of which some may stand in files that it names.
  const KnownRig& rig_of(const std::string& name) {
    const auto [known, fresh] = rigs_.try_emplace(name);
    if (fresh) {
      known->second.fingerprint = content(name);
      try {
        const Rig rig = read_rig(path_of(name));
        known->second.fingerprint += fingerprint(rig);
        known->second.modal = rig.is_modal();
      } catch (const InputError&) {  // the commands say why
      }
    }
    return known->second;
  }

  std::string path_of(const std::string& name) const { return (fs::path(batch_.folder) / name).string(); }

  /// Fingerprint of a file; `look` sees its text when it is read for the first time.
  std::string content(const std::string& name, const std::function<void(const std::string&)>& look = {}) {
    const auto [known, fresh] = contents_.try_emplace(name, "absent");
    if (!fresh && !look) return known->second;
    try {
      const std::string text = read_text(path_of(name));
      known->second = fingerprint(std::string_view(text));
      if (look) look(text);
    } catch (const InputError&) {  // the commands say why
    }
    return known->second;
  }

  const Batch& batch_;
  std::string program_ = provenance_of(0, nullptr).program;
  std::map<std::string, std::string> contents_;
  std::map<std::string, KnownRig> rigs_;
  std::size_t turn_ = 0;
};

const char* result_of(const std::string& command) {
  if (command == "correct") return "corrected.csv";
  if (command == "apparent-mass") return "apparent.json";
  return command == "check" ? "check.json" : command == "fit" ? "fit.json" : "diagnosis.json";
}

/// What a command said on standard error, sorted.
void take_said(BatchCase& one, const std::string& said) {
  const std::string own = "unrig " + one.command + ": ", no_answer = "warning: no trustworthy answer: ", warning = "warning: ";
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.starts_with("progress: ")) continue;
    if (line.starts_with(no_answer)) one.messages.push_back(line.substr(no_answer.size()));
    else if (line.starts_with(warning)) one.warnings.push_back(line.substr(warning.size()));
    else if (line.starts_with("check: ") && one.status == CaseStatus::done) one.warnings.push_back(line);
    else one.messages.push_back(line.starts_with(own) ? line.substr(own.size()) : line);
  }
}

/// The computing of cases and the files that they are kept in: KEY.json, written last, and beside it the result as the command wrote it.
class Workshop {
 public:
  Workshop(const BatchProblem& problem, const std::vector<Planned>& cases) : batch_(problem.batch), cases_(cases), kept_(fs::absolute(problem.cases).string()) {}

  /// As it was kept, under today's names of its files.
  std::optional<BatchCase> find(const Planned& one) const {
    const std::optional<std::string> text = kept_.find(one.key + ".json");
    if (!text) return std::nullopt;
    std::optional<BatchCase> found = kept_case(*text, one.files);
    if (!found || found->command != one.result.command) return std::nullopt;
    found->campaign = one.result.campaign;
    found->run = one.result.run;
    return found;
  }

  /// In a process of its own: computes and keeps a case.
  int compute(const Planned& one, int threads, std::FILE* said) const try {
    fs::current_path(batch_.folder);  // every file is called as the campaign calls it
    set_verbosity(Verbosity::normal);
    use_threads(threads);
    const std::string output = kept_.path(one.key + "." + result_of(one.result.command));
    Strings words = one.words;
    words.insert(words.end(), {"-o", output});
    if (one.fit) words.insert(words.end(), {"--fit", fit_for(one)});
    if (one.result.command == "correct" && !is_modal(batch_.campaigns[one.result.campaign].rig)) words.insert(words.end(), {"--indicial", kept_.path(one.key + ".indicial.csv")});
    bool fault = false;
    const int status = run_of(one.result.command, words, &fault);
    if (fault) return not_kept;
    BatchCase result = one.result;
    result.status = status == exit_done ? CaseStatus::done : status == exit_no_answer ? CaseStatus::no_answer : CaseStatus::unusable;
    take_said(result, whole(said));
    if (status != exit_wrong_use && fs::exists(output)) take_values(result, read_text(output), batch_.campaigns[result.campaign].all_runs());
    if (status == exit_no_answer && result.messages.empty())
      for (const BatchValue& value : result.values)
        if (value.name == "verdict") result.messages.push_back(value.value);
    kept_.keep(one.key + ".json", kept_text(result, one.files));
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return not_kept;
  }

 private:
  static bool is_modal(const std::string& rig) try {
    return read_rig(rig).is_modal();
  } catch (const InputError&) {
    return false;
  }

  /// The fit that a correction rests on, with its runs called as they are now.
  std::string fit_for(const Planned& one) const {
    const std::string path = kept_.path(cases_[*one.fit].key + ".fit.json");
    ordered_json fit = ordered_json::parse(read_text(path));
    const Strings& runs = batch_.campaigns[one.result.campaign].runs;
    std::map<std::string, std::string> now;
    for (std::size_t r = 0; r < runs.size(); ++r) now[fit.at("runs").at(r).at("file")] = runs[r];
    if (std::all_of(now.begin(), now.end(), [](const auto& name) { return name.first == name.second; })) return path;
    for (ordered_json& run : fit.at("runs")) run["file"] = now.at(run.at("file"));
    for (const char* list : {"parameters", "givens"})
      if (fit.contains(list))
        for (ordered_json& item : fit.at(list))
          if (item.contains("run") && now.contains(item.at("run"))) item["run"] = now.at(item.at("run"));
    kept_.keep(one.key + ".fit.json", fit.dump(2) + "\n");
    return kept_.path(one.key + ".fit.json");
  }

  const Batch& batch_;
  const std::vector<Planned>& cases_;
  KeptCases kept_;
};

/// The cases that fall to this process, from the first turn to the last.
class Shift {
 public:
  Shift(const BatchProblem& problem, const std::vector<Planned>& cases)
      : problem_(problem), cases_(cases), workshop_(problem, cases), turns_(turns_of(problem, cases)), most_(problem.threads > 0 ? static_cast<std::size_t>(problem.threads) : std::max(1u, std::thread::hardware_concurrency())) {
    for (const Planned& one : cases) expected_ += problem.hand_out || one.turn % problem.shards == problem.shard - 1 ? 1 : 0;
  }

  /// Until nothing is left. A turn is asked for when there is room for one more case.
  void work() {
    for (;;) {
      const bool room = children_.running() < most_;
      if (more_ && children_.running() + pending_.size() < most_) take_turn();
      else if (const std::optional<std::size_t> i = room ? startable() : std::nullopt) start(*i);
      else if (room && more_) take_turn();
      else if (children_.running() > 0) see_to(children_.wait());
      else return;
      tell();
    }
  }

  /// With their numbers, ascending; not what was only borrowed.
  std::vector<std::pair<std::size_t, BatchCase>> outcomes() const {
    std::vector<std::pair<std::size_t, BatchCase>> all;
    for (const auto& [i, outcome] : wanted_)
      if (!borrowed_.contains(i)) all.emplace_back(i, *outcome);
    return all;
  }

 private:
  static Pieces turns_of(const BatchProblem& problem, const std::vector<Planned>& cases) {
    const std::size_t count = cases.empty() ? 0 : cases.back().turn + 1;
    return problem.hand_out ? problem.hand_out(count) : pieces_of_shard(problem.shard, problem.shards, count);
  }

  void want(std::size_t i) {
    const std::optional<BatchCase>& known = wanted_[i] = cases_[i].settled ? cases_[i].result : workshop_.find(cases_[i]);
    if (!known) pending_.push_back(i);
  }

  void take_turn() {
    const std::optional<std::size_t> turn = turns_.next();
    more_ = turn.has_value();
    if (!more_) return;
    const auto first = std::ranges::lower_bound(cases_, *turn, {}, &Planned::turn);
    for (auto i = static_cast<std::size_t>(first - cases_.begin()); i < cases_.size() && cases_[i].turn == *turn; ++i) {
      const Planned& one = cases_[i];
      want(i);
      if (const std::optional<std::size_t> fit = one.fit; !wanted_[i] && fit && !wanted_.contains(*fit)) {
        borrowed_.insert(*fit);
        want(*fit);
      }
    }
  }

  /// The first that waits neither for its fit nor for another with the same content.
  std::optional<std::size_t> startable() const {
    for (const std::size_t i : pending_)
      if (const Planned& one = cases_[i]; !(one.fit && !wanted_.at(*one.fit)) && !at_work_.contains(one.key)) return i;
    return std::nullopt;
  }

  void start(std::size_t i) {
    const Planned& one = cases_[i];
    std::erase(pending_, i);
    std::optional<BatchCase>& outcome = wanted_[i];
    if (one.fit && wanted_.at(*one.fit)->status != CaseStatus::done) {
      outcome = one.result;
      outcome->status = CaseStatus::left_out;
      outcome->messages = {"there is no fit to rest on"};
    } else if (!(outcome = workshop_.find(one))) {  // else another process has done it meanwhile
      const int threads = static_cast<int>(most_ / std::min(most_, children_.running() + pending_.size() + 1));
      at_work_.insert(one.key);
      children_.start(i, [&](std::FILE* said) { return workshop_.compute(one, threads, said); });
    }
  }

  void see_to(const Children::Ended& ended) {
    const Planned& one = cases_[ended.job];
    at_work_.erase(one.key);
    std::optional<BatchCase>& outcome = wanted_[ended.job];
    if (ended.status == 0 && ended.signal == 0) outcome = workshop_.find(one);
    if (outcome) return;
    outcome = one.result;
    outcome->status = CaseStatus::failed;
    take_said(*outcome, ended.said);
    if (ended.signal != 0) outcome->messages.push_back(fmt::format("ended by signal {} ({})", ended.signal, ::strsignal(ended.signal)));
  }

  void tell() const {
    if (problem_.progress) problem_.progress(fmt::format("{} of {} cases", wanted_.size() - pending_.size() - children_.running(), expected_ + borrowed_.size()));
  }

  const BatchProblem& problem_;
  const std::vector<Planned>& cases_;
  const Workshop workshop_;
  Pieces turns_;
  std::size_t most_, expected_ = 0;
  bool more_ = true;
  std::map<std::size_t, std::optional<BatchCase>> wanted_;  // what fell to this process, and fits that its corrections rest on
  std::set<std::size_t> borrowed_;                          // those fits where they fell to another
  std::vector<std::size_t> pending_;
  std::set<std::string> at_work_;  // keys: of two campaigns with the same content one is computed
  Children children_;
};

}  // namespace

std::string to_string(CaseStatus status) {
  static constexpr const char* words[] = {"done", "left out", "no answer", "unusable", "failed"};
  return words[static_cast<std::size_t>(status)];
}

BatchResult run_batch(const BatchProblem& problem) {
  const Planner plan(problem.batch);
  BatchResult result;
  result.study = plan.study();
  result.rows = plan.rows;
  result.planned = plan.cases.size();
  result.shard = problem.shard;
  result.shards = problem.shards;
  Shift shift(problem, plan.cases);
  shift.work();
  result.cases = shift.outcomes();
  return result;
}

}  // namespace unrig
