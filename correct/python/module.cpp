// The library for Python: runs from arrays and files, and the verbs with their results as JSON text, tables or arrays. correct/python/unrig/ makes objects of them.
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "core/check/gate.h"
#include "core/files/error.h"
#include "core/files/command.h"
#include "core/files/heard_warnings.h"
#include "core/rig/given_files.h"
#include "core/rig/fingerprint.h"
#include "core/numerics/in_parallel.h"
#include "core/rig/rig.h"
#include "core/run/release.h"
#include "core/run/run.h"
#include "core/files/units.h"
#include "correct/correct.h"
#include "correct/correct_gate.h"
#include "correct/corrected_files.h"
#include "correct/modal/modal_load.h"
#include "fit/apparent_mass/apparent_mass.h"
#include "fit/apparent_mass/apparent_mass_files.h"
#include "fit/check/check.h"
#include "fit/check/implausible_parameters.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/diagnosis_files.h"
#include "fit/simulate/simulate_problem.h"
#include "fit/trial/trial_files.h"
#include "fit/effect_option.h"
#include "fit/fit.h"
#include "fit/fit_files.h"
#include "fit/fit_report.h"
#include "fit/fit_json.h"

namespace py = pybind11;

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// What the program says on standard error becomes a Python warning each.
void warn_in_python(const std::vector<std::string>& lines) {
  for (const std::string& line : lines)
    if (PyErr_WarnEx(PyExc_UserWarning, line.c_str(), 2) != 0) throw py::error_already_set();
}

/// How many threads are at work. Python ends only after them: what they use is gone then.
class AtWork {
 public:
  void begins() { change(+1); }
  void ends() { change(-1); }
  bool none_after(std::chrono::milliseconds wait) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, wait, [&] { return threads_ == 0; });
  }

 private:
  void change(int by) {
    const std::lock_guard lock(mutex_);
    threads_ += by;
    changed_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  int threads_ = 0;
};

AtWork& at_work() {
  static AtWork* const one = new AtWork;  // outlives every thread
  return *one;
}

constexpr std::chrono::milliseconds moment{100};

/// A second interrupt ends Python all the same.
void wait_for_threads() {
  const py::gil_scoped_release unlocked;
  while (!at_work().none_after(moment)) {
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

using Say = std::function<void(const std::string&)>;

/// Ends a search for which nobody waits any more. No std::exception, which a search could take for a failure of its own.
struct NobodyWaits {};

/// `work(say)` in a thread of its own, without Python's lock. This thread looks for an interrupt of the user's ten times a second, tells `progress` what the work says, and gives its warnings to Python,
/// also where it throws. With `what` it tells that first, and every second of the time that has gone: for work that says nothing.
/// After an interrupt the work ends when it next says something, or at its end, and nobody hears of it. What it uses must be its own.
template <class Work>
auto in_a_thread(Work work, const py::object& progress, const std::string& what = "") {
  using Result = decltype(work(Say()));
  struct Talk {
    std::optional<Result> result;
    std::vector<std::string> warnings;
    std::exception_ptr error;
    std::mutex mutex;
    std::vector<std::string> said;
    std::atomic<bool> nobody_waits = false;
  };
  const auto talk = std::make_shared<Talk>();
  std::packaged_task<void()> task([talk, work = std::move(work)]() mutable {
    const HeardWarnings heard;
    try {
      talk->result = work([&](const std::string& doing) {
        if (talk->nobody_waits) throw NobodyWaits();
        const std::lock_guard guard(talk->mutex);
        talk->said.push_back(doing);
      });
    } catch (...) {
      talk->error = std::current_exception();
    }
    talk->warnings = heard.lines();
  });
  std::future<void> done = task.get_future();
  const auto tell = [&](const std::string& doing) {
    if (!progress.is_none()) progress(doing);
  };
  const auto pass_on = [&] {
    std::vector<std::string> said;
    {
      const std::lock_guard guard(talk->mutex);
      said.swap(talk->said);
    }
    for (const std::string& doing : said) tell(doing);
  };
  if (!what.empty()) tell(what);
  try {
    const py::gil_scoped_release unlocked;
    at_work().begins();
    std::thread([](std::packaged_task<void()> own) {
      own();
      own = {};
      at_work().ends();
    }, std::move(task)).detach();
    for (int moments = 1; done.wait_for(moment) != std::future_status::ready; ++moments) {
      const py::gil_scoped_acquire lock;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      pass_on();
      if (!what.empty() && moments % 10 == 0) tell(what + " (" + std::to_string(moments / 10) + " s gone)");
    }
  } catch (...) {
    talk->nobody_waits = true;
    throw;
  }
  pass_on();
  warn_in_python(talk->warnings);
  if (talk->error) std::rethrow_exception(talk->error);
  return std::move(*talk->result);
}

/// Times of a record that is sampled evenly.
void take_times(const Eigen::Ref<const VectorXd>& time, Run& run) {
  const Index n = time.size();
  if (n < 3) throw InputError({run.file, 0}, std::to_string(n) + " samples", "wanted three at least", "");
  run.start = time[0];
  run.dt = (time[n - 1] - time[0]) / static_cast<double>(n - 1);
  constexpr double rounding = 1e-3;  // steps, as of run files (core/run/time_grid.h)
  for (Index k = 0; k < n; ++k)
    if (!(std::abs(time[k] - run.start - run.dt * static_cast<double>(k)) <= rounding * run.dt))
      throw InputError({run.file, 0}, "sample " + std::to_string(k) + " is at " + std::to_string(time[k]) + " s", "wanted increasing times with one step", "Interpolate to a uniform grid, or write a run file.");
}

/// A run whose columns are arrays: {name: (values, unit)}, each read in place and kept in SI.
Run run_of_arrays(const std::string& name, const std::string& kind, const Eigen::Ref<const VectorXd>& time, const std::map<std::string, std::pair<Eigen::Ref<const VectorXd>, std::string>>& columns, double density,
                  double speed, const std::string& medium) {
  Run run;
  run.file = run.name = name;
  run.medium = medium;
  run.density = density;
  run.speed = speed;
  const std::array kinds{RunKind::step, RunKind::pluck, RunKind::forced, RunKind::moved};
  const auto found = std::find_if(kinds.begin(), kinds.end(), [&](RunKind one) { return to_string(one) == kind; });
  if (found == kinds.end()) throw InputError({name, 0}, "kind \"" + kind + "\"", "wanted step, pluck, forced or moved", "");
  run.kind = *found;
  if (!(density >= 0) || !(speed >= 0) || !std::isfinite(density) || !std::isfinite(speed)) throw InputError({name, 0}, "a density or speed below zero", "wanted kg/m^3 and m/s", "");
  take_times(time, run);
  for (const auto& [column, reading] : columns) {
    const auto& [values, unit] = reading;
    if (values.size() != time.size()) throw InputError({name, 0}, "\"" + column + "\" has " + std::to_string(values.size()) + " samples", "wanted as many as times, " + std::to_string(time.size()), "");
    const InputError::Place place{name, 0};
    const std::string si = si_unit(unit, place, column);
    const UnitScale scale = unit_scale(unit, si, place, column);
    Channel channel{column, unit, si, scale.factor, (values.array() * scale.factor + scale.offset).matrix(), 0, 0, 0};
    channel.missing = static_cast<std::size_t>((!channel.value.array().isFinite()).count());
    channel.value = channel.value.array().isFinite().select(channel.value, std::nan(""));
    run.channels.push_back(std::move(channel));
  }
  begin_at_release(run);
  return run;
}

/// A fit, and the laws of its rig, which its file carries.
struct FitWithLaws : FitResult {
  std::vector<std::shared_ptr<const Effect>> laws;
  std::vector<std::string> implausible;  ///< parameters that no rig and no fluid has
};

FitWithLaws fit_of(const Rig& rig, const std::vector<Run>& runs, const std::vector<std::string>& effects, const std::vector<std::string>& laws, const StartValues& start, const std::vector<std::string>& profile, bool anyway, const py::object& progress) {
  FitProblem problem;
  problem.rig = rig;
  problem.runs = runs;
  problem.effects = effects_of_option("effects", effects);
  const std::vector<std::string> ids = add_laws(problem.rig, laws);
  problem.effects.insert(problem.effects.end(), ids.begin(), ids.end());
  problem.start = start;
  problem.profile = profile;
  return in_a_thread(
      [problem, anyway](const Say& say) mutable {
        problem.progress = say;
        check_recorded_once(problem.runs, problem.rig);
        pass_the_gate(problem.rig, problem.runs, anyway);
        FitWithLaws result{fit(problem), problem.rig.laws, {}};
        const std::vector<Suspicion> suspect = implausible_parameters(result);
        tell(suspect);
        if (!anyway)
          for (const Suspicion& s : suspect) result.implausible.push_back(s.text);
        return result;
      },
      progress);
}

py::dict load_of(const CorrectedLoad& load) {
  using namespace py::literals;
  return py::dict("value"_a = load.value, "std"_a = load.std, "by_source"_a = load.by_source, "half_weight"_a = load.half_weight, "twice_weight"_a = load.twice_weight, "simultaneous"_a = load.simultaneous);
}

py::dict correction(const Rig& rig, const std::string& fit_json, const std::string& fit_name, const Run& run, double calibration, bool monotone, std::optional<double> at_step, bool anyway, bool beyond, const py::object& progress) {
  using namespace py::literals;
  const CorrectProblem problem{rig, read_fit(nlohmann::json::parse(fit_json), fit_name), run, calibration, {monotone, at_step}, beyond};
  if (rig.is_modal()) {
    std::optional<ModalLoad> result = in_a_thread(
        [problem, anyway](const Say&) {
          pass_the_gate(problem, anyway);
          return modal_load(problem);
        },
        progress, "taking the rig out of " + run.file);
    return py::dict("modal"_a = true, "unit"_a = result->unit, "start"_a = result->start, "dt"_a = result->dt, "gauge"_a = result->gauge, "load"_a = result->load, "std"_a = result->std,
                    "by_source"_a = result->by_source, "warnings"_a = result->warnings, "no_answer"_a = "", "report"_a = report(*result), "noise"_a = result->noise);
  }
  std::optional<CorrectResult> result = in_a_thread(
      [problem, anyway](const Say&) {
        pass_the_gate(problem, anyway);
        return correct(problem);
      },
      progress, "taking the rig out of " + run.file);
  const IndicialResponse& i = result->indicial;
  return py::dict("modal"_a = false, "unit"_a = "N", "start"_a = result->start, "dt"_a = result->dt, "onset"_a = result->onset, "semichords_per_second"_a = result->semichords_per_second,
                  "force_per_coefficient"_a = result->force_per_coefficient, "gauge"_a = result->gauge, "unexplained"_a = result->unexplained, "normal_force"_a = load_of(result->normal_force),
                  "circulatory"_a = load_of(result->circulatory), "indicial_semichords"_a = i.semichords, "indicial"_a = i.value, "indicial_std"_a = i.uncertainty.std, "cn_per_radian"_a = i.per_radian,
                  "cn_per_radian_std"_a = i.per_radian_std, "slope"_a = result->slope, "slope_std"_a = result->slope_std, "reduced_chi2"_a = result->reduced_chi2, "noise"_a = result->noise,
                  "warnings"_a = result->warnings, "no_answer"_a = result->no_answer, "report"_a = report(*result));
}

}  // namespace
}  // namespace unrig

PYBIND11_MODULE(_unrig, m) {
  using namespace unrig;
  using namespace py::literals;
  m.doc() = "Compiled part of unrig; use the package.";
  m.attr("__version__") = UNRIG_VERSION;
  py::register_exception<InputError>(m, "InputError", PyExc_ValueError);
  py::register_exception<NoAnswer>(m, "NoAnswer", PyExc_RuntimeError);

  py::class_<Rig>(m, "Rig", "A structure, as in a rig file.")
      .def_readonly("file", &Rig::file)
      .def_readonly("name", &Rig::name)
      .def_readonly("chord", &Rig::chord, "m")
      .def_readonly("warnings", &Rig::warnings)
      .def_property_readonly("is_modal", &Rig::is_modal)
      .def("__repr__", [](const Rig& rig) { return "<unrig.Rig " + rig.name + " (" + rig.file + ")>"; });
  m.def("read_rig", &read_rig, "path"_a);

  py::class_<Run>(m, "Run", "One recording, its columns in SI on a uniform grid.")
      .def_readonly("file", &Run::file)
      .def_readonly("name", &Run::name)
      .def_readonly("medium", &Run::medium)
      .def_readonly("density", &Run::density, "kg/m^3")
      .def_readonly("speed", &Run::speed, "m/s")
      .def_readonly("start", &Run::start, "s")
      .def_readonly("dt", &Run::dt, "s")
      .def_readonly("warnings", &Run::warnings)
      .def_property_readonly("kind", [](const Run& run) { return to_string(run.kind); })
      .def_property_readonly("columns", [](const Run& run) {
        std::vector<std::string> names;
        for (const Channel& channel : run.channels) names.push_back(channel.name);
        return names;
      })
      .def_property_readonly("time", [](const Run& run) { return VectorXd(VectorXd::LinSpaced(run.samples(), run.start, run.time(run.samples() - 1))); }, "s")
      .def("unit", [](const Run& run, const std::string& column) { return run.channel(column).unit; }, "column"_a, "SI unit of a column.")
      .def("__getitem__", [](const Run& run, const std::string& column) -> const VectorXd& { return run.channel(column).value; }, py::return_value_policy::reference_internal,
           "Values of a column in SI: a view of the run's own memory.")
      .def("__len__", &Run::samples)
      .def_property_readonly("fingerprint", [](const Run& run) { return fingerprint(run); })
      .def("__repr__", [](const Run& run) { return "<unrig.Run " + to_string(run.kind) + " " + run.file + ", " + std::to_string(run.samples()) + " samples>"; });
  m.def("read_run", &read_run, "path"_a);
  m.def("run_of_arrays", &run_of_arrays, "name"_a, "kind"_a, "time"_a, "columns"_a, "density"_a, "speed"_a, "medium"_a);

  py::class_<FitWithLaws>(m, "Fit")
      .def_readonly("no_answer", &FitWithLaws::no_answer)
      .def_readonly("implausible", &FitWithLaws::implausible)
      .def_property_readonly("json", [](const FitWithLaws& r) { return to_json(r, r.laws); })
      .def("report", [](const FitWithLaws& r, double least) { return report(r, least); }, "least"_a = 0.1);
  m.def("fit", &fit_of, "rig"_a, "runs"_a, "effects"_a, "laws"_a, "start"_a, "profile"_a, "anyway"_a, "progress"_a);
  m.def("correct", &correction, "rig"_a, "fit_json"_a, "fit_name"_a, "run"_a, "calibration"_a, "monotone"_a, "at_step"_a, "anyway"_a, "beyond"_a, "progress"_a);

  m.def("apparent_mass", [](const Rig& rig, const Run& dry, const Run& wet, const py::object& progress) {
    ApparentMassProblem problem;
    problem.rig = rig, problem.dry = dry, problem.wet = wet;
    return in_a_thread(
        [problem](const Say& say) mutable {
          problem.progress = say;
          const ApparentMassResult result = apparent_mass(problem);
          return std::pair{to_json(result), report(result)};
        },
        progress);
  });
  m.def("diagnose", [](const Rig& rig, const std::vector<Run>& runs, const std::vector<Run>& heldout, const std::vector<std::string>& effects, bool anyway, double work, double limit, const py::object& progress) {
    DiagnoseProblem problem;
    problem.work = work, problem.limit = limit;
    problem.rig = rig, problem.runs = runs, problem.heldout = heldout;
    problem.effects = effects_of_option("effects", effects);
    return in_a_thread(
        [problem, anyway](const Say& say) mutable {
          problem.progress = say;
          std::vector<Run> all = problem.runs;
          all.insert(all.end(), problem.heldout.begin(), problem.heldout.end());
          check_recorded_once(all, problem.rig);
          refuse_idle("effects", problem.effects, problem.rig, problem.runs);
          pass_the_gate(problem.rig, all, anyway);
          const Diagnosis result = diagnose(problem);
          return std::pair{to_json(result), report(result)};
        },
        progress);
  });
  m.def("trial", [](const Rig& rig, const std::vector<Run>& recordings, const std::vector<std::string>& effects, int trials, unsigned seed, bool pairs, std::optional<double> noise, bool ideal, const py::object& progress) {
    TrialProblem problem;
    problem.rig = rig, problem.recordings = recordings, problem.trials = trials, problem.seed = seed, problem.pairs = pairs, problem.noise = noise, problem.ideal = ideal;
    problem.effects = effects_of_option("effects", effects);
    problem.rig.givens = nullptr;  // as the command
    for (Run& run : problem.recordings) run.givens = nullptr;
    return in_a_thread(
        [problem](const Say& say) mutable {
          problem.progress = say;
          check_recorded_once(problem.recordings, problem.rig);
          const TrialResult result = run_trials(problem);
          return std::pair{to_json(result, {}, false), report(result)};
        },
        progress);
  });
  m.def("check", [](const Rig& rig, const std::vector<Run>& runs) {
    return in_a_thread(
        [rig, runs](const Say&) {
          const Checked checked = check(rig, runs);
          tell(checked.suspicions);
          return std::pair{to_json(checked), report(checked)};
        },
        py::none());
  });
  m.def("simulate", [](const Rig& rig, const Run& run, const std::string& fit_json, const std::string& fit_name, const std::vector<std::string>& settings, const std::string& release_load, bool jumps, bool as_recorded, bool beyond, const py::object& progress) {
    SimulateOptions options;
    options.rig = rig.file, options.run = run.file, options.fit = fit_name;
    options.settings = settings, options.release_load = release_load, options.jumps = jumps, options.as_recorded = as_recorded, options.beyond = beyond;
    std::optional<FittedRig> fit;
    if (!fit_json.empty()) fit = read_fit(nlohmann::json::parse(fit_json), fit_name);
    return in_a_thread(
        [rig, run, fit, options](const Say&) {
          for (const std::vector<std::string>* known : {&rig.warnings, &run.warnings})
            for (const std::string& warning : *known) warn(warning);
          const SimulateResult result = simulate_within(simulate_problem(rig, run, fit, options, {}).problem, options);
          for (const std::string& warning : result.warnings) warn(warning);
          return result.run;
        },
        progress, "simulating " + run.file);
  });
  py::module_::import("atexit").attr("register")(py::cpp_function(wait_for_threads));
  m.def("use_threads", &use_threads, "threads"_a, "How many threads the library may work in.");
}
