// The report in a browser: headless Chromium loads it from disk, a probe beside its script looks at the plots and zooms with the mouse, and the page
// after all that is what --dump-dom prints. Skipped where there is no Chromium (sample_data/setup.sh --optional installs it).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "core/files/text_file.h"
#include "tests/commands/report_results.h"

namespace unrig {
namespace {

using nlohmann::json;
using test::TemporaryDirectory;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Before every other script: keeps what the page complains of.
constexpr const char* listen = R"(<script>
window.complaints = [];
window.addEventListener('error', (event) => complaints.push(String(event.message)));
window.addEventListener('unhandledrejection', (event) => complaints.push(String(event.reason)));
for (const kind of ['error', 'warn']) console[kind] = (...what) => complaints.push(kind + ': ' + what.join(' '));
</script>)";

/// After every other script: how many plots there are and whether each holds numbers and ink, what a drag across the first does to its whole group, and
/// both themes.
constexpr const char* probe = R"(<script>
window.addEventListener('load', () => {  // all at once: --dump-dom comes right after the load
  unrigReport.redraw.forEach((draw) => draw());
  const found = {complaints, plots: []};
  for (const [name, graph] of Object.entries(unrigReport.graphs)) {
    const canvas = graph.canvas_.parentNode.querySelectorAll('canvas')[0];
    const pixels = graph.hidden_.getContext('2d').getImageData(0, 0, graph.hidden_.width, graph.hidden_.height).data;
    let ink = 0, numbers = 0;
    for (let i = 3; i < pixels.length; i += 4) if (pixels[i] > 0) ++ink;
    for (let k = 0; k < graph.numRows(); ++k) { const v = [].concat(graph.getValue(k, 1)); if (v.every((x) => x !== null && isFinite(x))) ++numbers; }
    found.plots.push({name, rows: graph.numRows(), numbers, ink, x: graph.getOption('xlabel'), y: graph.getOption('ylabel'), range: graph.xAxisRange()});
  }
  const graphs = Object.values(unrigReport.graphs), linear = graphs.filter((graph) => !graph.getOptionForAxis('logscale', 'x')), first = linear[0], second = linear[1], other = graphs[graphs.length - 1];
  found.whole = first.xAxisRange();
  const other_before = other.xAxisRange();
  const box = first.canvas_.getBoundingClientRect(), area = first.getArea();
  const mouse = (type, share, target) => target.dispatchEvent(new MouseEvent(type, {bubbles: true, cancelable: true, view: window, button: 0, buttons: 1,
      clientX: box.left + area.x + share * area.w, clientY: box.top + area.y + area.h / 2, screenX: box.left + area.x + share * area.w, screenY: box.top + area.y + area.h / 2}));
  mouse('mousedown', 0.25, first.mouseEventElement_);
  mouse('mousemove', 0.4, document);
  mouse('mousemove', 0.5, document);
  mouse('mouseup', 0.5, document);
  found.zoomed = [first.xAxisRange(), second.xAxisRange()];
  found.other_stays = String(other.xAxisRange()) === String(other_before);
  first.resetZoom();
  found.reset = [first.xAxisRange(), second.xAxisRange()];
  const paper = () => getComputedStyle(document.body).backgroundColor + ' ' + first.getColors()[1];
  unrigReport.setTheme('light'); found.light = paper();
  unrigReport.setTheme('dark'); found.dark = paper();
  window.dispatchEvent(new Event('beforeprint')); found.printed = paper();
  window.dispatchEvent(new Event('afterprint'));
  found.shown_maps = document.querySelectorAll('.map svg image').length;
  found.mismatches = document.querySelectorAll('.map svg .mismatch').length;
  found.equations = [...document.querySelectorAll('math')].map((equation) => equation.textContent);
  found.links = [...document.querySelectorAll('nav a')].filter((link) => document.querySelector(link.getAttribute('href'))).length;
  found.sections = document.querySelectorAll('h2').length;
  // A mark stands where its frequency is, on a logarithmic axis too: the dots of the lines that are drawn behind the data.
  found.log_axes = graphs.filter((graph) => graph.getOptionForAxis('logscale', 'x')).map((graph) => graph.toPercentXCoord(Math.sqrt(graph.xAxisRange()[0] * graph.xAxisRange()[1])));
  found.maps = Object.values(unrigReport.pictures).map((c) => { const p = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; const seen = new Set();
    for (let i = 0; i < p.length; i += 4) seen.add((p[i] << 16) + (p[i + 1] << 8) + p[i + 2]); return seen.size; });
  document.body.textContent = 'FOUND' + JSON.stringify(found) + 'END';
});
</script></body>)";

std::string chromium() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"})
    if (std::system((std::string("command -v ") + name + " >/dev/null 2>&1").c_str()) == 0) return name;
  return "";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.rfind(what);
  EXPECT_NE(at, std::string::npos);
  return text.replace(at, what.size(), by);
}

/// Chromium's exit status; what it prints goes to `out`, what the page says on its console to `log`.
int browse(const std::string& browser, const TemporaryDirectory& directory, const std::string& page, const std::string& options, const std::string& out, const std::string& log) {
  // --no-zygote: as a daemon's child Chromium otherwise waits for a zygote that never answers. It must not find a network either.
  const std::string command = "HOME=" + directory.path("") + " timeout 200 " + browser +
                              " --headless --no-sandbox --no-zygote --disable-gpu --disable-dev-shm-usage --no-first-run --disable-background-networking"
                              " --disable-component-update --host-resolver-rules='MAP * ~NOTFOUND' --enable-logging=stderr"
                              " --user-data-dir=" + directory.path("profile") + " " + options + " file://" + page + " >" + out + " 2>" + log;
  return std::system(command.c_str());
}

TEST(ReportInABrowser, LoadsDrawsAndZooms) {
  const std::string browser = chromium();
  if (browser.empty()) GTEST_SKIP() << "no Chromium on this machine; sample_data/setup.sh --optional installs it";
  const TemporaryDirectory directory;
  test::make_results(directory);
  const std::string diagnosis = directory.file("diagnosis.json", test::made_up_diagnosis().dump()), report = directory.path("report.html");
  ASSERT_EQ(test::run_unrig(directory, {"report", directory.path("fit.json"), diagnosis, directory.path("apparent.json"), directory.path("corrected.csv"), directory.path("indicial.csv"), "-o", report}).status, 0);
  std::string page = read_text(report);
  page = replaced(page, "<meta charset=\"utf-8\">", std::string("<meta charset=\"utf-8\">") + listen);
  const std::string probed = directory.file("probed.html", replaced(page, "</body>", probe)), dom = directory.path("dom.html"), log = directory.path("log.txt");
  ASSERT_EQ(browse(browser, directory, probed, "--window-size=1200,900 --dump-dom", dom, log), 0) << read_text(log);
  const std::string text = read_text(dom);
  const std::size_t first = text.find("FOUND{"), last = text.rfind("}END");
  ASSERT_TRUE(first != std::string::npos && last != std::string::npos) << text.substr(0, 2000) << read_text(log);
  const json found = json::parse(text.substr(first + 5, last - first - 4), nullptr, false);
  ASSERT_FALSE(found.is_discarded()) << text.substr(first, 500);

  EXPECT_EQ(found["complaints"], json::array());
  for (const std::string line : {"CONSOLE:", "Uncaught"}) EXPECT_THAT(read_text(log), ::testing::Not(HasSubstr(line)));
  ASSERT_GE(found["plots"].size(), 20u);
  for (const json& plot : found["plots"]) {
    EXPECT_GT(plot["rows"], 2) << plot;
    EXPECT_GT(plot["numbers"].get<int>(), plot["rows"].get<int>() / 2) << plot;
    EXPECT_GT(plot["ink"], 500) << plot;
    EXPECT_THAT(plot["x"].get<std::string>(), HasSubstr("[")) << plot;
  }
  // The drag went from a quarter to half of the axis; a pixel on either side.
  const double low = found["whole"][0], high = found["whole"][1], pixel = (high - low) / 800;
  for (const json& range : found["zoomed"]) {
    EXPECT_NEAR(range[0].get<double>(), low + (high - low) * 0.25, 2 * pixel);
    EXPECT_NEAR(range[1].get<double>(), low + (high - low) * 0.5, 2 * pixel);
  }
  EXPECT_EQ(found["other_stays"], true);
  for (const json& range : found["reset"]) {
    EXPECT_NEAR(range[0].get<double>(), low, pixel);
    EXPECT_NEAR(range[1].get<double>(), high, pixel);
  }
  EXPECT_THAT(found["light"].get<std::string>(), HasSubstr("rgb(255, 255, 255)"));
  EXPECT_NE(found["dark"], found["light"]);
  EXPECT_EQ(found["printed"], found["light"]);
  ASSERT_EQ(found["maps"].size(), 3u) << "of correlation, and the two of the diagnosis";
  for (const json& colours : found["maps"]) EXPECT_GE(colours, 5) << "a map of fewer colours than values: the smallest has four and an empty cell";
  EXPECT_EQ(found["shown_maps"], 3);
  EXPECT_EQ(found["mismatches"], 1);
  EXPECT_EQ(found["equations"], json({"F\u2009=\u2009\u2212c\u2009v\u2009|v|"}));
  EXPECT_GT(found["sections"], 5);
  EXPECT_EQ(found["links"], found["sections"]);
  for (const json& middle : found["log_axes"]) EXPECT_NEAR(middle.get<double>(), 0.5, 1e-9);
}

/// Behind the page's own script: what every figure saves.
constexpr const char* save_figures = R"(<script>
window.addEventListener('load', async () => {
  const found = [];
  for (const [name, figure] of Object.entries(unrigReport.figures)) {
    const one = {name, lines: figure.csv().trim().split('\n').length, buttons: figure.bar.querySelectorAll('button').length};
    if (figure.svg) {
      const svg = figure.svg(), canvas = await unrigDrawing.painted(svg), text = unrigDrawing.text_of(svg);
      const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
      const colours = new Set();
      for (let i = 0; i < pixels.length; i += 4) colours.add((pixels[i] << 16) + (pixels[i + 1] << 8) + pixels[i + 2]);
      const parsed = new DOMParser().parseFromString(text, 'image/svg+xml');
      Object.assign(one, {colours: colours.size, corner: [...pixels.slice(0, 4)], sound: !parsed.querySelector('parsererror'), curves: parsed.querySelectorAll('polyline, circle, image, .bar').length, broken: /NaN|Infinity|undefined/.test(text)});
    }
    found.push(one);
  }
  document.body.textContent = 'FOUND' + JSON.stringify({complaints, figures: found}) + 'END';
});
</script></body>)";

TEST(ReportInABrowser, EveryFigureIsSavedAsPictureAndAsTable) {
  const std::string browser = chromium();
  if (browser.empty()) GTEST_SKIP() << "no Chromium on this machine; sample_data/setup.sh --optional installs it";
  const TemporaryDirectory directory;
  const json trial = {{"unrig", "trial"}, {"seed", 7}, {"noise", {{"gauge", 0.03}, {"unit", "N"}}}, {"recordings", json::array()}, {"nulls", 4}, {"false_alarms", 1}, {"wrong_names", 0}, {"misses", 0}, {"confusion", {{"nothing", {{"nothing", 4}}}}},
                      {"effects", {{{"effect", "tank-wave"}, {"hidden", 3}, {"found", 1}, {"equivalent", 0}, {"smallest_found", 4.5}, {"found_nine_in_ten_from", nullptr}}}}, {"trials", json::array()}};
  const std::string report = directory.path("report.html"), dom = directory.path("dom.html"), log = directory.path("log.txt");
  ASSERT_EQ(test::run_unrig(directory, {"report", directory.file("diagnosis.json", test::made_up_diagnosis().dump()), directory.file("trial.json", trial.dump()), "-o", report}).status, 0);
  const std::string page = replaced(read_text(report), "<meta charset=\"utf-8\">", std::string("<meta charset=\"utf-8\">") + listen);
  ASSERT_EQ(browse(browser, directory, directory.file("probed.html", replaced(page, "</body>", save_figures)), "--window-size=1200,900 --virtual-time-budget=60000 --dump-dom", dom, log), 0) << read_text(log);
  const std::string text = read_text(dom);
  const std::size_t first = text.find("FOUND{"), last = text.rfind("}END");
  ASSERT_TRUE(first != std::string::npos && last != std::string::npos) << text.substr(0, 2000) << read_text(log);
  const json found = json::parse(text.substr(first + 5, last - first - 4));
  EXPECT_EQ(found["complaints"], json::array());
  std::size_t pictures = 0;
  for (const json& figure : found["figures"]) {
    EXPECT_GE(figure["lines"], 2) << figure;
    EXPECT_GE(figure["buttons"], figure.contains("sound") ? 3 : 1) << figure;
    if (!figure.contains("sound")) continue;
    ++pictures;
    EXPECT_EQ(figure["sound"], true) << figure;
    EXPECT_EQ(figure["broken"], false) << figure;
    EXPECT_GE(figure["curves"], 1) << figure;
    EXPECT_GT(figure["colours"], 5) << figure;
    EXPECT_EQ(figure["corner"], json({255, 255, 255, 255})) << "on white paper: " << figure;
  }
  EXPECT_EQ(pictures, 4u + 2u + 1u) << "plots, maps, bars";
}

/// Behind the page's own script: what became of the labels of the axes.
constexpr const char* look_at_labels = R"(<script>
window.addEventListener('load', () => {
  const labels = [...document.querySelectorAll('.dygraph-ylabel, .dygraph-xlabel')];
  document.body.textContent = 'FOUND' + JSON.stringify({images: labels.filter((label) => label.querySelector('img')).length, texts: labels.map((label) => label.textContent)}) + 'END';
});
</script></body>)";

/// A unit of a result file such as "N<img src=x onerror=...>" ran as a script, through the label of its axis.
TEST(ReportInABrowser, NamesAndUnitsAreTextAndNoMarkup) {
  const std::string browser = chromium();
  if (browser.empty()) GTEST_SKIP() << "no Chromium on this machine; sample_data/setup.sh --optional installs it";
  const TemporaryDirectory directory;
  const std::string diagnosis = directory.file("diagnosis.json", test::made_up_diagnosis().dump()), report = directory.path("report.html");
  ASSERT_EQ(test::run_unrig(directory, {"report", diagnosis, "-o", report}).status, 0);
  std::string page = read_text(report);
  const std::string markup = "\\u003cimg src=x onerror=document.title='ran'>";  // as the page writes "<" within its data
  int labels = 0;
  for (const std::string key : {"\"x_label\":\"", "\"y_label\":\""})
    for (std::size_t at = page.find(key); at != std::string::npos; at = page.find(key, at + 1), ++labels) page.insert(at + key.size(), markup);
  ASSERT_GT(labels, 1);
  const std::string probed = directory.file("probed.html", replaced(page, "</body>", look_at_labels)), dom = directory.path("dom.html"), log = directory.path("log.txt");
  ASSERT_EQ(browse(browser, directory, probed, "--window-size=1200,900 --dump-dom", dom, log), 0) << read_text(log);
  const std::string text = read_text(dom);
  const std::size_t first = text.find("FOUND{"), last = text.rfind("}END");
  ASSERT_TRUE(first != std::string::npos && last != std::string::npos) << text.substr(0, 2000) << read_text(log);
  const std::string found = text.substr(first + 5, last - first - 4);
  EXPECT_THAT(found, HasSubstr("\"images\":0")) << found;
  EXPECT_THAT(found, HasSubstr("img src=x")) << "it is shown as it stands";
}

/// Behind the page's own script: what stands on the paper, plot by plot, and what stands in the window again after it.
constexpr const char* look_at_paper = R"(<script>
for (const moment of ['beforeprint', 'afterprint']) window.addEventListener(moment, () => {
  const plots = Object.values(unrigReport.graphs).map((graph) => {
    const sheet = graph.graphDiv.querySelector('.sheet'), drawn = sheet || graph.hidden_, tenth = Math.floor(drawn.width / 10);
    const pixels = drawn.getContext('2d').getImageData(drawn.width - tenth, 0, tenth, drawn.height).data;
    let ink = 0;
    for (let i = 3; i < pixels.length; i += 4) if (pixels[i] > 0) ++ink;
    return {sheet: !!sheet, dots: drawn.width, box: graph.maindiv_.clientWidth, canvas: graph.hidden_.clientWidth, end_of_axis: graph.toDomXCoord(graph.xAxisRange()[1]), ink};
  });
  console.log('FOUND' + JSON.stringify({moment, plots}) + 'END');
});
</script></body>)";

TEST(ReportInABrowser, PrintsWholePlotsFromAWideWindow) {
  const std::string browser = chromium();
  if (browser.empty()) GTEST_SKIP() << "no Chromium on this machine; sample_data/setup.sh --optional installs it";
  const TemporaryDirectory directory;
  const std::string report = directory.path("report.html"), pdf = directory.path("report.pdf"), log = directory.path("log.txt");
  ASSERT_EQ(test::run_unrig(directory, {"report", directory.file("diagnosis.json", test::made_up_diagnosis().dump()), "-o", report}).status, 0);
  const std::string probed = directory.file("probed.html", replaced(read_text(report), "</body>", look_at_paper));
  ASSERT_EQ(browse(browser, directory, probed, "--window-size=1920,1080 --print-to-pdf=" + pdf, directory.path("out.txt"), log), 0) << read_text(log);
  std::vector<json> moments;
  const std::string said = read_text(log);
  for (std::size_t at = said.find("FOUND{"); at != std::string::npos; at = said.find("FOUND{", at + 1)) moments.push_back(json::parse(said.substr(at + 5, said.find("}END", at) - at - 4)));
  ASSERT_EQ(moments.size(), 2u) << said;
  constexpr double narrowest_paper = (210 - 2 * 10) / 25.4 * 96;  // A4 with margins of 1 cm, in CSS pixels
  ASSERT_EQ(moments[0]["moment"], "beforeprint");
  ASSERT_EQ(moments[0]["plots"].size(), 4u);
  for (const json& plot : moments[0]["plots"]) {
    EXPECT_EQ(plot["sheet"], true);
    EXPECT_EQ(plot["canvas"], plot["box"]) << plot;
    EXPECT_EQ(plot["dots"].get<double>(), 2 * plot["box"].get<double>()) << plot;
    EXPECT_LE(plot["box"].get<double>(), narrowest_paper) << plot;
    EXPECT_LE(plot["end_of_axis"].get<double>(), plot["box"].get<double>()) << plot;
    EXPECT_GT(plot["ink"], 100) << "nothing at the end of the axis: " << plot;
  }
  EXPECT_EQ(moments[1]["moment"], "afterprint");
  for (const json& plot : moments[1]["plots"]) {
    EXPECT_EQ(plot["sheet"], false);
    EXPECT_GT(plot["canvas"].get<double>(), 1000) << plot;
    EXPECT_EQ(plot["canvas"], plot["box"]) << plot;
  }
  // In the file itself they stand as pictures; what Chromium loses is not there.
  const std::string file = read_text(pdf), picture = "/Width " + std::to_string(moments[0]["plots"][0]["dots"].get<int>());
  std::size_t pictures = 0;
  for (std::size_t at = file.find(picture); at != std::string::npos; at = file.find(picture, at + 1)) ++pictures;
  EXPECT_GE(pictures, 4u);
}

}  // namespace
}  // namespace unrig
