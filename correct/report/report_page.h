#pragma once
#include <Eigen/Core>
#include <optional>
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

/// A stretch of a plot's axis that is boxed, with its name.
struct Box {
  double from, to;
  std::string name;
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
  std::vector<Box> boxes = {};
  std::optional<std::pair<double, double>> y_range = {};  ///< what the axis shows at first; a button shows all
  bool stacked = false;          ///< shares of a whole, each on those that follow it, filled: curves without bands, of values from 0 to 1
};

/// A rectangle on a map.
struct MapBox {
  double from, to, low, high;
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
  std::vector<MapBox> boxes = {};
  std::vector<std::string> names = {};  ///< of a square of things against themselves, in place of the axes' numbers
  double limit = 0;        ///< of a signed map: where its colours end; 0: at its largest value
};

/// A share, 0 to 1, with its interval.
struct Bar {
  std::string name;
  double value, low, high;
  std::string text;  ///< behind it
  int colour = 1;
};

/// What a page tells of a run in its head.
struct RunFacts {
  std::string file, kind, medium;
  double density = 0;            ///< kg/m^3
  double speed = 0;              ///< m/s
  double reduced_frequency = 0;  ///< pi f c / U of the lowest mode; NaN where there is none
  double reynolds_number = 0;    ///< NaN where the viscosity is not known
  double seconds = 0;
};

/// One HTML file that shows what it is given, in that order, and needs nothing else: style, script, dygraphs and data are inside.
class ReportPage {
 public:
  explicit ReportPage(const std::string& title);
  void add_verdict(Tone tone, const std::string& text, const std::string& about);
  void add_section(const std::string& title);
  /// A heading within a section, for what follows it: none where another heading or section follows, or this empty one.
  void add_heading(const std::string& title);
  /// An equation as a person types it; the page sets it.
  void add_equation(const std::string& name, const std::string& equation, const std::string& source);
  void add_bars(const std::string& title, const std::string& label, const std::vector<Bar>& bars, const std::string& caption = "");
  /// The head of the page; what was told already is not told twice.
  void tell_date(const std::string& date);
  void tell_rig(const std::string& rig);
  void tell_command(const std::string& command);
  void tell_run(const RunFacts& run);
  void add_text(const std::string& text);
  void add_table(const std::string& title, const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows, const std::string& caption = "");
  /// Records of more than 6000 samples are thinned to the smallest and the largest value of every curve in each of some 1000 stretches, so
  /// that no peak is lost, and the caption says so. The stretches are short where the curves vary, down to single samples: a step in a million of them can be zoomed into. Throws std::invalid_argument where the lengths differ.
  void add_plot(const Plot& plot);
  void add_map(const HeatMap& map);
  std::string html() const;

 private:
  void push(nlohmann::json block);

  nlohmann::json data_;
  std::string heading_;  ///< waits for something to stand over
};

/// Rows of `plot` that stay when it is thinned to `most`: half of the stretches are even, the others come of halving, again and again, the one in which a curve varies most.
std::vector<Eigen::Index> kept_rows(const Plot& plot, Eigen::Index most);

/// The page with style, script and dygraphs, made at build time from page.html; `/*UNRIG_DATA*/` stands where the data go.
extern const char* const report_page_template;

}  // namespace unrig
