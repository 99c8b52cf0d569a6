"""What is usually done to a ringing gauge, on the same recordings as `unrig correct`, against the true load.

    /usr/bin/python3 tests/benchmarks/compare_naive.py [--unrig build/unrig] [--campaigns sample_data/campaigns] [null wave ...]

Every peer is written for this comparison with NumPy and SciPy. Where it needs the rig it gets one mode, frequency and damping fitted to the ringing of
the same run (in still water the damping is far less): load to reading H = w^2 / (s^2 + 2 zeta w s + w^2). Figure of merit: r.m.s. error of the circulatory load from 0.5 to 8 semichords after the
step, over the step's own size, in percent; mean square over the runs step_a, step_b, step_c, heldout. Non-circulatory load is over by then. All
loads, `unrig`'s too, are deviations from their mean before the motion.
"""
import argparse
import pathlib
import re
import subprocess
import tempfile

import numpy as np
from scipy import linalg, optimize, signal

EFFECT = {"wave": ["tank-wave"], "lowpass": ["gauge-lowpass"], "drag": ["quadratic-drag"], "friction": ["coulomb-friction"], "highermode": ["higher-mode"]}
STEPS = ["step_a", "step_b", "step_c", "heldout"]
ONSET = 1.0  # s, in every run


def table(path):
    """Metadata as text and columns by name of a run file, or of a plain CSV."""
    lines = path.read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    names = [cell.split(" [")[0] for cell in lines[len(head)].split(",")]
    values = np.genfromtxt(lines[len(head) + 1:], delimiter=",")
    return "\n".join(head), dict(zip(names, values.T))


def damped_mode(t, y, starts, trend):
    """Angular frequency and damping ratio of one damped sinusoid beside a trend."""

    def left(p):
        w, zeta = p
        d = np.exp(-zeta * w * t)
        basis = np.column_stack([d * np.cos(w * t), d * np.sin(w * t), trend])
        return y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]

    return min((optimize.least_squares(left, start, x_scale=[0.1, 0.01], bounds=([1, 0], [200, 0.9])) for start in starts), key=lambda r: r.cost).x


def mode_in_water(path):
    """Of a free decay, from half a second on."""
    _, c = table(path)
    t, y = c["time"], c["gauge"]
    ok = np.isfinite(y) & (t > 0.5)
    t, y = t[ok], y[ok]
    spectrum = np.abs(np.fft.rfft((y - y.mean()) * np.hanning(len(y))))
    start = 2 * np.pi * np.argmax(spectrum) / (t[-1] - t[0])
    return damped_mode(t, y, [[start * f, 0.02] for f in (0.98, 1.0, 1.02)], np.ones((len(t), 1)))


def mode_in_stream(t, y, w):
    """Of the ringing after the step, which the stream damps, beside a slow build-up."""
    since = t - ONSET - 0.15
    ok = (since > 0) & (since < 3)
    since, y = since[ok], y[ok]
    trend = np.column_stack([np.exp(-since * r) for r in (0, 0.3, 1.0)])
    return damped_mode(since, y, [[w, z] for z in (0.05, 0.1, 0.2)], trend)


def low_pass(y, cutoff, dt):
    return signal.sosfiltfilt(signal.butter(2, cutoff * 2 * dt, output="sos"), y)


def transfer(n, w, zeta, dt):
    """H on the lines of a record that is padded to twice its length."""
    s = 2j * np.pi * np.fft.rfftfreq(2 * n, dt)
    return w**2 / (s**2 + 2 * zeta * w * s + w**2)


def divide(y, filter_of_h, w, zeta, dt):
    """Spectral division of a record that is continued by its last value and led back to its first."""
    n = len(y)
    back = y[-1] + (y[0] - y[-1]) * 0.5 * (1 - np.cos(np.pi * np.arange(n) / n))
    padded = np.concatenate([y, back])
    return np.fft.irfft(np.fft.rfft(padded) * filter_of_h(transfer(n, w, zeta, dt)), 2 * n)[:n]


def tikhonov(y, w, zeta, dt):
    """Dense Tikhonov, load from rest with its first differences kept small; weights by L-curve and by generalised cross-validation."""
    n, every = len(y), 4
    y, dt = y[: n // every * every].reshape(-1, every).mean(1), dt * every
    m = len(y)
    t = np.arange(m) * dt
    wd = w * np.sqrt(1 - zeta**2)
    h = w**2 / wd * np.exp(-zeta * w * t) * np.sin(wd * t) * dt
    a = np.tril(linalg.toeplitz(h)) @ np.tril(np.ones((m, m)))  # over differences of the load: standard form
    u, s, vt = linalg.svd(a)
    b = u.T @ y
    weights = np.logspace(-6, 2, 100) * s[0]
    f = s**2 / (s**2 + weights[:, None] ** 2)
    residual = np.sum(((1 - f) * b) ** 2, 1)
    size = np.sum((f * b / s) ** 2, 1)
    gcv = np.argmin(residual / (m - f.sum(1)) ** 2)
    x, z = np.log(residual), np.log(size)
    dx, dz = np.gradient(x), np.gradient(z)
    curvature = (dx * np.gradient(dz) - dz * np.gradient(dx)) / (dx**2 + dz**2) ** 1.5
    corner = np.argmax(curvature[3:-3]) + 3
    full = np.arange(n) * dt / every
    return [np.interp(full, t + 0.5 * dt * (every - 1) / every, np.cumsum(vt.T @ (f[i] * b / s))) for i in (corner, gcv)]


def run_unrig(unrig, folder, name, work):
    rig, fit = folder / "rig.toml", work / "fit.json"
    effects = [word for effect in EFFECT.get(name, []) for word in ("--effect", effect)]
    runs = [folder / f"{r}.csv" for r in ("dry_pluck", "wet_pluck", "step_a", "step_b", "step_c")]
    result = {}
    subprocess.run([unrig, "fit", "--rig", rig, *runs, *effects, "-o", fit], check=True, capture_output=True)
    for r in STEPS:
        subprocess.run([unrig, "correct", "--rig", rig, "--fit", fit, folder / f"{r}.csv", "-o", work / f"{r}.csv"], check=True, capture_output=True)
        result[r] = table(work / f"{r}.csv")[1]["circulatory"]
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--unrig", default="build/unrig")
    parser.add_argument("--campaigns", type=pathlib.Path, default=pathlib.Path("sample_data/campaigns"))
    parser.add_argument("names", nargs="*", default=["null", "wave", "lowpass"])
    arguments = parser.parse_args()
    methods = ["raw reading", "low-pass, zero phase, best cut-off in hindsight", "inverse filter behind a low-pass, best cut-off in hindsight", "Wiener, best constant in hindsight",
               "dense Tikhonov, L-curve", "dense Tikhonov, GCV", "`unrig correct`"]
    squares = {m: {c: [] for c in arguments.names} for m in methods}
    for name in arguments.names:
        folder = arguments.campaigns / name
        chord = float(re.search(r'chord = "([\d.]+) in"', (folder / "rig.toml").read_text())[1]) * 0.0254
        still, _ = mode_in_water(folder / "wet_pluck.csv")
        with tempfile.TemporaryDirectory() as work:
            try:
                ours = run_unrig(arguments.unrig, folder, name, pathlib.Path(work))
            except subprocess.CalledProcessError as error:
                print(f"{name}: unrig refuses: {error.stderr.decode().strip()}")
                ours = {}
        for run in STEPS:
            head, c = table(folder / f"{run}.csv")
            truth = table(folder / f"truth_{run}.csv")[1]["circulatory"]
            t, dt = c["time"], c["time"][1] - c["time"][0]
            speed = float(re.search(r'speed = "([\d.]+)', head)[1])
            before = t < ONSET - 0.05
            semichords = (t - ONSET) * speed / (chord / 2)
            window = (semichords >= 0.5) & (semichords <= 8)
            change = truth - truth[0]
            size = abs(change[-1])
            y = c["gauge"]
            y = np.interp(t, t[np.isfinite(y)], y[np.isfinite(y)])
            y = y - y[before].mean()

            w, zeta = mode_in_stream(t, y, still)

            def error(load):
                load = load - load[before].mean()
                return np.sqrt(np.mean((load - change)[window] ** 2)) / size

            cutoffs = np.geomspace(0.3, 100, 60)
            inverse = divide(y, lambda h: 1 / h, w, zeta, dt)
            corner, gcv = tikhonov(y, w, zeta, dt)
            found = [error(y), min(error(low_pass(y, f, dt)) for f in cutoffs), min(error(low_pass(inverse, f, dt)) for f in cutoffs),
                     min(error(divide(y, lambda h: h.conj() / (abs(h) ** 2 + k), w, zeta, dt)) for k in np.geomspace(1e-3, 100, 60)), error(corner), error(gcv),
                     error(ours[run]) if run in ours else np.nan]
            for method, e in zip(methods, found):
                squares[method][name].append(e**2)
    print("| method | " + " | ".join(arguments.names) + " |")
    print("| --- |" + " --- |" * len(arguments.names))
    for method in methods:
        cells = [f"{100 * np.sqrt(np.mean(squares[method][c])):.3g} %" for c in arguments.names]
        print(f"| {method} | " + " | ".join(cells) + " |")
    print(f"\n`unrig correct`, run by run ({', '.join(STEPS)}):")
    for name in arguments.names:
        print(f"  {name}: " + ", ".join(f"{100 * np.sqrt(e):.2f} %" for e in squares[methods[-1]][name]))


if __name__ == "__main__":
    main()
