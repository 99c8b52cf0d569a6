#!/usr/bin/env python3
"""The five-run fit of the sample campaign by unrig and by scipy.optimize.least_squares: the same model, data and parameters.

    python3 tests/benchmarks/compare_scipy.py [build/unrig]       # needs numpy and scipy; a minute

The model is written anew here, from the equations of the seed, in NumPy: modes, apparent mass in the mass matrix, Wagner lags per strip, gauge as sum
of the forces outboard, exact steps by the matrix exponential, the angle as a cubic spline on the samples. Motion, initial states and offsets are linear
and are eliminated by numpy.linalg.lstsq in every evaluation, as unrig does; derivatives are scipy's finite differences. scipy has no first guess and no growing window,
so it starts near the answer: stiffnesses 1 % off, damping and slopes 20 %; unrig starts from the rig file. Noise levels are those that unrig found.
Exit status 1 where the two answers differ by more than a tenth of a standard error.
"""
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # one core for both
import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CAMPAIGN = os.path.join(ROOT, "sample_data", "campaigns", "null")
RUNS = ["dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"]
SHARED = ["normal.stiffness_scale", "torsion.stiffness_scale", "normal.damping_ratio", "torsion.damping_ratio", "apparent_mass_coefficient"]
INCH, POUND = 0.0254, 0.45359237
POUND_FORCE = POUND * 9.80665
WAGNER = np.array([(1.62165613749757e-03, 5.03606364897936e-04), (1.11345851722105e-02, 5.51798132278591e-03), (5.12854222488395e-02, 2.86794592624548e-02),
                   (1.72415844680658e-01, 1.02405639364402e-01), (2.11049517622975e-01, 2.84355261331166e-01), (5.23963747961373e-02, 8.49939725592351e-01)])


class Rig:
    """Modes of both chains (seed, section 3.1) and what they do at every element."""

    def __init__(self, path, normal_modes, torsion_modes):
        with open(path, "rb") as file:
            rig = tomllib.load(file)
        self.b = 0.5 * 6 * INCH
        self.a = 2 * rig["section"]["pitch_axis"] - 1
        self.station = np.array(rig["normal"]["station"]["values"]) * INCH
        self.mass = np.array(rig["normal"]["mass"]["values"]) * POUND
        self.centre = np.array(rig["normal"]["mass_centre"]["values"]) * INCH
        self.strips = np.array(rig["submerged"]["elements"]) - 1
        self.length = 14 * INCH
        gauge, calibration = rig["gauge"]["element"] - 1, rig["gauge"]["calibration_element"] - 1
        self.arm = np.maximum(self.station - self.station[gauge], 0) / (self.station[calibration] - self.station[gauge])

        def modes(inertia, flexibility, count):
            flexibility = (flexibility + flexibility.T) / 2
            root = np.sqrt(inertia)
            value, vector = np.linalg.eigh(root[:, None] * flexibility * root)
            return 1 / np.sqrt(value[::-1][:count]), vector[:, ::-1][:, :count] / root[:, None]

        bend = rig["normal"]["flexibility"]
        twist = rig["torsion"]["flexibility"]
        inertia = np.array(rig["torsion"]["inertia"]["values"]) * POUND * INCH**2
        wn, shape_n = modes(self.mass, np.array(bend["rows"]) * bend["scale"] * INCH / POUND_FORCE, normal_modes)
        wt, shape_t = modes(inertia, np.array(twist["rows"]) * twist["scale"] / (POUND_FORCE * INCH), torsion_modes)
        self.omega, self.is_normal = np.r_[wn, wt], np.r_[np.ones(normal_modes, bool), np.zeros(torsion_modes, bool)]
        n, elements = len(self.omega), len(self.mass)
        carrier = np.minimum(np.arange(elements), rig["torsion"]["rigid_from"] - 1)
        # Columns: the modes, and pitch of the shaft.
        self.h, self.twist = np.zeros((elements, n + 1)), np.zeros((elements, n + 1))
        self.h[:, :normal_modes] = shape_n
        self.twist[:, normal_modes:n] = shape_t[carrier]
        self.twist[:, n] = 1
        structure = self.h.T * self.mass @ self.h
        coupling = self.h.T * (self.mass * self.centre) @ self.twist
        structure -= coupling + coupling.T
        structure[normal_modes:n, normal_modes:n] += shape_t.T * inertia @ shape_t
        structure[normal_modes:n, n] += shape_t.T @ inertia
        self.structure = structure[:n]

    def system(self, theta, slope, density, speed):
        """State equation over [q, q', lags, pitch, rate, acceleration], and the gauge's row (seed, Eq. 2.9 to 2.15, 3.9, 3.16)."""
        kn, kt, zn, zt, ca = theta
        n, b, a = len(self.omega), self.b, self.a
        strips = len(self.strips) if speed > 0 else 0
        lags = strips * len(WAGNER)
        states = 2 * n + lags + 3
        p = 2 * n + lags
        apparent = np.zeros(len(self.mass))
        apparent[self.strips] = np.pi * density * b * b * self.length
        midchord = self.h + a * b * self.twist
        fluid = midchord[:, :n].T * apparent @ midchord + b * b / 8 * self.twist[:, :n].T * apparent @ self.twist
        inertia = self.structure + ca * fluid

        def rate(rows):
            full = np.zeros((len(rows), states))
            full[:, n:2 * n], full[:, p + 1] = rows[:, :n], rows[:, n]
            return full

        def prescribed(rows):
            full = np.zeros((len(rows), states))
            full[:, p + 2] = rows[:, n]
            return full

        h, twist = self.h[self.strips], self.twist[self.strips]
        circulatory = np.zeros((len(self.strips), states))
        downwash = rate((0.5 - a) * b * twist - h)
        downwash[:, :n] += speed * twist[:, :n]
        downwash[:, p] += speed * twist[:, n]
        if speed > 0:
            built_up = downwash.copy()
            for term, (amplitude, _) in enumerate(WAGNER):
                built_up -= amplitude * downwash
                first = 2 * n + term * strips
                built_up[:, first:first + strips] += amplitude * np.eye(strips)
            circulatory = slope * density * speed * b * self.length * built_up
        root = np.sqrt(np.where(self.is_normal, kn, kt))
        zeta = np.where(self.is_normal, zn, zt)
        force = np.zeros((n, states))
        force[:, :n] = -np.diag((root * self.omega) ** 2)
        force[:, n:2 * n] = -np.diag(2 * zeta * root * self.omega)
        rear = self.h[:, :n] - (0.5 - a) * b * self.twist[:, :n]
        force += speed * rate(rear.T * apparent @ self.twist)
        force += (h[:, :n] + (0.5 + a) * b * twist[:, :n]).T @ circulatory
        force -= prescribed(inertia)
        acceleration = np.linalg.solve(inertia[:, :n], force)
        A = np.zeros((states, states))
        A[:n, n:2 * n] = np.eye(n)
        A[n:2 * n] = acceleration
        for term, (_, beta) in enumerate(WAGNER if lags else []):
            first = 2 * n + term * strips
            A[first:first + strips] = beta * speed / b * downwash
            A[first:first + strips, first:first + strips] -= beta * speed / b * np.eye(strips)
        A[p, p + 1] = A[p + 1, p + 2] = 1
        move = self.arm[None] * self.mass @ (self.h - self.centre[:, None] * self.twist) + ca * self.arm[None] * apparent @ midchord
        C = -(move[:, :n] @ acceleration + prescribed(move)) + speed * rate(self.arm[None] * apparent @ self.twist) + self.arm[self.strips][None] @ circulatory
        return A, C[0], p


class Recording:
    """One run, and the windows in which its shaft moves."""

    def __init__(self, name, fitted):
        self.path = os.path.join(CAMPAIGN, name + ".csv")
        meta = {}
        with open(self.path) as file:
            for line in file:
                if not line.startswith("#"):
                    break
                key, _, value = line[1:].partition("=")
                meta[key.strip()] = value.strip().strip('"')
        self.density, self.speed = float(meta["density"].split()[0]), float(meta["speed"].split()[0])
        self.step = meta["kind"] == "step"
        data = np.genfromtxt(self.path, delimiter=",", comments="#", skip_header=len(meta) + 1)
        self.dt = round((data[-1, 0] - data[0, 0]) / (len(data) - 1), 9)
        self.alpha, self.gauge = np.radians(data[:, 1]), data[:, 2]
        noise = {c["name"]: c["noise"] for c in fitted["channels"]}
        self.sigma, self.sigma_alpha = noise["gauge"], noise.get("alpha", np.nan)
        self.use = np.ones(len(self.alpha))
        if not self.step:
            return
        smooth = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(self.alpha, 2, mode="edge"), 5), axis=1)
        change = np.abs(smooth[6:] - smooth[:-6]) > 6 * self.sigma_alpha
        moves = np.flatnonzero(change) + 3
        parts = np.split(moves, np.flatnonzero(np.diff(moves) > 25) + 1)
        self.windows = []
        for first, last in ((m[0], m[-1] + 1) for m in parts):
            window = [max(0, first - max(8, (last - first) // 2)), min(len(self.alpha) - 5, last + max(60, 2 * (last - first)))]
            if self.windows and window[0] <= self.windows[-1][1] + 4:
                window[0] = self.windows.pop()[0]
            self.windows.append(window)
        still = np.ones(len(self.alpha), bool)
        for first, last in self.windows:
            still[first:last + 4] = False
        self.use[still & (np.abs(self.alpha - smooth) > 6 * self.sigma_alpha)] = 0
        self.knots = []  # (first spline, whether it is a level: all splines from there on)
        for first, last in self.windows:
            self.knots += [(k, False) for k in range(first, last)] + [(last, True)]

    def columns(self, unit):
        """Response to each motion unknown, from that to one spline at sample 0."""
        n, summed = len(self.alpha), np.cumsum(unit)
        out = np.zeros((n, len(self.knots)))
        for j, (knot, level) in enumerate(self.knots):
            out[knot:, j] = (summed if level else unit)[:n - knot]
        return out

    def residual(self, rig, theta, slope):
        """Weighted residuals of gauge and angle with the linear unknowns solved for."""
        A, C, p = rig.system(theta, slope, self.density, self.speed)
        n, states = len(self.alpha), len(A)
        augmented = np.zeros((states + 1, states + 1))
        augmented[:states, :states] = A * self.dt
        augmented[p + 2, states] = self.dt
        E = expm(augmented)
        step, jerk = E[:states, :states], E[:states, states]
        if not self.step:
            free = np.empty((n, p))
            row = C.copy()
            for k in range(n):
                free[k] = row[:p]
                row = row @ step
            X, y = np.c_[free, np.ones(n)] / self.sigma, self.gauge / self.sigma
        else:
            state, gauge, angle = np.zeros(states), np.empty(n), np.zeros(n)
            pattern = np.array([1, -3, 3, -1]) / self.dt**3
            for k in range(n):
                gauge[k], angle[k] = C @ state, state[p]
                state = step @ state + (jerk * pattern[k] if k < 4 else 0)
            angle[4:] = 0  # the spline has come back; rounding has not
            m = len(self.knots)
            X, y = np.zeros((2 * n, m + 2)), np.r_[self.gauge / self.sigma, self.alpha * self.use / self.sigma_alpha]
            X[:n, :m], X[:n, m] = self.columns(gauge) / self.sigma, 1 / self.sigma
            w = self.use / self.sigma_alpha
            X[n:, :m], X[n:, m + 1] = self.columns(angle) * w[:, None], w
        scale = np.linalg.norm(X, axis=0)
        scale[scale == 0] = 1
        X = X / scale
        q = np.linalg.qr(X)[0] if not self.rank_deficient(X) else np.linalg.svd(X, full_matrices=False)[0][:, :np.linalg.matrix_rank(X, tol=1e-11)]
        return y - q @ (q.T @ y)

    @staticmethod
    def rank_deficient(X):
        return X.shape[1] < 40 and np.linalg.matrix_rank(X, tol=1e-11) < X.shape[1]


def main():
    binary = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "build", "unrig")
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "fit.json")
        command = [binary, "fit", "--rig", os.path.join(CAMPAIGN, "rig.toml"), *(os.path.join(CAMPAIGN, r + ".csv") for r in RUNS), "-o", out]
        seconds = []
        for _ in range(5):
            used = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            now = resource.getrusage(resource.RUSAGE_CHILDREN)
            seconds.append(now.ru_utime + now.ru_stime - used.ru_utime - used.ru_stime)
        with open(out) as file:
            fit = json.load(file)
    unrig_time = min(seconds)
    name = lambda p: p["name"] + (" " + os.path.basename(p["run"]) if "run" in p else "")
    known = {name(p): p for p in fit["parameters"]}
    rig = Rig(os.path.join(CAMPAIGN, "rig.toml"), fit["modes"]["normal"], fit["modes"]["torsion"])
    recordings = [Recording(r, f) for r, f in zip(RUNS, fit["runs"])]
    slopes = [f"normal_force_slope {r}.csv" for r, rec in zip(RUNS, recordings) if rec.speed > 0]
    names = SHARED + slopes

    def residual(x):
        own = iter(x[len(SHARED):])
        return np.concatenate([rec.residual(rig, x[:len(SHARED)], next(own) if rec.speed > 0 else 0.0) for rec in recordings])

    answer = np.array([known[n]["value"] for n in names])
    off = np.array([1.01 if "stiffness" in n or "mass" in n else 1.2 for n in names])
    evaluations = 0

    def counted(x):
        nonlocal evaluations
        evaluations += 1
        return residual(x)

    for rec in recordings:  # spikes that only show inside the motion: five standard deviations, at unrig's answer
        if rec.step:
            left = rec.residual(rig, answer[:len(SHARED)], known[f"normal_force_slope {os.path.basename(rec.path)}"]["value"])[len(rec.alpha):]
            rec.use[np.abs(left) > 5] = 0
    begin = time.process_time()
    found = least_squares(counted, answer * off, x_scale=np.abs(answer), method="trf", xtol=1e-10, ftol=1e-10)
    scipy_time = time.process_time() - begin

    print(f"{'parameter':<34} {'unrig':>14} {'scipy':>14} {'std. error':>10} {'difference / std. error':>24}")
    worst = 0
    for n, u, s in zip(names, answer, found.x):
        difference = (s - u) / known[n]["std_error"]
        worst = max(worst, abs(difference))
        print(f"{n:<34} {u:14.8f} {s:14.8f} {known[n]['std_error']:10.2g} {difference:24.3f}")
    samples = sum(len(r.alpha) for r in recordings)
    print(f"\n{samples} samples; chi-square: unrig {fit['chi2']:.3f}, scipy {2 * found.cost:.3f}")
    print(f"unrig: {unrig_time:.2f} s of processor time, the whole process, files included, from the rig file's values")
    print(f"scipy: {scipy_time:.1f} s of processor time, {evaluations} evaluations of the residual, from 1 % and 20 % off the answer ({found.message})")
    print(f"largest difference: {worst:.3f} standard errors")
    return 0 if worst < 0.1 and found.success else 1


if __name__ == "__main__":
    sys.exit(main())
