"""Does the run that `propose` names decide between two laws that the runs at hand cannot tell apart?

    python3 tests/studies/proposed_runs.py build/unrig PAIR CAMPAIGNS RUNS [TABLE]

PAIR: `damping`, |v|^1.5 sgn(v) or tanh(v/v0), or `stiffness`, |x| x or a spring that saturates, beside the damping and stiffness of a rig of one mode (2 kg, 5 Hz). Either law is the truth of CAMPAIGNS campaigns of three
free decays from small loads, by a Runge-Kutta integrator that shares no code with the program. Both laws are fitted (`fit --law`, from both signs), and what they find goes into a diagnosis as rivals. `propose` names a run.
That run is simulated with the truth RUNS times, with noise of its own each, and the first run at hand is repeated as often; both laws are fitted to all. A run decides where the true law then leads by 5 in log odds (half
the difference of BIC, each run with its own variance). PROPOSED_RUNS.md has the results; TABLE gets every run.
"""
import json
import math
import os
import random
import subprocess
import sys
import tempfile
import time

MASS, HERTZ, RATIO, GAIN = 2.0, 5.0, 0.005, 1000.0
DT, SAMPLES, NOISE = 0.005, 800, 0.03
STIFFNESS = MASS * (2 * math.pi * HERTZ) ** 2
DAMPING = 2 * RATIO * MASS * 2 * math.pi * HERTZ
LOADS = [6.0, 4.0, 5.0]  # N
LARGEST = 60.0           # N, what the laboratory can pluck with
DECIDED = 5.0

RIG = f"""unrig_rig = 1
name = "oscillator"
[[modal]]
mass = "{MASS} kg"
frequency = "{HERTZ} Hz"
damping_ratio = {RATIO}
gauge_gain = "{GAIN} N/m"
"""
LIMITS = f"""unrig_limits = 1
pluck_load = "{LARGEST} N"
"""


def law(name, force, parameters):
    return f'unrig_law = 1\nname = "{name}"\nacts_on = "normal"\nforce = "{force}"\n[parameters]\n' + "".join(f"{k} = {v}\n" for k, v in parameters.items())


def sign(x):
    return (x > 0) - (x < 0)


# Each rival: its file with first guesses, and the force as it truly is.
PAIRS = {
    "damping": [
        (law("power", "-c * abs(v)^1.5 * sign(v)", {"c": '{ start = "%(c).6g N.s^1.5/m^1.5" }'}), {"c": 1.0}, lambda x, v: -1.0 * abs(v) ** 1.5 * sign(v)),
        (law("tanh", "-f * tanh(v / w)", {"f": '{ start = "%(f).6g N" }', "w": '{ start = "%(w).6g m/s", lower = "0.02 m/s", upper = "2 m/s" }'}), {"f": 0.2, "w": 0.2}, lambda x, v: -0.2 * math.tanh(v / 0.2)),
    ],
    "stiffness": [
        (law("square", "-k * abs(x) * x", {"k": '{ start = "%(k).6g N/m^2" }'}), {"k": 4e2}, lambda x, v: -4e2 * abs(x) * x),
        (law("saturates", "-f * tanh(x / l)", {"f": '{ start = "%(f).6g N" }', "l": '{ start = "%(l).6g m", lower = "0.5 mm", upper = "50 mm" }'}), {"f": 0.3, "l": 0.006}, lambda x, v: -0.3 * math.tanh(x / 0.006)),
    ],
}


def decay(force, load, draw):
    """Readings of a free decay from the load: classical Runge-Kutta, four steps a sample."""
    finer, x, v = 4, load / STIFFNESS, 0.0
    h = DT / finer

    def acceleration(a, b):
        return (force(a, b) - DAMPING * b - STIFFNESS * a) / MASS

    readings = []
    for _ in range(SAMPLES):
        readings.append(GAIN * x + NOISE * draw.gauss(0, 1))
        for _ in range(finer):
            k1x, k1v = v, acceleration(x, v)
            k2x, k2v = v + h / 2 * k1v, acceleration(x + h / 2 * k1x, v + h / 2 * k1v)
            k3x, k3v = v + h / 2 * k2v, acceleration(x + h / 2 * k2x, v + h / 2 * k2v)
            k4x, k4v = v + h * k3v, acceleration(x + h * k3x, v + h * k3v)
            x += h / 6 * (k1x + 2 * k2x + 2 * k3x + k4x)
            v += h / 6 * (k1v + 2 * k2v + 2 * k3v + k4v)
    return readings


def write(path, text):
    with open(path, "w") as f:
        f.write(text)


def write_run(path, readings):
    head = '# unrig_run = 1\n# kind = "pluck"\n# density = "1.2 kg/m^3"\n# speed = "0 m/s"\ntime [s],gauge [N]\n'
    write(path, head + "".join(f"{k * DT:.6g},{r:.6f}\n" for k, r in enumerate(readings)))


class Campaign:
    def __init__(self, unrig, there):
        self.unrig, self.there = unrig, there

    def call(self, *words):
        return subprocess.run([self.unrig, *words, "--threads", "1"], cwd=self.there, capture_output=True, text=True)

    def fit(self, law_texts, runs, out):
        """The best of the fits from several first guesses."""
        fits = []
        for text in law_texts:
            write(os.path.join(self.there, "law.toml"), text)
            self.call("fit", "--anyway", "--rig", "rig.toml", "--law", "law.toml", *runs, "-o", out)
            with open(os.path.join(self.there, out)) as f:
                fits.append(json.load(f))
        return min(fits, key=cost)


def found(template, fit):
    values = {p["name"].split(".")[-1]: p["value"] for p in fit["parameters"] if p["name"].startswith("law:")}
    return template % values


def guesses(k, pair):
    """A law pushes or pulls."""
    template, start, _ = PAIRS[pair][k]
    size = next(iter(start))
    return [template % {**start, size: sign * start[size]} for sign in (1, -1)]


def cost(fit):
    """BIC with the variance of each run's noise as the fit leaves it, as `diagnose` compares."""
    samples = sum(run["samples"] for run in fit["runs"])
    return sum(2 * run["samples"] * math.log(run["rms_residual"]) for run in fit["runs"]) + fit["variables"] * math.log(samples)


def log_odds(fits, truth):
    return 0.5 * (cost(fits[1 - truth]) - cost(fits[truth]))


def formula(template):
    return template.split('force = "')[1].split('"')[0]


def one(unrig, pair, truth, seed, count):
    laws = PAIRS[pair]
    with tempfile.TemporaryDirectory() as there:
        draw = random.Random(f"proposed runs {pair} {truth} {seed}")
        campaign = Campaign(unrig, there)
        write(os.path.join(there, "rig.toml"), RIG)
        write(os.path.join(there, "limits.toml"), LIMITS)
        runs = []
        for k, load in enumerate(LOADS):
            runs.append(f"pluck_{k + 1}.csv")
            write_run(os.path.join(there, runs[-1]), decay(laws[truth][2], load, draw))
        fits = [campaign.fit(guesses(k, pair), runs, f"fit_{k}.json") for k in (0, 1)]
        now = log_odds(fits, truth)
        best = 0 if cost(fits[0]) <= cost(fits[1]) else 1
        texts = [found(laws[k][0], fits[k]) for k in (0, 1)]
        write(os.path.join(there, "diagnosis.json"), json.dumps({"unrig": "diagnosis", "missing": [{"effect": "law", "law": {
            "acts_on": "normal", "class": pair, "force": formula(texts[best]), "text": texts[best],
            "rivals": [{"force": formula(texts[1 - best]), "distance_sigma": 1, "log_odds": abs(now), "text": texts[1 - best]}]}}], "equivalent": [], "fit": fits[best]}))
        begin = time.time()
        proposed = campaign.call("propose", "diagnosis.json", "--limits", "limits.toml", "-o", "plan.toml")
        seconds = time.time() - begin
        plan = open(os.path.join(there, "plan.toml")).read() if os.path.exists(os.path.join(there, "plan.toml")) else ""
        load = float(plan.split("[[run]]")[1].split('release_load = "')[1].split(" N")[0]) if "[[run]]" in plan else None
        outcome = {"now": now, "status": proposed.returncode, "load": load, "seconds": seconds, "report": proposed.stdout + proposed.stderr}
        if load is None:
            return outcome
        comparison = plan.split("[[comparison]]")[1]
        which = "if_first" if truth == best else "if_second"
        outcome["expected"] = float(comparison.split(f"\n{which} = ")[1].split()[0])
        for what, next_load in (("decided", load), ("repeated", LOADS[0])):
            outcome[what] = []
            for _ in range(count):
                write_run(os.path.join(there, "next.csv"), decay(laws[truth][2], next_load, draw))
                after = [campaign.fit([texts[k]], runs + ["next.csv"], f"after_{k}.json") for k in (0, 1)]
                outcome[what].append(log_odds(after, truth) - now)
        return outcome


def main():
    unrig, pair, campaigns, count = os.path.abspath(sys.argv[1]), sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    table = open(sys.argv[5], "w") if len(sys.argv) > 5 else None
    print("| truth | campaigns | undecided before | runs | decided | wrong | gain: expected, median, least | of repeating a run: median, largest | loads | `propose`, median [s] |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for truth in (0, 1):
        all_of = []
        for seed in range(campaigns):
            all_of.append(one(unrig, pair, truth, seed, count))
            if table:
                print(json.dumps({"pair": pair, "truth": truth, "seed": seed, **all_of[-1]}), file=table, flush=True)
        ran = [o for o in all_of if o["load"] is not None]
        gains, again = sorted(g for o in ran for g in o["decided"]), sorted(g for o in ran for g in o["repeated"])
        leads = [o["now"] + g for o in ran for g in o["decided"]]
        expected = sorted(o["expected"] for o in ran)
        print(f"| {formula(PAIRS[pair][truth][0])} | {campaigns} | {sum(abs(o['now']) < DECIDED for o in all_of)} | {len(leads)} | {sum(lead > DECIDED for lead in leads)} | {sum(lead < 0 for lead in leads)} "
              f"| {expected[len(expected) // 2]:.3g}, {gains[len(gains) // 2]:.3g}, {gains[0]:.3g} | {again[len(again) // 2]:.2g}, {again[-1]:.2g} | {', '.join(sorted({format(o['load'], 'g') for o in ran}))} N "
              f"| {sorted(o['seconds'] for o in all_of)[campaigns // 2]:.0f} |", flush=True)


if __name__ == "__main__":
    main()
