"""Campaigns of a laboratory, fitted and corrected: do 95 % intervals and bands hold for each colour of the noise and each kind of error in the files?

    python3 tests/studies/laboratory_bands.py build/unrig [CAMPAIGNS [SEED]]

The three steps of sample_data/campaigns/null without their noise (truth_*.csv, of a simulator that shares no code with the program) and two decays of the same rig let go under 30 N, with noise that no code of the
program made: in the gauge, of 0.03 N r.m.s., white, first-order (corner of 1 to 30 Hz, half to all of the variance), pink (likewise), of Student's t with three degrees of freedom, or read by a converter in steps of
1 to 6 standard deviations; in the angle white, of 0.01 deg. In two thirds of the campaigns numbers of the files are off by what they state as their uncertainty: 1 % of each mass, 1.5 mm of each station, 0.5 % of the
chord, 0.5 % of the speed. The five runs are fitted together, and the steps corrected. Pooled, by colour and by kind of error: share of samples of the circulatory load within 1.96 standard deviations from 0.5 to 8
semichords behind the step and later, share of the shared parameters within theirs, r.m.s. error and band in per cent of the load's change. LABORATORY_BANDS.md has the results.
"""
import json
import math
import os
import random
import re
import subprocess
import sys
import tempfile
from collections import defaultdict

from coloured_noise import DATA, DT, NOISE, RUNS, first_order, mixed, one_over_f, student, white
from inexact_rig import column, run, state

ANGLE_NOISE = 0.01  # deg
KEY = json.load(open(os.path.join(DATA, "..", "KEY.json")))["null"]["truth"]
TRUTH = {"normal.stiffness_scale": KEY["kn"], "torsion.stiffness_scale": KEY["kt"], "normal.damping_ratio": KEY["zeta_n"], "torsion.damping_ratio": KEY["zeta_t"], "apparent_mass_coefficient": KEY["Ca"]}
ERRORS = ("none", "none", "mass", "station", "chord", "speed")


def noise_of(kind, r):
    """What makes noise of variance 1, as long as asked for, and the converter's step."""
    share, corner = r.uniform(0.5, 1), math.exp(r.uniform(0, math.log(30)))
    makes = {"white": white, "first-order": lambda n, r: mixed(share, white(n, r), first_order(n, r, corner)), "pink": lambda n, r: mixed(share, white(n, r), one_over_f(n, r)), "heavy-tailed": student, "quantised": white}
    return makes[kind], NOISE * math.exp(r.uniform(0, math.log(6))) if kind == "quantised" else 0


def misread_rig(rig, what, r):
    """The rig file with numbers off as it states that they may be."""
    def off(name, error):
        found = re.search(rf"^{name}\.values = \[(.*)\]$", rig, re.M)
        values = ", ".join(f"{error(float(v)):.8g}" for v in found.group(1).split(","))
        return rig[: found.start(1)] + values + rig[found.end(1):]

    if what == "mass":
        rig = off("mass", lambda m: m * (1 + 0.01 * r.gauss(0, 1)))
    if what == "station":
        rig = off("station", lambda x: x + 1.5 / 25.4 * r.gauss(0, 1))
    if what == "chord":
        rig = rig.replace('chord = "6 in"', f'chord = "{6 * (1 + 0.005 * r.gauss(0, 1)):.8g} in"')
    return state(rig, (what,))


def clean_runs(unrig, there):
    """Per run: its head, what angle and gauge would read without noise, and the truth of its load."""
    runs = {}
    for name in RUNS:
        recorded = os.path.join(DATA, name + ".csv")
        head = [line for line in open(recorded).read().splitlines() if line.startswith("#")]
        if name.startswith("step"):
            truth = os.path.join(DATA, f"truth_{name}.csv")
            runs[name] = head, column(truth, "alpha"), column(truth, "gauge_clean"), column(truth, "circulatory")
            continue
        out = os.path.join(there, name + "_clean.csv")
        settings = [part for item in TRUTH.items() for part in ("--set", "{}={}".format(*item))]
        run([unrig, "simulate", "--rig", os.path.join(DATA, "rig.toml"), "--run", recorded, "--release-load", "30 N", "-o", out] + settings)
        runs[name] = head, [0.0] * len(column(out, "gauge")), column(out, "gauge"), None
    return runs


def write(path, head, alpha, gauge):
    lines = head + ["time [s],alpha [deg],gauge [N]"] + [f"{k * DT:.3f},{a:.5f},{y:.6f}" for k, (a, y) in enumerate(zip(alpha, gauge))]
    open(path, "w").write("\n".join(lines) + "\n")


class Count:
    def __init__(self):
        self.campaigns = self.steps = self.held = self.later = self.error = self.band = self.intervals = self.known = 0

    def row(self, name):
        return (f"| {name} | {self.campaigns} | {100 * self.held / self.steps:.1f} | {100 * self.later / self.steps:.1f} | {100 * math.sqrt(self.error / self.steps):.2f} | {100 * math.sqrt(self.band / self.steps):.2f} "
                f"| {100 * self.known / max(1, self.intervals):.1f} of {self.intervals} |")


def look_at(unrig, clean, kind, what, r, there):
    """One campaign, as an increment of a count."""
    rig, fit, out = (os.path.join(there, name) for name in ("rig.toml", "fit.json", "out.csv"))
    open(rig, "w").write(misread_rig(open(os.path.join(DATA, "rig.toml")).read(), what, r))
    make, converter = noise_of(kind, r)
    files = []
    for name, (head, alpha, gauge, _) in clean.items():
        if what == "speed":
            speed = 1 + 0.005 * r.gauss(0, 1)
            head = [re.sub(r'speed = "([0-9.]+) m/s"', lambda m: f'speed = "{float(m.group(1)) * speed:.8g} m/s"', line) for line in head]
            head = [part for line in head for part in (["# speed_std_percent = 0.5"] if line.startswith("# speed =") else []) + [line]]
        read = [y + NOISE * e for y, e in zip(gauge, make(len(gauge), r))]
        if converter:
            read = [converter * round(y / converter) for y in read]
        files.append(os.path.join(there, name + ".csv"))
        write(files[-1], head, [a + ANGLE_NOISE * r.gauss(0, 1) for a in alpha], read)
    one = Count()
    one.campaigns = 1
    run([unrig, "fit", "--rig", rig] + files + ["-o", fit])
    for p in json.load(open(fit))["parameters"]:
        if p["name"] in TRUTH and p["identified"] and p["std_error"]:
            one.intervals += 1
            one.known += abs(p["value"] - TRUTH[p["name"]]) <= 1.96 * p["std_error"]
    for name, path in zip(RUNS, files):
        truth = clean[name][3]
        if truth is None:
            continue
        run([unrig, "correct", "--rig", rig, "--fit", fit, path, "-o", out])
        value, std, s = column(out, "circulatory"), column(out, "circulatory_std"), column(out, "semichords")
        size = abs(truth[-1] - truth[0])
        inside, behind = [k for k in range(len(s)) if 0.5 <= s[k] <= 8], [k for k in range(len(s)) if s[k] > 8]
        one.steps += 1
        one.held += sum(abs(value[k] - truth[k]) <= 1.96 * std[k] for k in inside) / len(inside)
        one.later += sum(abs(value[k] - truth[k]) <= 1.96 * std[k] for k in behind) / len(behind)
        one.error += sum((value[k] - truth[k]) ** 2 for k in inside) / len(inside) / size**2
        one.band += sum(std[k] ** 2 for k in inside) / len(inside) / size**2
    return one


def main():
    unrig = os.path.abspath(sys.argv[1])
    campaigns, seed = (int(sys.argv[i]) if len(sys.argv) > i else usual for i, usual in ((2, 200), (3, 1)))
    counts = defaultdict(Count)
    kinds = ("white", "first-order", "pink", "heavy-tailed", "quantised")
    with tempfile.TemporaryDirectory() as there:
        clean = clean_runs(unrig, there)
        for i in range(campaigns):
            kind, what = kinds[i % len(kinds)], ERRORS[i // len(kinds) % len(ERRORS)]
            try:
                one = look_at(unrig, clean, kind, what, random.Random(f"{seed} {i}"), there)
            except SystemExit as failed:
                counts["failed"].campaigns += 1
                print(f"campaign {i} ({kind}, {what}): {str(failed).splitlines()[-1]}", file=sys.stderr, flush=True)
                continue
            for name in (f"noise: {kind}", f"files: {what}", "all"):
                for field, value in vars(one).items():
                    setattr(counts[name], field, getattr(counts[name], field) + value)
    failed = counts.pop("failed", Count()).campaigns
    print("| campaigns | number | band holds, 0.5 to 8 semichords, % | later | r.m.s. error, % of the step | band, one standard deviation | 95 % intervals of shared parameters hold, % |\n| --- | --- | --- | --- | --- | --- | --- |")
    for name in sorted(counts, key=lambda n: (n == "all", n)):
        print(counts[name].row(name))
    print(f"\n{failed} without an answer")


if __name__ == "__main__":
    main()
