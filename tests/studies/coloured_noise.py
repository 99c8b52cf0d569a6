"""Campaigns whose gauge noise has a colour, fitted and corrected: does the 95 % band of the circulatory load hold?

    python3 tests/studies/coloured_noise.py build/unrig [SEEDS [alone]]

The three steps of sample_data/campaigns/null without their noise (truth_*.csv), and its two decays as they are, with noise of 0.03 N r.m.s. that no code of the program made, fitted together; `alone`: the
fit is that of the campaign as it is, so that a step has to tell the colour by itself. Per colour, pooled over steps and seeds: share of samples within 1.96 standard deviations from 0.5 to 8 semichords
behind the step and later, r.m.s. error and band in per cent of the load's change, the worst exit status. COLOURED_NOISE.md has the results.
"""
import math
import os
import random
import subprocess
import sys
import tempfile

from inexact_rig import column

RUNS = ("dry_pluck", "wet_pluck", "step_a", "step_b", "step_c")
NOISE = 0.03  # N
DT = 0.002
DATA = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "sample_data", "campaigns", "null")


def white(n, r):
    return [r.gauss(0, 1) for _ in range(n)]


def first_order(n, r, corner):
    a = math.exp(-2 * math.pi * corner * DT)
    x, out = r.gauss(0, 1), []
    for _ in range(n):
        out.append(x)
        x = a * x + math.sqrt(1 - a * a) * r.gauss(0, 1)
    return out


def one_over_f(n, r):
    """1/f between a fifth of a period in the record and the Nyquist frequency: first-order parts, eight to a decade, of equal power."""
    low, high = 0.2 / (n * DT), 0.5 / DT
    count = int(8 * math.log10(high / low))
    out = [0.0] * n
    for i in range(count):
        for k, x in enumerate(first_order(n, r, low * (high / low) ** (i / count))):
            out[k] += x
    return [x / math.sqrt(count) for x in out]


def mixed(share, one, other):
    return [math.sqrt(1 - share) * a + math.sqrt(share) * b for a, b in zip(one, other)]


def student(n, r):
    return [r.gauss(0, 1) / math.sqrt(sum(r.gauss(0, 1) ** 2 for _ in range(3))) for _ in range(n)]  # variance 3, over sqrt(3)


def second_order(n, r):
    """Half of it has gone through two poles: a spectrum that falls faster than any part of the program's."""
    a = math.exp(-2 * math.pi * 20 * DT)
    x, out = 0.0, []
    for e in first_order(n + 500, r, 20):
        x = a * x + (1 - a) * e
        out.append(x)
    out = out[500:]
    size = math.sqrt(sum(v * v for v in out) / n)
    return mixed(0.5, white(n, r), [v / size for v in out])


def decimated(n, r):
    """White noise at four times the rate behind a windowed sinc of 41 taps, every fourth sample: flat, and half of that at half the sampling rate."""
    times, taps = 4, 41
    at = [math.pi * (j - (taps - 1) / 2) / times for j in range(taps)]
    answer = [(0.54 - 0.46 * math.cos(2 * math.pi * j / (taps - 1))) * (math.sin(x) / x if x else 1) for j, x in enumerate(at)]
    size = math.sqrt(sum(a * a for a in answer))
    e = [r.gauss(0, 1) for _ in range(times * n + taps)]
    return [sum(a * e[times * k + j] for j, a in enumerate(answer)) / size for k in range(n)]


COLOURS = {
    "white": white,
    "half first order, 8 Hz": lambda n, r: mixed(0.5, white(n, r), first_order(n, r, 8)),
    "half first order, 0.5 Hz": lambda n, r: mixed(0.5, white(n, r), first_order(n, r, 0.5)),
    "one tenth 1/f": lambda n, r: mixed(0.1, white(n, r), one_over_f(n, r)),
    "half 1/f": lambda n, r: mixed(0.5, white(n, r), one_over_f(n, r)),
    "all 1/f": one_over_f,
    "half second order, 20 Hz": second_order,
    "Student's t, 3": student,
    "behind a filter against aliasing": decimated,
}


def written(there, name, noise):
    """The run with this noise; returns its path."""
    lines = open(os.path.join(DATA, name + ".csv")).read().splitlines()
    head = [line for line in lines if line.startswith("#")]
    rows = [line.split(",") for line in lines[len(head) + 1:]]
    gauge = column(os.path.join(DATA, f"truth_{name}.csv"), "gauge_clean") if name.startswith("step") else [float(row[2]) for row in rows]
    path = os.path.join(there, name + ".csv")
    with open(path, "w") as file:
        file.write("\n".join(head + [lines[len(head)]] + [f"{row[0]},{row[1]},{y + NOISE * e:.6f}" for row, y, e in zip(rows, gauge, noise)]) + "\n")
    return path


def samples_of(name):
    return sum(1 for line in open(os.path.join(DATA, name + ".csv")) if not line.startswith("#")) - 1


def main():
    unrig, seeds, alone = os.path.abspath(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 10, "alone" in sys.argv[3:]
    rig = os.path.join(DATA, "rig.toml")
    print("| noise | holds, 0.5 to 8 semichords [%] | later | error [% of the step] | band, one standard deviation | called coloured | worst exit status |\n| --- | --- | --- | --- | --- | --- | --- |")
    for colour, make in COLOURS.items():
        held = held_later = runs = called = worst = 0
        error = band = 0.0
        for seed in range(seeds):
            with tempfile.TemporaryDirectory() as there:
                fit, out = os.path.join(there, "fit.json"), os.path.join(there, "out.csv")
                files = [written(there, name, make(samples_of(name), random.Random(f"{colour} {name} {seed}"))) for name in RUNS]
                fitted = [os.path.join(DATA, name + ".csv") for name in RUNS] if alone else files
                worst = max(worst, subprocess.run([unrig, "fit", "--rig", rig] + fitted + ["-o", fit], capture_output=True).returncode)
                for name, path in zip(RUNS[2:], files[2:]):
                    done = subprocess.run([unrig, "correct", "--rig", rig, "--fit", fit, path, "-o", out], capture_output=True, text=True)
                    worst = max(worst, done.returncode)
                    called += "is coloured" in done.stderr
                    value, std, s = column(out, "circulatory"), column(out, "circulatory_std"), column(out, "semichords")
                    truth = column(os.path.join(DATA, f"truth_{name}.csv"), "circulatory")
                    size = abs(truth[-1] - truth[0])
                    inside = [k for k in range(len(s)) if 0.5 <= s[k] <= 8]
                    behind = [k for k in range(len(s)) if s[k] > 8]
                    held += sum(abs(value[k] - truth[k]) <= 1.96 * std[k] for k in inside) / len(inside)
                    held_later += sum(abs(value[k] - truth[k]) <= 1.96 * std[k] for k in behind) / len(behind)
                    error += sum((value[k] - truth[k]) ** 2 for k in inside) / len(inside) / size**2
                    band += sum(std[k] ** 2 for k in inside) / len(inside) / size**2
                    runs += 1
        print(f"| {colour} | {100 * held / runs:.1f} | {100 * held_later / runs:.1f} | {100 * math.sqrt(error / runs):.2f} | {100 * math.sqrt(band / runs):.2f} | {called} of {runs} | {worst} |", flush=True)


if __name__ == "__main__":
    main()
