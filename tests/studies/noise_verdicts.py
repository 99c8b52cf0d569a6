"""Noise is no effect: what does `diagnose` name in noise of nine colours, with nothing hidden and with one effect hidden?

    python3 tests/studies/noise_verdicts.py build/unrig CAMPAIGNS SEEDS [TABLE]

CAMPAIGNS: a folder of campaigns (null, wave, ...), by a simulator that shares no code with the program. Their five runs, and noise of 0.03 N r.m.s. beside what they have, of each colour of coloured_noise.py, SEEDS
times. The run that is held out is not used. Per campaign and colour: how often the verdict was right, a name was wrong or too many, `unexplained`, nothing missing; median and longest processor time.
NOISE_VERDICTS.md has the results; TABLE gets every verdict.
"""
import json
import os
import random
import resource
import subprocess
import sys
import tempfile

from coloured_noise import COLOURS, NOISE, RUNS

HIDDEN = {"null": [], "wave": ["tank-wave"], "friction": ["coulomb-friction"], "drag": ["quadratic-drag"], "highermode": ["higher-mode"], "lowpass": ["gauge-lowpass"]}
LIMIT = 300  # s of processor time, behind which there is no verdict


def noisy(source, target, name, noise):
    with open(os.path.join(source, name + ".csv")) as f:
        lines = f.read().splitlines()
    head = [line for line in lines if line.startswith("#")]
    rows = [line.split(",") for line in lines[len(head) + 1:]]
    drawn = noise(len(rows))
    with open(os.path.join(target, name + ".csv"), "w") as f:
        f.write("\n".join(head + [lines[len(head)]] + [f"{r[0]},{r[1]},{float(r[2]) + NOISE * e:.6f}" for r, e in zip(rows, drawn)]) + "\n")


def verdict(unrig, rig, there):
    out = os.path.join(there, "d.json")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([unrig, "diagnose", "--threads", "1", "--rig", rig] + [os.path.join(there, r + ".csv") for r in RUNS] + ["-o", out], capture_output=True,
                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT)))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if not os.path.exists(out):
        return ["no verdict"], False, seconds
    with open(out) as f:
        d = json.load(f)
    return sorted(m["effect"] for m in d["missing"]), d["unexplained"], seconds


def main():
    unrig, folder, seeds = os.path.abspath(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    table = open(sys.argv[4], "w") if len(sys.argv) > 4 else None
    print("| campaign | noise | right | wrong name | unexplained | nothing | processor time, median and longest [s] |\n| --- | --- | --- | --- | --- | --- | --- |")
    for campaign, hidden in HIDDEN.items():
        if not os.path.isdir(os.path.join(folder, campaign)):
            continue
        for colour, make in COLOURS.items():
            right = wrong = unexplained = nothing = 0
            times = []
            for seed in range(seeds):
                with tempfile.TemporaryDirectory() as there:
                    for run in RUNS:
                        noisy(os.path.join(folder, campaign), there, run, lambda n: make(n, random.Random(f"verdict {campaign} {colour} {run} {seed}")))
                    named, something, seconds = verdict(unrig, os.path.join(folder, campaign, "rig.toml"), there)
                if table:
                    print(campaign, colour, seed, "+".join(named), something, f"{seconds:.1f}", sep="\t", file=table, flush=True)
                times.append(seconds)
                is_right = named == hidden and not something
                right += is_right
                wrong += not set(named) <= set(hidden) or (bool(hidden) and len(named) > len(hidden))
                unexplained += not named and something
                nothing += not named and not something and bool(hidden)
            print(f"| {campaign} | {colour} | {right} of {seeds} | {wrong} | {unexplained} | {nothing} | {sorted(times)[len(times) // 2]:.1f}, {max(times):.1f} |", flush=True)


if __name__ == "__main__":
    main()
