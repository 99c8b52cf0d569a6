"""The Python package against the program: python3 package_test.py UNRIG SAMPLE_CAMPAIGN, with the package on PYTHONPATH. Prints one line; fails by an assertion."""
import _thread
import ast
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile
import time
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

    def interrupt(what):
        _thread.interrupt_main()
    try:
        unrig.correct(rig, result, runs[2], progress=interrupt)
        time.sleep(1)
        raise AssertionError("an interrupt that was not obeyed")
    except KeyboardInterrupt:
        pass

    # A fit's parameters as a data set.
    table = result.to_dataset()
    assert list(table.parameter.values) == list(result.params) and float(table.value.sel(parameter="normal.stiffness_scale")) == stiffness.value
    if importlib.util.find_spec("netCDF4") or importlib.util.find_spec("scipy"):  # what xarray writes NetCDF with
        result.to_netcdf(folder / "fit.nc")
        with xarray.open_dataset(folder / "fit.nc") as back:
            assert np.array_equal(back.value.values, table.value.values)
    else:
        print("not tried: NetCDF, for want of netCDF4 and scipy")

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
