"""unrig: take the rig out of the reading.

The verbs of the program as functions of runs (files, arrays or data frames), with the same numbers::

    import unrig
    result = unrig.fit("rig.toml", ["dry_pluck.csv", "wet_pluck.csv", "step_a.csv"])
    result.params["normal.stiffness_scale"].value, result.params["normal.stiffness_scale"].stderr
    load = unrig.correct("rig.toml", result, "step_a.csv")      # an xarray.Dataset
    load.circulatory.plot()

Everything is in SI units and radians. What cannot be used raises `InputError` (a `ValueError`), a question without a trustworthy answer
`NoAnswer` (a `RuntimeError`), both with the program's own messages; a result that is not to be trusted says so in `no_answer`.
"""
from ._unrig import InputError, NoAnswer, Rig, Run, __version__, use_threads
from .inputs import read_rig, read_run, run_from_arrays, run_from_dataframe
from .results import ApparentMassResult, Checked, Diagnosis, FitResult, Parameter, TrialResult
from .verbs import apparent_mass, check, correct, diagnose, fit, simulate, trial

__all__ = ["ApparentMassResult", "Checked", "Diagnosis", "FitResult", "InputError", "NoAnswer", "Parameter", "Rig", "Run", "TrialResult", "__version__", "apparent_mass", "check", "correct", "diagnose", "fit",
           "read_rig", "read_run", "run_from_arrays", "run_from_dataframe", "simulate", "trial", "use_threads"]
