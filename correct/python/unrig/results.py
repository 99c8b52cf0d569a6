"""Results: what the program writes as JSON, as objects."""
from __future__ import annotations

import html
import json
import math
import os
from dataclasses import dataclass
from typing import Any, Optional


@dataclass(frozen=True)
class Parameter:
    """A fitted parameter, in SI units."""
    name: str
    value: float
    stderr: float  #: one standard deviation; nan where it could not be had
    unit: str
    run: str = ""  #: file of the run it belongs to; empty where all share it
    init_value: float = math.nan
    identified: bool = True
    advice: str = ""  #: where it is not identified: why, and what to record


class Parameters(dict):
    """Parameters by name; one of a run also as `name (file)`, and by its bare name where only one run has it."""

    def __missing__(self, key: str) -> Parameter:
        same = [p for p in self.values() if p.name == key]
        if len(same) == 1:
            return same[0]
        if same:
            raise KeyError(f"{key!r} stands once per run: " + ", ".join(label(p) for p in same))
        raise KeyError(f"{key!r} is none of: " + ", ".join(self))

    def valuesdict(self) -> dict[str, float]:
        return {name: p.value for name, p in self.items()}

    def to_dataframe(self):
        import pandas
        return pandas.DataFrame([vars(p) for p in self.values()], index=list(self))


def label(p: Parameter) -> str:
    return f"{p.name} ({os.path.basename(p.run)})" if p.run else p.name


def number(x: Any) -> float:
    return math.nan if x is None else float(x)


def dataset_of(data: dict[str, Any], text: str):
    import xarray
    variables: dict[str, Any] = {"json": ((), as_column([text]).reshape(()))}  # an attribute of HDF5 ends at 64 kB
    attributes: dict[str, Any] = {}
    for name, value in flat(data).items():
        if isinstance(value, str):
            attributes[name] = value
        elif not isinstance(value, list):
            variables[name] = ((), as_column([value]).reshape(()))
        elif value and all(isinstance(row, dict) for row in value):
            variables |= columns_of(name, value)
        elif value and not any(isinstance(cell, (list, dict)) for cell in value):
            variables[name] = (name, as_column(value))
    return xarray.Dataset(variables, attrs=attributes)


def columns_of(name: str, objects: list[dict[str, Any]]) -> dict[str, Any]:
    """What each of them has of numbers and words, along `name`."""
    rows = [flat(row) for row in objects]
    columns = {column: [row.get(column) for row in rows] for column in dict.fromkeys(key for row in rows for key in row)}
    return {f"{name}.{column}": (name, as_column(cells)) for column, cells in columns.items() if not any(isinstance(cell, list) for cell in cells)}


def flat(data: dict[str, Any]) -> dict[str, Any]:
    """With the members of objects beside their own: {"rate": {"value": 2}} as {"rate.value": 2}."""
    members: dict[str, Any] = {}
    for key, value in data.items():
        members |= {f"{key}.{inner}": cell for inner, cell in flat(value).items()} if isinstance(value, dict) else {key: value}
    return members


def as_column(cells: list[Any]):
    """Numbers (nan where there is none, 0 and 1 for truth values), or words (empty where there is none)."""
    import numpy
    if any(isinstance(cell, str) for cell in cells):
        return numpy.array(["" if cell is None else str(cell) for cell in cells], dtype=object)
    if all(isinstance(cell, int) for cell in cells):
        return numpy.array(cells, dtype=numpy.int64)
    return numpy.array([number(cell) for cell in cells])


class Result:
    """What a command found. `json` is what the program writes to its file, byte by byte; `data` the same as dictionaries."""

    def __init__(self, text: str, report: str):
        self.json = text
        self.data: dict[str, Any] = json.loads(text)
        self._report = report

    def report(self) -> str:
        """What the program prints."""
        return self._report

    def save(self, path) -> None:
        """Writes what the command writes with -o."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.json)

    @property
    def warnings(self) -> list[str]:
        return self.data.get("warnings", [])

    def to_dataset(self):
        """The result as an xarray.Dataset: its lists of objects as dimensions, their numbers and words as columns, single numbers as variables without dimension.

        Names follow `data`: `fit.runs.noise` over `fit.runs` is data["fit"]["runs"][...]["noise"]. What fits no table is in the variable `json` alone, which is the whole result as text.
        """
        return dataset_of(self.data, self.json)

    def to_netcdf(self, path) -> None:
        """Writes `to_dataset()` as a NetCDF file (with python3-netcdf4 of version 4, which is HDF5)."""
        self.to_dataset().to_netcdf(path)

    def __repr__(self) -> str:
        return self.report()

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.report())}</pre>"


class FitResult(Result):
    """A fit, in the shape that users of lmfit know."""

    def __init__(self, compiled):
        super().__init__(compiled.json, compiled.report(0.1))
        self._compiled = compiled
        parameters = [Parameter(p["name"], number(p["value"]), number(p["std_error"]), p["unit"], p.get("run", ""), number(p["start"]), p["identified"], p.get("advice", "")) for p in self.data["parameters"]]
        self.params = Parameters({label(p): p for p in parameters})

    implausible = property(lambda self: self._compiled.implausible, doc="Parameters that no rig and no fluid has, in words; empty with `anyway`.")
    success = property(lambda self: bool(self.data["converged"]) and not self.no_answer and not self.implausible, doc="The search converged, and its answer is to be trusted.")
    no_answer = property(lambda self: self.data.get("no_answer", ""), doc="Why the numbers are not to be trusted; empty: they are.")
    message = property(lambda self: self.data["message"])
    chisqr = property(lambda self: number(self.data["chi2"]))
    redchi = property(lambda self: number(self.data["reduced_chi2"]))
    aic = property(lambda self: number(self.data["aic"]))
    bic = property(lambda self: number(self.data["bic"]))
    ndata = property(lambda self: self.data["observations"])
    nvarys = property(lambda self: self.data["variables"])
    var_names = property(lambda self: list(self.params))

    @property
    def correlation(self):
        import numpy
        return numpy.array(self.data["correlation"], dtype=float)

    @property
    def covar(self):
        """Covariance of `params`, in their order."""
        import numpy
        std = numpy.array([p.stderr for p in self.params.values()])
        return self.correlation * numpy.outer(std, std)

    def fit_report(self, min_correl: float = 0.1) -> str:
        """What `unrig fit` prints; correlations of at least `min_correl`."""
        return self._compiled.report(min_correl)

    report = fit_report

    def _repr_html_(self) -> str:
        def row(p: Parameter) -> str:
            error = "not determined" if not p.identified else f"{p.stderr:.3g}"
            return "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in (label(p), f"{p.value:.7g}", error, p.unit, f"{p.init_value:.4g}")) + "</tr>"
        head = "".join(f"<th>{cell}</th>" for cell in ("parameter", "value", "standard error", "unit", "start"))
        trouble = f"<p><b>No trustworthy answer:</b> {html.escape(self.no_answer)}</p>" if self.no_answer else ""
        return f"{trouble}<p>reduced chi-square {self.redchi:.5g}</p><table><tr>{head}</tr>{''.join(row(p) for p in self.params.values())}</table>"

    def to_dataset(self):
        """The parameters as an xarray.Dataset over `parameter`, in SI; covariance over `parameter` and `parameter_2`."""
        import xarray
        parameters = list(self.params.values())
        along = {name: ("parameter", [getattr(p, name) for p in parameters]) for name in ("value", "stderr", "unit", "init_value")}
        along["identified"] = ("parameter", [int(p.identified) for p in parameters])
        along["covariance"] = (("parameter", "parameter_2"), self.covar)
        names = list(self.params)
        along["json"] = ((), as_column([self.json]).reshape(()))
        return xarray.Dataset(along, {"parameter": names, "parameter_2": names}, {"reduced_chi2": self.redchi, "bic": self.bic, "no_answer": self.no_answer})

    def plot(self, ax=None):
        """Residual over noise of each run's channels; needs matplotlib. Returns the axes."""
        import matplotlib.pyplot as plt
        if ax is None:
            ax = plt.subplots()[1]
        names = [f"{os.path.basename(run['file'])}: {c['name']}" for run in self.data["runs"] for c in run["channels"]]
        ratios = [number(c["rms_residual"]) / number(c["noise"]) for run in self.data["runs"] for c in run["channels"]]
        ax.barh(names, ratios)
        ax.axvline(1, color="black", linewidth=1)
        ax.set_xlabel("r.m.s. residual / noise")
        ax.invert_yaxis()
        return ax


class Diagnosis(Result):
    """What is missing from the model."""
    missing = property(lambda self: [m["effect"] for m in self.data["missing"]], doc="Ids of the effects that were named.")
    unexplained = property(lambda self: bool(self.data["unexplained"]))
    equivalent = property(lambda self: self.data["equivalent"])


class Checked(Result):
    """What `check` found."""
    suspicions = property(lambda self: self.data["suspicions"], doc="What cannot be right, or was left out.")
    trustworthy = property(lambda self: not any(s["grave"] for s in self.suspicions), doc="No suspicion is grave.")


class ApparentMassResult(Result):
    """Apparent mass from the frequencies of a dry and a wet decay."""

    @property
    def coefficient(self) -> Optional[Parameter]:
        c = self.data.get("apparent_mass_coefficient")
        return Parameter("apparent_mass_coefficient", number(c["value"]), number(c["std_error"]), "1") if c else None

    @property
    def mass(self) -> Parameter:
        m = self.data["apparent_mass"]
        return Parameter("apparent_mass", number(m["value"]), number(m["std_error"]), m["unit"])


class TrialResult(Result):
    """How often `diagnose` found what was hidden."""

    def to_dataframe(self):
        import pandas
        return pandas.DataFrame(self.data["trials"])
