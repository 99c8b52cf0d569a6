"""The Python package against the program: python3 package_test.py UNRIG SAMPLE_CAMPAIGN, with the package on PYTHONPATH. Prints one line; fails by an assertion."""
import ast
import importlib.util
import json
import math
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import warnings

try:
    import numpy as np
    import xarray  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

import unrig

program, campaign = sys.argv[1], pathlib.Path(sys.argv[2])
rig = str(campaign / "rig.toml")
runs = [str(campaign / name) for name in ("dry_pluck.csv", "wet_pluck.csv", "step_a.csv")]

with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)

    def command(*words):
        return subprocess.run([program, *map(str, words)], check=True, capture_output=True, text=True).stdout

    # A fit: every number as in fit.json, to the last bit.
    report = command("fit", "--rig", rig, *runs, "-o", folder / "fit.json")
    written = json.loads((folder / "fit.json").read_text())
    told = []
    result = unrig.fit(rig, runs, progress=told.append)
    assert result.data["parameters"] == written["parameters"] and result.data["correlation"] == written["correlation"]
    assert result.fit_report().splitlines()[-1] == report.splitlines()[-1]
    assert told and result.success and result.no_answer == ""
    stiffness = result.params["normal.stiffness_scale"]
    truth = json.loads((campaign / "KEY.json").read_text())["truth"]["kn"] if (campaign / "KEY.json").exists() else 0.7887
    assert abs(stiffness.value - truth) < 0.001 and 0 < stiffness.stderr < 1e-4
    assert result.params["normal_force_slope"] is result.params["normal_force_slope (step_a.csv)"]
    assert np.allclose(np.sqrt(np.diag(result.covar)), [p.stderr for p in result.params.values()], equal_nan=True)
    assert "<table>" in result._repr_html_()
    try:
        result.params["no_such_parameter"]
        raise AssertionError("a parameter that is not there")
    except KeyError as error:
        assert "normal.stiffness_scale" in str(error)

    # A correction: the numbers of corrected.csv, of a fit handed over as an object and as a file.
    command("correct", "--rig", rig, "--fit", folder / "fit.json", runs[2], "-o", folder / "corrected.csv")
    lines = [line for line in (folder / "corrected.csv").read_text().splitlines() if not line.startswith("#")]
    header = [cell.split(" [")[0] for cell in lines[0].split(",")]
    rows = np.array([[float(cell) if cell else np.nan for cell in line.split(",")[:9]] for line in lines[1:]])
    load, same = unrig.correct(rig, result, runs[2]), unrig.correct(rig, str(folder / "fit.json"), runs[2])
    for name in ("circulatory", "circulatory_std", "normal_force", "normal_force_std"):
        printed = rows[:, header.index(name)]
        digits = 1e-3 if name.endswith("_std") else 1e-5  # as printed
        assert np.allclose(load[name], printed, rtol=digits, atol=1e-6), (name, float(np.max(np.abs(load[name] - printed))))
        assert np.array_equal(load[name], same[name]), name
    assert load.circulatory.attrs["units"] == "N" and load.attrs["run_fingerprint"] == unrig.read_run(runs[2]).fingerprint
    load.to_netcdf(folder / "load.nc") if hasattr(load, "to_netcdf") else None

    # A simulation: the numbers of the program's file as far as they are printed, with a fit and without.
    for options, given in (((), {}), (("--fit", folder / "fit.json", "--set", "normal.damping_ratio=0.01"), {"result": result, "settings": {"normal.damping_ratio": 0.01}})):
        command("simulate", "--rig", rig, "--run", runs[2], *options, "-o", folder / "simulated.csv")
        written, simulated = unrig.read_run(str(folder / "simulated.csv")), unrig.simulate(rig, runs[2], **given)
        assert len(simulated) == len(written)
        assert np.allclose(simulated["gauge"], written["gauge"], rtol=1e-6, atol=1e-6), float(np.max(np.abs(simulated["gauge"] - written["gauge"])))
    try:
        unrig.simulate(rig, runs[2], settings={"no_such_parameter": 1})
        raise AssertionError("a parameter that is not there")
    except unrig.InputError as error:
        assert "wanted one of" in str(error)

    # The gate: what the program says and refuses, in its words; `anyway` goes on with the program's numbers.
    pounds = folder / "pounds.csv"
    pounds.write_text((campaign / "step_b.csv").read_text().replace("gauge [N]", "gauge [lbf]"))
    suspect = [*runs, str(pounds)]
    refused = subprocess.run([program, "fit", "--rig", rig, *suspect, "-o", folder / "no.json"], capture_output=True, text=True)
    assert refused.returncode == 1
    for call in (lambda: unrig.fit(rig, suspect), lambda: unrig.diagnose(rig, suspect)):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                call()
                raise AssertionError("a gauge in the wrong unit")
            except unrig.NoAnswer as error:
                assert str(error) in refused.stderr and "anyway" in str(error), error
        checks = [str(w.message) for w in said if str(w.message).startswith("check: ")]
        assert checks and all(line in refused.stderr.splitlines() for line in checks), checks
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        checked, forced = unrig.check(rig, suspect), unrig.fit(rig, [runs[0], str(pounds)], anyway=True)
        subprocess.run([program, "check", "--rig", rig, *suspect, "-o", folder / "check.json", "--quiet"], check=False, capture_output=True)
        subprocess.run([program, "fit", "--rig", rig, runs[0], pounds, "--anyway", "-o", folder / "anyway.json", "--quiet"], check=False, capture_output=True)
    written = json.loads((folder / "check.json").read_text())
    assert not checked.trustworthy and {key: checked.data[key] for key in ("rig", "runs", "suspicions", "determined")} == {key: written[key] for key in ("rig", "runs", "suspicions", "determined")}
    assert forced.data["parameters"] == json.loads((folder / "anyway.json").read_text())["parameters"]
    assert unrig.check(rig, runs).trustworthy

    # Warnings of `simulate` and `correct` are Python's, progress is told, and an interrupt ends them.
    for call in (lambda tell: unrig.simulate(rig, runs[2], progress=tell), lambda tell: unrig.correct(rig, result, runs[2], progress=tell)):
        told = []
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            call(told.append)
        assert told and "step_a.csv" in told[0], told
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        unrig.simulate(rig, runs[2])
    assert any("the angle is a measurement" in str(w.message) for w in said), [str(w.message) for w in said]

    # Ctrl-C in the middle of a call ends it there: it does not come to say all that a whole call says.
    drag = [str(campaign.parent / "drag" / name) for name in ("rig.toml", "dry_pluck.csv", "wet_pluck.csv")]
    for name, call in (("trial", lambda tell: unrig.trial(rig, [runs[0]], trials=30, effects=["mains-hum"], progress=tell)), ("diagnose", lambda tell: unrig.diagnose(drag[0], drag[1:], effects=["quadratic-drag", "gauge-lowpass"], progress=tell)),
                       ("fit", lambda tell: unrig.fit(rig, runs, profile=["all"], progress=tell))):
        whole, told = [], []
        call(whole.append)
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        try:
            timer.start()
            call(told.append)
            raise AssertionError(f"{name}: an interrupt that was not obeyed")
        except KeyboardInterrupt:
            assert len(told) < len(whole), (name, told)
        finally:
            timer.cancel()

    # So does an exception of `progress`; and what was ended leaves the library as it was.
    class Enough(Exception):
        pass

    def enough(what):
        raise Enough
    try:
        unrig.diagnose(rig, runs, progress=enough)
        raise AssertionError("an exception that was lost")
    except Enough:
        pass
    assert unrig.fit(rig, runs).data["parameters"] == result.data["parameters"]

    # A diagnosis, an apparent mass and a trial: all that the program writes, to the last bit, but what no two calls have in common.
    def same(data, name):
        other = json.loads((folder / name).read_text())
        for one in (data, other):
            for made in (one, one.get("fit", {})):
                for key in ("command", "program"):
                    made.pop(key, None)
            for each in one.get("trials", []):
                each.pop("seconds", None)
        assert data == other, name
    command("diagnose", "--rig", rig, *runs, "--effects", "mains-hum,quadratic-drag", "-o", folder / "diagnosis.json")
    command("apparent-mass", "--rig", rig, "--dry", runs[0], "--wet", runs[1], "-o", folder / "apparent.json")
    command("trial", "--rig", rig, runs[0], "--effects", "mains-hum", "--trials", 6, "--seed", 3, "-o", folder / "trial.json")
    diagnosis = unrig.diagnose(rig, runs, effects=["mains-hum", "quadratic-drag"])
    apparent = unrig.apparent_mass(rig, runs[0], runs[1])
    tried = unrig.trial(rig, [runs[0]], effects=["mains-hum"], trials=6, seed=3)
    for found, name in ((diagnosis, "diagnosis.json"), (apparent, "apparent.json"), (tried, "trial.json")):
        same(json.loads(found.json), name)

    # Every result as a data set, whole, and from a file with the same numbers.
    table = result.to_dataset()
    assert list(table.parameter.values) == list(result.params) and float(table.value.sel(parameter="normal.stiffness_scale")) == stiffness.value
    simulated = unrig.simulate(rig, runs[2]).to_dataset()
    assert simulated.gauge.attrs["units"] == "N" and simulated.sizes["time"] == 3000
    assert diagnosis.to_dataset()["fit.parameters.value"].values[0] == diagnosis.data["fit"]["parameters"][0]["value"]
    assert apparent.to_dataset()["dry.frequency"] == apparent.data["dry"]["frequency"]
    assert list(tried.to_dataset()["trials.size"].values) == [t["size"] for t in tried.data["trials"]]
    assert list(checked.to_dataset()["suspicions.factor"].values) == [s.get("factor", math.nan) for s in checked.suspicions]
    tables = {"fit": table, "load": load, "simulated": simulated, "diagnosis": diagnosis.to_dataset(), "apparent": apparent.to_dataset(), "trial": tried.to_dataset(), "check": checked.to_dataset()}
    if importlib.util.find_spec("netCDF4"):
        for name, dataset in tables.items():
            dataset.to_netcdf(folder / f"{name}.nc")
            with xarray.open_dataset(folder / f"{name}.nc") as back:
                assert set(back.variables) == set(dataset.variables), name
                for variable in dataset.variables:
                    ours, theirs = dataset[variable].values, back[variable].values
                    assert np.array_equal(ours, theirs, equal_nan=ours.dtype.kind == "f"), (name, variable)
        result.to_netcdf(folder / "again.nc")
        assert (folder / "again.nc").read_bytes()[1:4] == b"HDF"
    else:
        print("not tried: NetCDF, for want of python3-netcdf4")

    # Arrays: the same readings give the same fit; a column is a view of the run's memory.
    pluck = unrig.read_run(runs[0])
    angle = {"alpha": (np.degrees(pluck["alpha"]), "deg")} if "alpha" in pluck.columns else {}
    array = unrig.run_from_arrays(pluck.time, {"gauge": (pluck["gauge"], "N"), **angle}, kind="pluck", density=pluck.density, medium=pluck.medium, name=runs[0])
    assert np.array_equal(array["gauge"], pluck["gauge"], equal_nan=True)
    assert np.shares_memory(pluck["gauge"], pluck["gauge"])
    again = unrig.fit(rig, [array, *runs[1:]])
    assert abs(again.params["normal.stiffness_scale"].value - stiffness.value) < 0.1 * stiffness.stderr

    # Errors have the program's messages.
    for wrong, call in ((unrig.InputError, lambda: unrig.fit(rig, ["no_such_file.csv"])), (ValueError, lambda: unrig.run_from_arrays([0, 1, 3, 4], {"gauge": ([0, 1, 2, 3], "N")}, kind="pluck", density=1.2)),
                        (unrig.InputError, lambda: unrig.fit(rig, runs, effects=["no-such-effect"]))):
        try:
            call()
        except wrong as error:
            assert "wanted" in str(error), error
        else:
            raise AssertionError(wrong)

# The stub names what the compiled part has, no more and no less.
stub = ast.parse((pathlib.Path(unrig.__file__).parent / "_unrig.pyi").read_text())
named = {node.name for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
assert named == {name for name in dir(unrig._unrig) if not name.startswith("_")}, named ^ {name for name in dir(unrig._unrig) if not name.startswith("_")}

print("the Python package agrees with the program")
