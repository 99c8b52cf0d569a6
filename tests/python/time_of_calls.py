"""python3 time_of_calls.py UNRIG SAMPLE_CAMPAIGN [TIMES], with the package on PYTHONPATH: seconds of the processor that calls cost in Python and as commands, in turn; the least of TIMES (7) counts.

The import is not counted. A command starts a process and reads and writes files: that is counted, and so is reading in Python. Run by hand, with one thread: not a test.
"""
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import unrig

program, campaign, times = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 7
rig = str(campaign / "rig.toml")
runs = [str(campaign / name) for name in ("dry_pluck.csv", "wet_pluck.csv", "step_a.csv", "step_b.csv", "step_c.csv")]
drag = [str(campaign.parent / "drag" / name) for name in ("rig.toml", "dry_pluck.csv", "wet_pluck.csv", "step_a.csv", "step_b.csv", "step_c.csv")]
unrig.use_threads(1)


def of_children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measured(clock, call):
    begun = clock()
    call()
    return clock() - begun


with tempfile.TemporaryDirectory() as folder:
    fit = f"{folder}/fit.json"
    calls = {"fit": (["--rig", rig, *runs, "-o", fit], lambda: unrig.fit(rig, runs)),
             "correct": (["--rig", rig, "--fit", fit, runs[2], "-o", f"{folder}/corrected.csv"], lambda: unrig.correct(rig, fit, runs[2])),
             "diagnose": (["--rig", drag[0], *drag[1:], "--effects", "quadratic-drag", "-o", f"{folder}/diagnosis.json"], lambda: unrig.diagnose(drag[0], drag[1:], effects=["quadratic-drag"]))}
    print("call      command [s]  Python [s]  Python over command [%]")
    for verb, (words, call) in calls.items():
        threads = [] if verb == "correct" else ["--threads", "1"]
        command, python = [], []
        for _ in range(times):
            command.append(measured(of_children, lambda: subprocess.run([program, verb, *words, *threads, "--quiet"], check=True)))
            python.append(measured(time.process_time, call))
        print(f"{verb:9} {min(command):11.3f} {min(python):11.3f} {100 * (min(python) / min(command) - 1):+20.1f}", flush=True)
