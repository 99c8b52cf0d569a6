#pragma once
#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace unrig {

/// How a verdict stands: explained, contradicted, or open; told, where there is nothing to hold it against.
enum class Tone { good, bad, open, told };

/// A curve of a plot. Colours count through a palette that colour-blind readers can tell apart: 0 for what was measured, then the model's.
struct Curve {
  std::string name;
  int colour = 0;
  Eigen::VectorXd value;    ///< NaN leaves a gap
  Eigen::VectorXd std = {}; ///< one standard deviation, drawn as a band of two; empty: no band
  bool dashed = false;
  bool points = false;      ///< dots, not a line
};

struct Plot {
  std::string title;
  std::string x_label, y_label;  ///< with their units: "time [s]"
  Eigen::VectorXd x;             ///< increasing
  std::vector<Curve> curves;     ///< each as long as x
  std::string group = {};        ///< plots of one group zoom together
  std::string caption = {};
  bool log_x = false, log_y = false;
  int height = 260;              ///< pixels
  std::vector<std::pair<double, std::string>> marks = {};  ///< named vertical lines
  Eigen::VectorXd busy = {};     ///< a long record keeps its detail where this varies, as long as x; empty: where its curves do
};

/// z over x and y: one row per y.
struct HeatMap {
  std::string title;
  std::string x_label, y_label, z_label;
  std::vector<double> x, y;
  std::vector<std::vector<double>> z;
  std::string caption = {};
  bool log_z = false;   ///< six decades below the largest at most
  bool is_signed = false;  ///< colours that part at zero
};

/// One HTML file that shows what it is given, in that order, and needs nothing else: style, script, dygraphs and data are inside.
class ReportPage {
 public:
  explicit ReportPage(const std::string& title);
  void add_verdict(Tone tone, const std::string& text, const std::string& about);
  void add_section(const std::string& title);
  void add_text(const std::string& text);
  void add_table(const std::string& title, const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows, const std::string& caption = "");
  /// Records of more than 6000 samples are thinned to the smallest and the largest value of every curve in each of some 1000 stretches, so
  /// that no peak is lost, and the caption says so. The stretches are short where the curves vary, down to single samples: a step in a million of them can be zoomed into. Throws std::invalid_argument where the lengths differ.
  void add_plot(const Plot& plot);
  void add_map(const HeatMap& map);
  std::string html() const;

 private:
  nlohmann::json data_;
};

/// Rows of `plot` that stay when it is thinned to `most`: half of the stretches are even, the others come of halving, again and again, the one in which a curve varies most.
std::vector<Eigen::Index> kept_rows(const Plot& plot, Eigen::Index most);

/// The page with style, script and dygraphs, made at build time from page.html; `/*UNRIG_DATA*/` stands where the data go.
extern const char* const report_page_template;

}  // namespace unrig
