#!/usr/bin/env python3
"""Are the errors of `unrig new rig --from impact-test` what they say? Frequency response functions by another route: blows on a chain of three masses, noise, H1 by averaging.

    python3 tests/studies/impact_draws.py build/unrig [DRAWS [csv|uff [BLOWS]]]      needs NumPy

Masses, springs and dampers make M, C, K; the eigenvalue problem of M, K the truth. Each draw: 8 blows (BLOWS) at mass 3, half sine of 4 ms, 40 to 80 N; response of mass 3 (acceleration) and
a bridge (force in the first spring) through (K - w^2 M + i w C)^-1 in a record of 64 s, cut to 8 s, white noise on both; H1 = sum X F* / sum |F|^2, coherence.
Printed: the r.m.s. of (found - true) / stated error, which is 1 where the errors are right, and the share within 1.96 of them.
IMPACT_TEST.md has the results.
"""
import os
import re
import subprocess
import sys
import tempfile

import numpy as np


def system():
    m = np.diag([3.0, 2.0, 1.5])
    k1, k2, k3 = 1.1e5, 1.4e5, 0.9e5
    k = np.array([[k1 + k2, -k2, 0], [-k2, k2 + k3, -k3], [0, -k3, k3]])
    w2, shape = np.linalg.eigh(np.linalg.solve(np.sqrt(m), np.linalg.solve(np.sqrt(m), k).T))
    shape = np.linalg.solve(np.sqrt(m), shape)                                  # mass normalised
    zeta = np.array([0.010, 0.012, 0.015])
    c = m @ shape @ np.diag(2 * zeta * np.sqrt(w2)) @ shape.T @ m               # modal damping
    return m, c, k, k1, np.sqrt(w2), zeta, shape

M, C, K, K1, W, ZETA, SHAPE = system()
TRUE = [{"frequency": W[i] / 2 / np.pi, "damping_ratio": ZETA[i], "mass": 1 / SHAPE[2, i] ** 2, "gauge_gain": K1 * SHAPE[0, i] / SHAPE[2, i]} for i in range(3)]
RATE, LONG, LENGTH = 2048, 64, 8
BLOWS = int(sys.argv[4]) if len(sys.argv) > 4 else 8
w = 2 * np.pi * np.fft.rfftfreq(LONG * RATE, 1 / RATE)
X = np.array([np.linalg.solve(K - s * s * M + 1j * s * C, [0, 0, 1.0]) for s in w])
ACC, BRIDGE = -w ** 2 * X[:, 2], K1 * X[:, 0]

def functions(rng, noise):
    n = LENGTH * RATE
    ff, xf, xx = 0, [0, 0], [0, 0]
    for _ in range(BLOWS):
        t = np.arange(LONG * RATE) / RATE - 0.01 - rng.uniform(0, 0.02)
        force = rng.uniform(40, 80) * np.where((t > 0) & (t < 0.004), np.sin(np.pi * t / 0.004), 0)
        spectrum = np.fft.rfft(force)
        f = np.fft.rfft(force[:n])
        ff = ff + abs(f) ** 2
        for j, h in enumerate((ACC, BRIDGE)):
            x = np.fft.irfft(h * spectrum)[:n]
            x = np.fft.rfft(x + noise[j] * rng.standard_normal(n))
            xf[j] = xf[j] + x * np.conj(f)
            xx[j] = xx[j] + abs(x) ** 2
    freq = np.fft.rfftfreq(n, 1 / RATE)
    band = (freq >= 8) & (freq <= 120)
    return freq[band], [(xf[j] / ff)[band] for j in range(2)], [(abs(xf[j]) ** 2 / ff / xx[j])[band] for j in range(2)]

def write_csv(folder, freq, h, g):
    names = []
    for name, unit, hh, gg in (("acc", "m/s^2/N", h[0], g[0]), ("bridge", "N/N", h[1], g[1])):
        names.append(os.path.join(folder, name + ".csv"))
        with open(names[-1], "w") as out:
            out.write(f"frequency [Hz],real [{unit}],imaginary [{unit}],coherence\n")
            for row in zip(freq, hh.real, hh.imag, gg): out.write("%.6f,%.9g,%.9g,%.9g\n" % row)
    return names

def write_uff(folder, freq, h, g):
    path = os.path.join(folder, "frf.unv")
    with open(path, "w") as out:
        # specific data type: 12 acceleration, 13 excitation force, 9 reaction force
        for node, direction, kind, unit, hh, gg in ((3, 3, 12, "m/s^2", h[0], g[0]), (1, 3, 9, "N", h[1], g[1])):
            for function, values in ((4, hh), (6, gg)):
                out.write("    -1\n    58\n")
                out.write(("response of node %d" % node) + "\nNONE\n25-Nov-26 01:00:00\nNONE\nNONE\n")
                out.write("%5d%10d%5d%10d %-10s%10d%4d %-10s%10d%4d\n" % (function, 0, 0, 0, "NONE", node, direction, "NONE", 3, 3))
                complex_values = function == 4
                out.write("%10d%10d%10d%13.5e%13.5e%13.5e\n" % (6 if complex_values else 4, len(freq), 1, freq[0], freq[1] - freq[0], 0))
                out.write("%10d%5d%5d%5d %-20s %-20s\n" % (18, 0, 0, 0, "Frequency", "Hz"))
                out.write("%10d%5d%5d%5d %-20s %-20s\n" % ((kind if complex_values else 0), 0, 0, 0, "Response", unit if complex_values else "NONE"))
                out.write("%10d%5d%5d%5d %-20s %-20s\n" % ((13 if complex_values else 0), 0, 0, 0, "Force", "N" if complex_values else "NONE"))
                out.write("%10d%5d%5d%5d %-20s %-20s\n" % (0, 0, 0, 0, "NONE", "NONE"))
                if complex_values:
                    flat, form, each = np.column_stack([values.real, values.imag]).ravel(), "%20.11e", 4
                else:
                    flat, form, each = values, "%20.11e", 4
                for i in range(0, len(flat), each): out.write("".join(form % v for v in flat[i:i + each]) + "\n")
                out.write("    -1\n")
    return [path]

def numbers(text):
    modes = []
    for part in text.split("[[modal]]")[1:]:
        found = dict(re.findall(r'^(\w+) = "?([-+.\deE]+)', part, re.M))
        modes.append({k: float(v) for k, v in found.items()})
    return modes

def main():
    unrig, draws, form = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 50, sys.argv[3] if len(sys.argv) > 3 else "csv"
    rng = np.random.default_rng(29)
    noise = (0.15, 0.25)                                                        # m/s^2, N
    z, failed = {}, []
    for draw in range(draws):
        with tempfile.TemporaryDirectory() as folder:
            freq, h, g = functions(rng, noise)
            files = (write_csv if form == "csv" else write_uff)(folder, freq, h, g)
            command = [unrig, "new", "rig", "--from", "impact-test", *files, "-o", folder + "/rig.toml", "--averages", str(BLOWS)]
            done = subprocess.run(command, capture_output=True, text=True)
            modes = numbers(open(folder + "/rig.toml").read()) if done.returncode == 0 else []
            if draw == 0: print(done.stdout, done.stderr, sep=""); print("coherence: median %.4f %.4f, lowest %.3f %.3f" % (*map(np.median, g), *map(np.min, g)))
            if len(modes) != 3:
                failed.append((draw, len(modes), done.stderr.strip()))
                continue
            for i in range(3):
                for key, true in TRUE[i].items():
                    z.setdefault((i + 1, key), []).append(((modes[i][key] - true) / modes[i][key + "_std"], modes[i][key] / true - 1, modes[i][key + "_std"] / true))
    print("true:", [{k: float("%.6g" % v) for k, v in t.items()} for t in TRUE])
    for (mode, key), rows in sorted(z.items()):
        rows = np.array(rows)
        print("mode %d %-14s r.m.s. z %.2f, mean z %+.2f, within 1.96: %3.0f %%; mean off %+.2e, stated %.1e, in %d draws" %
              (mode, key, np.sqrt((rows[:, 0] ** 2).mean()), rows[:, 0].mean(), 100 * (abs(rows[:, 0]) < 1.96).mean(), rows[:, 1].mean(), abs(rows[:, 2]).mean(), len(rows)))
    every = np.concatenate([np.array(r)[:, 0] for r in z.values()])
    print("all: r.m.s. z %.2f, within 1.96: %.1f %% of %d" % (np.sqrt((every ** 2).mean()), 100 * (abs(every) < 1.96).mean(), len(every)))
    for f in failed: print("draw %d: %d modes; %s" % f)

main()
