"""Free decays of rigs known as one or two modes: what does `diagnose` name, with `higher-mode` among the candidates and without?

    python3 tests/studies/modal_decays.py build/unrig FIRST LAST [TABLE]

Seeds FIRST to LAST - 1. Two decays of different size from one load, two modes at most, by the classical Runge-Kutta method of this file (twenty steps a sample), with white noise; hidden is nothing, a mode that
the rig file lacks, or one law of the first mode's displacement or velocity. Frequencies of the rig file are off by half a per cent, damping by a third. Each campaign is judged twice. MODAL_DECAYS.md has
the count.
"""
import json
import math
import os
import random
import subprocess
import sys
import tempfile

TRUTHS = ("nothing", "higher-mode", "cubic-stiffness", "cubic-damping", "quadratic-drag", "coulomb-friction", "mains-hum")
OTHERS = "cubic-stiffness,coulomb-friction,gauge-lowpass,gauge-drift,mains-hum"  # what is tried by itself in such a run
SETS = {"without": OTHERS, "with": OTHERS + ",higher-mode"}
DT = 2e-3


def law(truth, size, m, w, x0):
    """Force [N] on the first mode against its motion; `size`: of the linear term it stands beside, at the first swing."""
    v0, k = w * x0, m * w * w
    return {
        "cubic-stiffness": lambda x, v: size * k * x * (x / x0) ** 2,
        "cubic-damping": lambda x, v: size * 0.02 * m * w * v * (v / v0) ** 2 * 5,
        "quadratic-drag": lambda x, v: size * 0.02 * m * w * v * abs(v) / v0 * 5,
        "coulomb-friction": lambda x, v: size * 0.02 * k * x0 * math.tanh(v / (0.002 * v0)),
    }.get(truth, lambda x, v: 0.0)


def decay(modes, x0, force, n):
    """Readings of the modes (mass, omega, damping ratio, gain) let go from displacements in proportion to the load on each of them."""
    steps = 20
    h = DT / steps
    m, w, z, gain = modes[0]
    out = [0.0] * n
    x, v = x0, 0.0

    def slope(x, v):
        return -2 * z * w * v - w * w * x - force(x, v) / m

    for i in range(n):
        out[i] = gain * x
        for _ in range(steps):
            a = slope(x, v)
            b = slope(x + h / 2 * v, v + h / 2 * a)
            c = slope(x + h / 2 * (v + h / 2 * a), v + h / 2 * b)
            d = slope(x + h * (v + h / 2 * b), v + h * c)
            x, v = x + h * v + h * h / 6 * (a + b + c), v + h / 6 * (a + 2 * b + 2 * c + d)
    for m2, w2, z2, gain2 in modes[1:]:  # linear, and not coupled to it
        wd = w2 * math.sqrt(1 - z2 * z2)
        start = x0 * m * w * w / (m2 * w2 * w2)
        for i in range(n):
            t = i * DT
            out[i] += gain2 * start * math.exp(-z2 * w2 * t) * (math.cos(wd * t) + z2 * w2 / wd * math.sin(wd * t))
    return out


def campaign(seed, folder):
    r = random.Random(seed)
    truth = TRUTHS[seed % len(TRUTHS)]
    known = r.choice((1, 2))
    modes = []
    w = 2 * math.pi * r.uniform(2, 8)
    for _ in range(known + (truth == "higher-mode")):
        m = r.uniform(0.5, 4)
        modes.append((m, w, r.uniform(0.004, 0.02), m * w * w * r.choice((-1, 1)) * r.uniform(0.5, 1.5)))
        w *= r.uniform(2.5, 6)
    noise = 10 ** r.uniform(-3, -1.7)  # of the greater decay's first reading
    size = 10 ** r.uniform(-1.5, -0.3)
    m, w, _, _ = modes[0]
    x0 = 20 / (m * w * w)
    if truth == "higher-mode":
        modes[-1] = modes[-1][:3] + (modes[-1][3] * size,)
    n = int(min(6, 40 * 2 * math.pi / w * 2) / DT)
    with open(folder + "/rig.toml", "w") as f:
        f.write("unrig_rig = 1\n")
        for m, w, z, gain in modes[:known]:
            f.write(f'[[modal]]\nmass = "{m} kg"\nfrequency = "{w / 2 / math.pi * r.uniform(0.995, 1.005)} Hz"\ndamping_ratio = {z * r.uniform(0.7, 1.4)}\ngauge_gain = "{gain} N/m"\n')
    for name, share in (("one", 1.0), ("two", r.uniform(0.3, 0.7))):
        y = decay(modes, x0 * share, law(truth, size, modes[0][0], modes[0][1], x0), n)
        sigma = noise * 20
        phase = r.uniform(0, 2 * math.pi)
        with open(f"{folder}/{name}.csv", "w") as f:
            f.write("# unrig_run = 1\n# kind = \"pluck\"\n# medium = \"air\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n")
            for i, reading in enumerate(y):
                hum = 4 * size * sigma * math.sin(2 * math.pi * 50.03 * i * DT + phase) if truth == "mains-hum" else 0
                f.write(f"{i * DT:.6g},{reading + hum + r.gauss(0, sigma):.8g}\n")
    return truth, size / noise


def verdict(program, folder, candidates):
    out = folder + "/d.json"
    if os.path.exists(out):
        os.remove(out)
    done = subprocess.run([program, "diagnose", "--anyway", "--threads", "1", "--effects", candidates, "--rig", folder + "/rig.toml", folder + "/one.csv", folder + "/two.csv", "-o", out],
                          capture_output=True, text=True)
    if not os.path.exists(out):
        return "error " + str(done.returncode) + " " + done.stderr.strip()[:200].replace("\n", " ")
    d = json.load(open(out))
    names = sorted(m["effect"] for m in d["missing"])
    return "+".join(names) + ("+unexplained" if d["unexplained"] else "") or "nothing"


def main():
    program, first, last = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    table = open(sys.argv[4], "a") if len(sys.argv) > 4 else sys.stdout
    for seed in range(first, last):
        with tempfile.TemporaryDirectory() as folder:
            truth, size = campaign(seed, folder)
            print(seed, truth, f"{size:.3g}", *(verdict(program, folder, c).replace(" ", "_") for c in SETS.values()), sep="\t", file=table, flush=True)


if __name__ == "__main__":
    main()
