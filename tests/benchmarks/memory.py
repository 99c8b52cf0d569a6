#!/usr/bin/env python3
"""Peak memory of the commands on long records, as the table of README.md beside this file.

  python3 tests/benchmarks/memory.py build/unrig [samples ...]

Made for it: a pitch step and the rest behind it, a free decay, a sine of 1.5 Hz without a rest, and twenty steps with rests between, 2 ms a sample, of the rig of
sample_data/campaigns/null, with its noise (0.03 N, 0.01 degrees). Peak: the largest resident set of the process (getrusage). Without samples: 100 000 and 1 000 000.
"""
import math
import os
import pathlib
import random
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
RIG = ROOT / "sample_data/campaigns/null/rig.toml"
DT = 0.002
STEP_HEAD = '# unrig_run = 1\n# kind = "step"\n# medium = "water"\n# density = "998.2 kg/m^3"\n# speed = "0.6 m/s"\ntime [s],alpha [deg]\n'
PLUCK_HEAD = '# unrig_run = 1\n# kind = "pluck"\n# medium = "air"\n# density = "1.2 kg/m^3"\n# speed = "0 m/s"\ntime [s],alpha [deg]\n'
MAP = """unrig_import = 1
[run]
kind = "step"
medium = "water"
density = "998.2 kg/m^3"
speed = "0.6 m/s"
[time]
source = "time"
[[column]]
name = "alpha"
source = "alpha"
[[column]]
name = "gauge"
source = "gauge"
[format]
skip_lines = 5
"""


def ramp(x):
    """From 0 to 1 in 0 <= x <= 1, at rest at either end."""
    x = min(max(x, 0.0), 1.0)
    return x**4 * (35 + x * (-84 + x * (70 - 20 * x)))


def peak_of(command):
    """Peak memory [MB] and processor time [s] of one command; ends the script where it fails."""
    log = tempfile.TemporaryFile()
    child = os.posix_spawn(command[0], [str(c) for c in command], os.environ, file_actions=[(os.POSIX_SPAWN_DUP2, log.fileno(), 1), (os.POSIX_SPAWN_DUP2, log.fileno(), 2)])
    _, status, usage = os.wait4(child, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        log.seek(0)
        sys.exit(f"{' '.join(str(c) for c in command)}\n{log.read().decode()}")
    return usage.ru_maxrss / 1024, usage.ru_utime + usage.ru_stime


def main():
    unrig = os.path.abspath(sys.argv[1])
    sizes = [int(n) for n in sys.argv[2:]] or [100_000, 1_000_000]
    chance = random.Random(1)
    with tempfile.TemporaryDirectory() as folder:
        at = pathlib.Path(folder)

        def motion(name, head, angle, samples):
            with open(at / name, "w") as out:
                out.write(head)
                out.writelines(f"{k * DT:.3f},{angle(k * DT):.6f}\n" for k in range(samples))

        def record(motion_name, name, *options):
            """Simulated, then read with noise."""
            memory = peak_of([unrig, "simulate", "--rig", RIG, "--run", at / motion_name, "-o", at / "clean.csv", *options])
            lines = open(at / "clean.csv")
            with open(at / name, "w") as out:
                columns = None
                for line in lines:
                    if line.startswith("#"):
                        out.write(line)
                    elif columns is None:
                        titles = line.strip().split(",")
                        columns = [titles.index(t) for t in ("time [s]", "alpha [deg]", "gauge [N]")]
                        out.write("time [s],alpha [deg],gauge [N]\n")
                    else:
                        t, alpha, gauge = (line.split(",")[c] for c in columns)
                        out.write(f"{t},{float(alpha) + chance.gauss(0, 0.01):.4f},{float(gauge) + chance.gauss(0, 0.03):.5f}\n")
            return memory

        print("peak memory [MB] (processor time [s])")
        for samples in sizes:
            seconds = samples * DT
            motion("step_motion.csv", STEP_HEAD, lambda t: 2 + 1.3 * ramp((t - 1) / 0.1), samples)
            motion("decay_motion.csv", PLUCK_HEAD, lambda t: 0.0, 2500)
            motion("sine_motion.csv", STEP_HEAD, lambda t: 4 + 2 * (1 - math.cos(2 * math.pi * 1.5 * t)), samples)
            motion("steps_motion.csv", STEP_HEAD, lambda t: 2 + sum(ramp((t - (k + 0.5) * seconds / 20) / 0.1) for k in range(20)) / 4, samples)
            rows = {"simulate": record("step_motion.csv", "step.csv")}
            record("decay_motion.csv", "decay.csv", "--release-load", "20 N")
            for name in ("sine", "steps"):
                record(f"{name}_motion.csv", f"{name}.csv")
            (at / "map.toml").write_text(MAP)
            rows["import"] = peak_of([unrig, "import", at / "step.csv", "--map", at / "map.toml", "-o", at / "imported.csv"])
            rows["fit (and a decay)"] = peak_of([unrig, "fit", "--rig", RIG, at / "decay.csv", at / "step.csv", "-o", at / "fit.json"])
            for name, title in (("step", "correct"), ("sine", "correct, a sine of 1.5 Hz"), ("steps", "correct, twenty steps")):
                rows[title] = peak_of([unrig, "correct", "--rig", RIG, "--fit", at / "fit.json", at / f"{name}.csv", "-o", at / f"{name}_corrected.csv"])
            rows["report of the fit"] = peak_of([unrig, "report", at / "fit.json", "-o", at / "report.html"])
            rows["report of the correction"] = peak_of([unrig, "report", at / "step_corrected.csv", "-o", at / "report.html"])
            print(f"{samples} samples ({os.path.getsize(at / 'step.csv') / 1e6:.0f} MB in, {os.path.getsize(at / 'step_corrected.csv') / 1e6:.0f} MB out):")
            for title, (memory, cpu) in rows.items():
                print(f"  {title:28} {memory:6.0f} ({cpu:.1f})", flush=True)


if __name__ == "__main__":
    main()
