#pragma once
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/files/provenance.h"
#include "correct/report/report_page.h"

namespace unrig {

struct BatchResult;

/// What the report is told besides the results.
struct ReportOptions {
  std::string data_folder;  ///< where recordings and rigs are looked for first; empty: where the results say
};

/// A file that a result names, wherever it is now: in `data_folder`, at the path that was recorded, at that path from the result's folder, or beside
/// the result by its name. Empty where it is nowhere.
std::optional<std::string> found_file(const std::string& recorded, const std::string& result_file, const ReportOptions& options);

/// The file's name without folders.
std::string file_name(const std::string& path);

/// "1.1219 ± 0.0002": the value with two digits of its error, large and small numbers over one power of ten, "(2.4841 ± 0.0053)e6"; without an error six digits.
std::string with_error(double value, double std_error);
/// A number of a result, NaN where it is absent or null.
double number_of(const nlohmann::json& object, const char* key);
std::string text_of(const nlohmann::json& object, const char* key);
/// Up to `digits` digits, an em dash where it is not finite.
std::string plain(double x, int digits = 5);

/// What made a result, told in the head of the page; nothing where it does not say.
void add_provenance(ReportPage& page, const Provenance& made);
void add_provenance(ReportPage& page, const nlohmann::json& result);
/// The `warnings` of a result, as texts of the section.
void add_warnings(ReportPage& page, const nlohmann::json& result);

/// "time [s]"; no brackets where the unit is none.
std::string labelled(const std::string& name, const std::string& unit);

/// Sections of the page for one result each. `result` is the whole file, `path` where it lies. Throw InputError, naming the file, for what is not as
/// `unrig` writes it; what the result only refers to (recordings) may be absent, which is warned of.
void add_fit(ReportPage& page, const nlohmann::json& result, const std::string& path, const ReportOptions& options);
void add_apparent_mass(ReportPage& page, const nlohmann::json& result, const std::string& path, const ReportOptions& options);
void add_diagnosis(ReportPage& page, const nlohmann::json& result, const std::string& path, const ReportOptions& options);
/// What `unrig check` found, with a picture of the rig and its mode shapes where its file is found.
void add_check(ReportPage& page, const nlohmann::json& result, const std::string& path, const ReportOptions& options);
void add_trial(ReportPage& page, const nlohmann::json& result, const std::string& path);
/// A table with a row for each run of a batch, called `name`.
void add_batch(ReportPage& page, const BatchResult& result, const std::string& name);
/// A run that `unrig simulate` wrote, beside the recording that it was simulated from where that is found.
void add_simulated(ReportPage& page, const std::string& text, const std::string& path, const ReportOptions& options);
void add_corrected(ReportPage& page, const std::string& text, const std::string& path, const ReportOptions& options);
/// `unrig correct` on a rig that is known only as modes.
void add_modal_load(ReportPage& page, const std::string& text, const std::string& path);
void add_indicial(ReportPage& page, const std::string& text, const std::string& path);

/// The indicial responses of several steps in one plot; nothing of fewer than two.
void add_indicials(ReportPage& page, const std::vector<std::string>& paths);

/// Amplitude spectra of two records on one grid, `dt` [s] apart, in the unit of the records: means removed, Hann window, missing samples bridged. `modes` [Hz], ascending, are marked, and the
/// axis ends behind the last of them; without them at half the sampling rate. `boxes`: bands [Hz] to be boxed.
void add_spectra(ReportPage& page, const std::string& title, double dt, const std::string& unit, const Curve& before, const Curve& after,
                 const std::string& caption, const std::vector<double>& modes = {}, const std::vector<Box>& boxes = {});

/// Whether a residual is white and normal: its autocorrelation, and its quantiles against those of the normal distribution. `name` of the channel, `sigma` its noise in the residual's unit, `dt` [s].
void add_residual_checks(ReportPage& page, const std::string& name, const Eigen::VectorXd& residual, double sigma, double dt);

}  // namespace unrig
