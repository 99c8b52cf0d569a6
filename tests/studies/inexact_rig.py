"""Campaigns whose rig files are a little off, corrected once the files state by how much they may be off: does the 95 % band of the circulatory load hold?

    python3 tests/studies/inexact_rig.py build/unrig SHARED/campaigns/open2 [e1 e2 ..]

Per campaign and step: r.m.s. error of the circulatory load from 0.5 to 8 semichords behind the step, in per cent of the load's change, share of samples within 1.96 standard deviations,
and the same with nothing stated. What is stated is what KEY.json says was drawn from: 1 % of each mass, 1.5 mm of each station, 0.5 % of chord and speed.
"""
import csv
import math
import os
import re
import subprocess
import sys
import tempfile
import time

STATED = {"e1": ("mass",), "e2": ("speed",), "e3": ("chord",), "e4": ("station",), "e5": ("mass", "chord", "station", "speed")}
RUNS = ("dry_pluck", "wet_pluck", "step_a", "step_b", "step_c")


def state(rig, what):
    if "mass" in what:
        rig = rig.replace("mass.unit =", "mass.std_percent = 1.0\nmass.unit =", 1)
    if "station" in what:
        rig = rig.replace("station.unit =", 'station.std = "1.5 mm"\nstation.unit =', 1)
    if "chord" in what:
        rig = rig.replace("pitch_axis =", "chord_std_percent = 0.5\npitch_axis =", 1)
    return rig


def column(path, name):
    lines = (line for line in open(path) if not line.startswith("#"))
    rows = csv.reader(lines)
    header = next(rows)
    place = [re.sub(r" *\[.*", "", h) for h in header].index(name)
    return [float(row[place]) if row[place] else math.nan for row in rows]


def run(command):
    start = time.time()
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(" ".join(command) + "\n" + done.stderr)
    return time.time() - start, done


def look_at(unrig, folder, campaign, what):
    with tempfile.TemporaryDirectory() as there:
        rig = os.path.join(there, "rig.toml")
        open(rig, "w").write(state(open(os.path.join(folder, campaign, "rig.toml")).read(), what))
        files = []
        for name in RUNS:
            text = open(os.path.join(folder, campaign, name + ".csv")).read()
            if "speed" in what:
                text = text.replace("# speed =", "# speed_std_percent = 0.5\n# speed =", 1)
            files.append(os.path.join(there, name + ".csv"))
            open(files[-1], "w").write(text)
        fit = os.path.join(there, "fit.json")
        seconds, done = run([unrig, "fit", "--rig", rig] + files + ["-o", fit])
        chi2 = re.search(r"reduced chi-square += ([0-9.]+)", done.stdout).group(1)
        print(f"{campaign} {'+'.join(what) or 'exact':24} fit {seconds:.1f} s, reduced chi-square {chi2}", flush=True)
        results = []
        for name, path in zip(RUNS[2:], files[2:]):
            out = os.path.join(there, "out.csv")
            seconds, done = run([unrig, "correct", "--rig", rig, "--fit", fit, path, "-o", out])
            value, std, s = column(out, "circulatory"), column(out, "circulatory_std"), column(out, "semichords")
            truth = column(os.path.join(folder, campaign, f"truth_{name}.csv"), "circulatory")
            size = abs(truth[-1] - truth[0])
            inside = [k for k in range(len(s)) if 0.5 <= s[k] <= 8]
            held = sum(abs(value[k] - truth[k]) <= 1.96 * std[k] for k in inside)
            error = math.sqrt(sum((value[k] - truth[k]) ** 2 for k in inside) / len(inside)) / size
            band = math.sqrt(sum(std[k] ** 2 for k in inside) / len(inside)) / size
            results.append((held, len(inside), error))
            print(f"   {name}: error {100 * error:.2f} % of the step, band (1 std) {100 * band:.2f} %, holds {100 * held / len(inside):.0f} %  ({seconds:.1f} s)", flush=True)
        return results


if __name__ == "__main__":
    unrig, folder, names = sys.argv[1], sys.argv[2], sys.argv[3:] or sorted(STATED)
    for stated in (False, True):
        pooled = [r for name in names for r in look_at(unrig, folder, name, STATED[name] if stated else ())]
        held, samples = sum(r[0] for r in pooled), sum(r[1] for r in pooled)
        print(f"{'stated' if stated else 'exact'}: bands hold {100 * held / samples:.1f} % pooled, error {100 * math.sqrt(sum(r[2] ** 2 for r in pooled) / len(pooled)):.2f} %")
