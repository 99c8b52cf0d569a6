#include "correct/report/report_command.h"

#include <CLI/CLI.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "core/files/command.h"
#include "core/files/command_line.h"
#include "core/files/error.h"
#include "core/rig/given_files.h"
#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "correct/batch/batch_files.h"
#include "correct/report/result_files.h"
#include "fit/simulate/simulated_run.h"

namespace unrig {
namespace {

using nlohmann::json;

constexpr const char* wanted = "wanted what `unrig check`, `fit`, `apparent-mass`, `diagnose`, `trial`, `batch`, `correct` or `simulate` wrote with -o or --indicial";

void add_json(ReportPage& page, const std::string& text, const std::string& path, const ReportOptions& options) {
  const json result = json::parse(text, nullptr, false);
  if (result.is_discarded()) throw InputError({path, 0}, "not valid JSON", wanted, "");
  const std::string kind = text_of(result, "unrig");
  try {
    if (kind == "check") return add_check(page, result, path, options);
    if (kind == "fit") return add_fit(page, result, path, options);
    if (kind == "apparent-mass") return add_apparent_mass(page, result, path, options);
    if (kind == "diagnosis") return add_diagnosis(page, result, path, options);
    if (kind == "trial") return add_trial(page, result, path);
    if (kind == "batch") return add_batch(page, batch_result(nlohmann::ordered_json::parse(text), path), file_name(path));
  } catch (const json::exception& e) {
    throw InputError({path, 0}, e.what(), wanted, "");
  }
  throw InputError({path, 0}, kind.empty() ? "no key \"unrig\"" : "a result of the kind \"" + kind + "\"", wanted, "");
}

/// What is given of the two tables that one call of `unrig correct` writes.
struct Pairs {
  struct Table {
    std::string path, made_by;
  };
  std::vector<Table> corrected, indicial;
  std::vector<std::string> responses;  ///< all indicial responses, of earlier versions too

  void take(const std::string& path, const std::string& header) {
    if (header.starts_with("semichords,indicial")) responses.push_back(path);
    const std::size_t at = header.find(MadeBy::prefix);
    if (at == std::string::npos) return;
    const std::size_t first = at + MadeBy::prefix.size();
    const Table table{path, header.substr(first, header.find(',', first) - first)};
    if (header.starts_with("semichords,indicial")) indicial.push_back(table);
    else corrected.push_back(table);
  }

  /// Throws InputError where a load and a response of one recording come of two calls: one of the files was replaced and the other was not.
  void check() const {
    const auto lonely = [](const Table& table, const std::vector<Table>& others) {
      return std::none_of(others.begin(), others.end(), [&](const Table& other) { return other.made_by == table.made_by; });
    };
    for (const Table& load : corrected)
      for (const Table& response : indicial) {
        if (!lonely(load, indicial) || !lonely(response, corrected)) continue;
        if (MadeBy::of_column(load.made_by).run == MadeBy::of_column(response.made_by).run)
          throw InputError({response.path, 0}, "another call of `unrig correct` wrote it than " + load.path + ", of the same recording", "wanted the two that one call wrote: they rest on one estimate", "Correct the run again, with -o and --indicial.");
        warn(fmt::format("{} and {} are of different recordings", load.path, response.path));
      }
  }
};

void add_result(ReportPage& page, const std::string& path, const ReportOptions& options, Pairs& pairs) {
  const std::string text = read_text(path), header = text.substr(0, text.find('\n'));
  pairs.take(path, header);
  if (const std::size_t first = text.find_first_not_of(" \t\r\n"); first != std::string::npos && text[first] == '{') return add_json(page, text, path, options);
  if (header.starts_with("semichords,indicial")) return add_indicial(page, text, path);
  if (header.find(",from_inputs") != std::string::npos) return add_modal_load(page, text, path);
  if (header.find("normal_force_std") != std::string::npos) return add_corrected(page, text, path, options);
  if (simulated_run(text)) return add_simulated(page, text, path, options);
  throw InputError({path, 1}, "neither JSON nor a simulated run nor the header of a corrected record or an indicial response", wanted, "A recording itself is drawn with the fit.json that it belongs to.");
}

/// The day on which the page is written; of a build that is to be the same again, what SOURCE_DATE_EPOCH says (reproducible-builds.org).
std::string today() {
  std::time_t now = std::time(nullptr);
  if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH")) now = static_cast<std::time_t>(std::strtoll(epoch, nullptr, 10));
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(now));
}

}  // namespace

int report_command(int argc, char** argv) {
  CLI::App app{"Shows results as one HTML file that opens from disk without a network: traces and residuals, spectra, parameters, verdicts.", "unrig report"};
  std::vector<std::string> results;
  std::string output, title;
  ReportOptions options;
  app.add_option("results", results, "check.json, fit.json, apparent.json, diagnosis.json, trial.json, batch.json, corrected.csv, indicial.csv, simulated.csv, in any number and order")->required();
  app.add_option("-o,--output", output, "report (HTML)")->required();
  app.add_option("--data", options.data_folder, "folder of the recordings and the rig, where they are no longer at the paths that the results name");
  app.add_option("--title", title, "title of the page, in place of the files' names");
  app.footer("Example:\n  unrig report fit.json step_a_corrected.csv step_a_indicial.csv -o report.html");
  try {
    parse_command_line(app, argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_done : exit_wrong_use;
  }
  check_outputs({{"-o", output}}, results);
  if (title.empty())
    for (const std::string& path : results) title += (title.empty() ? "" : ", ") + file_name(path);
  ReportPage page(title);
  page.tell_date(today());
  Progress progress;
  Pairs pairs;
  for (const std::string& path : results) {
    progress("drawing " + file_name(path));
    add_result(page, path, options, pairs);
  }
  progress.clear();
  pairs.check();
  add_indicials(page, pairs.responses);
  const std::string html = page.html();
  write_text(output, html);
  fmt::print("{}: {} result{}, {:.2f} MB\n", output, results.size(), results.size() == 1 ? "" : "s", static_cast<double>(html.size()) / 1e6);
  return exit_done;
}

}  // namespace unrig
