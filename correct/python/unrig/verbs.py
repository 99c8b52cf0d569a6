"""The commands of the program as functions."""
from __future__ import annotations

import os
from typing import Callable, Iterable, Mapping, Optional, Sequence, Union

import numpy as np

from . import _unrig
from ._unrig import Rig, Run
from .inputs import Path, as_rig, as_run
from .results import ApparentMassResult, Checked, Diagnosis, FitResult, TrialResult

Progress = Optional[Callable[[str], None]]
SOURCES = ["gauge", "angle", "calibration", "rig", "regularisation"]


def fit(rig: Union[Path, Rig], runs: Iterable[Union[Path, Run]], effects: Sequence[str] = (), laws: Sequence[Path] = (), *, start: Mapping[str, float] = {}, profile: Sequence[str] = (),
        anyway: bool = False, progress: Progress = None) -> FitResult:
    """Stiffness, damping, apparent mass and lift slope from all runs together, as `unrig fit`.

    effects: ids of physics beyond the rig model that is at work. laws: files with laws of your own. start: start values in SI by parameter name.
    profile: parameters to give profile-likelihood intervals of, or ["all"]. progress: called with what is being done.
    anyway: go on although the check finds that the input cannot be right; without it that raises NoAnswer.
    """
    return FitResult(_unrig.fit(as_rig(rig), [as_run(run) for run in runs], list(effects), [str(law) for law in laws], dict(start), list(profile), anyway, progress))


def text_of_fit(result: Union[Path, FitResult]) -> tuple[str, str]:
    """A fit as JSON text, and what messages call it."""
    if isinstance(result, FitResult):
        return result.json, "fit"
    name = os.fspath(result)
    with open(name, encoding="utf-8") as file:
        return file.read(), name


def simulate(rig: Union[Path, Rig], run: Union[Path, Run], *, result: Union[Path, FitResult, None] = None, settings: Mapping[str, float] = {}, release_load: Optional[float] = None, jumps: bool = False,
             as_recorded: bool = False, beyond: bool = False, progress: Progress = None) -> Run:
    """What gauge and sensors read in a motion, as `unrig simulate`: a run with its columns in SI.

    result: a fit, or the path of its fit.json. settings: values of model parameters in SI, by name.
    release_load: load at the calibration element that a pluck is released from [N].
    jumps: the angle jumps between samples. as_recorded: the angle with its noise.
    beyond: go on where a law is taken beyond the range that it was learnt on; without it that raises NoAnswer.
    """
    text, name = ("", "") if result is None else text_of_fit(result)
    load = "" if release_load is None else f"{float(release_load)!r} N"
    return _unrig.simulate(as_rig(rig), as_run(run), text, name, [f"{key}={float(value)!r}" for key, value in settings.items()], load, jumps, as_recorded, beyond, progress)


def correct(rig: Union[Path, Rig], result: Union[Path, FitResult], run: Union[Path, Run], *, calibration_error: float = 0.0, monotone: bool = False, at_step: Optional[float] = None, anyway: bool = False,
            beyond: bool = False, progress: Progress = None):
    """The load of a rigid rig out of a gauge record, as `unrig correct`: an xarray.Dataset.

    result: a fit, or the path of its fit.json. calibration_error: relative standard deviation of the gauge's calibration.
    monotone, at_step: impose a response that never falls, and its value at the step. beyond: as of `simulate`.
    Variables over `time` [s]: gauge, normal_force, circulatory [N] with `_std`, cn; over `semichords`: indicial and indicial_std.
    """
    import xarray
    rig, run = as_rig(rig), as_run(run)
    text, name = text_of_fit(result)
    r = _unrig.correct(rig, text, name, run, calibration_error, monotone, at_step, anyway, beyond, progress)
    time = r["start"] + r["dt"] * np.arange(len(r["gauge"]))
    attrs = {"rig": rig.file, "run": run.file, "fit": name, "unrig_version": _unrig.__version__, "run_fingerprint": run.fingerprint, "no_answer": r["no_answer"], "warnings": "\n".join(r["warnings"]),
             "noise": r["noise"]}
    coords = {"time": ("time", time, {"units": "s"}), "source": ("source", SOURCES)}

    def over_time(values, unit, meaning):
        return ("time", values, {"units": unit, "long_name": meaning})

    def by_source(values, unit):
        full = np.zeros((len(time), len(SOURCES)))
        full[:, :values.shape[1]] = values
        return (("time", "source"), full, {"units": unit, "long_name": "parts of the standard deviation"})

    unit = r["unit"]
    variables = {"gauge": over_time(r["gauge"], unit, "reading as recorded")}
    if r["modal"]:
        variables |= {"normal_force": over_time(r["load"], unit, "load on a rigid rig"), "normal_force_std": over_time(r["std"], unit, "one standard deviation"),
                      "normal_force_by_source": by_source(r["by_source"], unit)}
        return xarray.Dataset(variables, coords, attrs)
    coords["semichords"] = ("semichords", r["indicial_semichords"], {"units": "1"})
    coords["travel"] = ("time", (time - r["onset"]) * r["semichords_per_second"], {"units": "1", "long_name": "semichords since the onset"})
    for name in ("normal_force", "circulatory"):
        load = r[name]
        variables |= {name: over_time(load["value"], "N", "load of a rigid rig" if name == "normal_force" else "its circulatory part"), name + "_std": over_time(load["std"], "N", "one standard deviation"),
                      name + "_by_source": by_source(load["by_source"], "N")}
    variables |= {
        "cn": over_time(r["circulatory"]["value"] / r["force_per_coefficient"], "1", "circulatory normal-force coefficient"),
        "cn_std": over_time(r["circulatory"]["std"] / r["force_per_coefficient"], "1", "one standard deviation"),
        "unexplained": over_time(r["unexplained"], "N", "reading minus the model's"),
        "indicial": ("semichords", r["indicial"], {"units": "1", "long_name": "normalised step response"}),
        "indicial_std": ("semichords", r["indicial_std"], {"units": "1", "long_name": "one standard deviation"}),
        "cn_per_radian": ("semichords", r["cn_per_radian"], {"units": "1/rad"}),
        "cn_per_radian_std": ("semichords", r["cn_per_radian_std"], {"units": "1/rad"}),
    }
    attrs |= {"slope": r["slope"], "slope_std": r["slope_std"], "reduced_chi2": r["reduced_chi2"], "onset": r["onset"]}
    return xarray.Dataset(variables, coords, attrs)


def diagnose(rig: Union[Path, Rig], runs: Iterable[Union[Path, Run]], *, heldout: Iterable[Union[Path, Run]] = (), effects: Sequence[str] = (), anyway: bool = False,
             work: float = 400, limit: float = 60, progress: Progress = None) -> Diagnosis:
    """Which known physical effect is missing from the model, as `unrig diagnose`. effects: the candidates; none: all that can act. anyway: as of `fit`. work, limit: 1e9 multiplications and seconds of processor
    time after which the search ends with what it has found."""
    return Diagnosis(*_unrig.diagnose(as_rig(rig), [as_run(run) for run in runs], [as_run(run) for run in heldout], list(effects), anyway, work, limit, progress))


def check(rig: Union[Path, Rig], runs: Iterable[Union[Path, Run]] = ()) -> Checked:
    """Are rig and runs plausible, and what can they determine, as `unrig check`. Suspicions are warnings too."""
    return Checked(*_unrig.check(as_rig(rig), [as_run(run) for run in runs]))


def apparent_mass(rig: Union[Path, Rig], dry: Union[Path, Run], wet: Union[Path, Run], *, progress: Progress = None) -> ApparentMassResult:
    """Apparent mass from the frequencies of a decay in air and one in still water, as `unrig apparent-mass`."""
    return ApparentMassResult(*_unrig.apparent_mass(as_rig(rig), as_run(dry), as_run(wet), progress))


def trial(rig: Union[Path, Rig], recordings: Iterable[Union[Path, Run]] = (), *, effects: Sequence[str] = (), trials: int = 20, seed: int = 1, pairs: bool = False, noise: Optional[float] = None,
          ideal: bool = False, progress: Progress = None) -> TrialResult:
    """How often `diagnose` finds what was hidden in simulated campaigns, as `unrig trial`. noise: of the gauge [N]. ideal: white noise, exact files, steady signals."""
    return TrialResult(*_unrig.trial(as_rig(rig), [as_run(run) for run in recordings], list(effects), trials, seed, pairs, noise, ideal, progress))
