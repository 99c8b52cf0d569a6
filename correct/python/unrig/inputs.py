"""Rigs and runs from files, arrays and data frames."""
from __future__ import annotations

import os
import re
from typing import Mapping, Sequence, Union

import numpy as np

from . import _unrig
from ._unrig import Rig, Run

Path = Union[str, "os.PathLike[str]"]


def read_rig(path: Path) -> Rig:
    """A rig file (TOML). Raises InputError with file, line, what was found and what was wanted."""
    return _unrig.read_rig(os.fspath(path))


def read_run(path: Path) -> Run:
    """A run file (CSV with a head of metadata). Raises InputError likewise."""
    return _unrig.read_run(os.fspath(path))


def run_from_arrays(time: Sequence[float], columns: Mapping[str, tuple[Sequence[float], str]], *, kind: str, density: float, speed: float = 0.0, medium: str = "", name: str = "run") -> Run:
    """A run from arrays.

    time: [s], increasing with one step.
    columns: name -> (values, unit), for example {"alpha": (angle, "deg"), "gauge": (reading, "N")}. Missing samples are nan.
    kind: "step", "pluck", "forced" or "moved". density: [kg/m^3]. speed: [m/s].
    name: what messages and results call it, as the file's name of a run that was read.
    """
    def plain(values):
        return np.ascontiguousarray(values, dtype=float)
    return _unrig.run_of_arrays(name, kind, plain(time), {column: (plain(values), unit) for column, (values, unit) in columns.items()}, density, speed, medium)


def run_from_dataframe(frame, *, kind: str, density: float, speed: float = 0.0, medium: str = "", name: str = "run") -> Run:
    """A run from a pandas.DataFrame whose columns are called `name [unit]`, as in a run file: "time [s]", "alpha [deg]", "gauge [N]"."""
    columns = {}
    for label in frame.columns:
        match = re.fullmatch(r"\s*(.*?)\s*\[(.*)\]\s*", str(label))
        if not match:
            raise _unrig.InputError(f'{name}: the column "{label}"; wanted `name [unit]`')
        columns[match[1]] = (frame[label].to_numpy(), match[2])
    if "time" not in columns:
        raise _unrig.InputError(f'{name}: no column "time [s]"; wanted the times of the samples')
    time, unit = columns.pop("time")
    factor = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}.get(unit)
    if factor is None:
        raise _unrig.InputError(f'{name}: times in "{unit}"; wanted s, ms, us or min')
    return run_from_arrays(factor * np.asarray(time, dtype=float), columns, kind=kind, density=density, speed=speed, medium=medium, name=name)


def dataset_of_run(run: Run):
    """A recording, or what `simulate` found, as an xarray.Dataset over `time` [s], in SI; `.to_netcdf(path)` of it writes a file."""
    import xarray
    attributes = {"kind": run.kind, "medium": run.medium, "density": run.density, "speed": run.speed, "run": run.file, "run_fingerprint": run.fingerprint, "unrig_version": _unrig.__version__}
    columns = {column: ("time", run[column], {"units": run.unit(column)}) for column in run.columns}
    return xarray.Dataset(columns, {"time": ("time", run.time, {"units": "s"})}, attributes)


Run.to_dataset = dataset_of_run


def as_rig(rig: Union[Path, Rig]) -> Rig:
    return rig if isinstance(rig, Rig) else read_rig(rig)


def as_run(run: Union[Path, Run]) -> Run:
    return run if isinstance(run, Run) else read_run(run)
