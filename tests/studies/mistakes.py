"""Mistakes that people make, and what `unrig check` says of them: named by cause, by run, in what time, and no false alarm.

    python3 tests/studies/mistakes.py build/unrig SHARED [TABLE]

SHARED: the folder that holds user_trial/mk.py and mk2.py, campaigns/ and real/ (sample_data/README.md). The two scripts make the files with mistakes from campaigns/open/null; each is checked
beside the right other runs (one bad run), and physical ones in all runs alike where they then are a mistake. Every campaign of open, concealed and open2, and every recording in real, is
checked as it is: each line `check:` there that is no count of left-out readings is a false alarm. MISTAKES.md has the results; TABLE gets a line for every call.
"""
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile

STEPS, DECAYS = ["step_a", "step_b", "step_c"], ["dry_pluck", "wet_pluck"]
RUNS = DECAYS + STEPS

# Suffix of mk.py: (what it is, runs in which it is a mistake, words one of which names the cause, a mistake in all runs too)
PHYSICAL = {
    "radlabel": ("degrees labelled rad", STEPS, "degrees", True),
    "deglabel": ("radians labelled deg", STEPS, "radians", True),
    "aflip": ("sign of the angle", STEPS, "sign of the angle", True),
    "gflip": ("sign of the gauge", STEPS, "sign of the gauge", True),
    "swap": ("columns exchanged", RUNS, "exchanged", True),
    "late": ("gauge 20 ms late", STEPS, "behind the angle|late", True),
    "gkN": ("kN for N", STEPS, "kN", True),
    "glbf": ("lbf for N", STEPS, "lbf", True),
    "ms": ("ms written as s", RUNS, "ms written as s", True),
    "slowclock": ("clock twice too slow", RUNS, "twice too slow", True),
    "speed2": ("twice the speed", STEPS, "twice the true speed", True),
    "speedft": ("ft/s written as m/s", STEPS, "ft/s", True),
    "air": ("water labelled air", ["wet_pluck"] + STEPS, "labelled air", True),
    "water": ("air labelled water", ["dry_pluck"], "labelled water", False),
    "rhog": ("g/cc written as kg/m^3", ["wet_pluck"] + STEPS, r"g/cm\^3|g/cc|labelled air", True),  # 0.998 kg/m^3 is air
    "kindpluck": ("a step labelled pluck", STEPS, "a step", False),
    "kindstep": ("a decay labelled step", DECAYS, "a free decay", False),
    "tail": ("a record without its beginning", STEPS, "without its beginning", False),
}
HARMLESS = {"goff": "gauge offset of 50 N", "aoff": "angle offset of 5 degrees", "msok": "time in ms, labelled ms"}
REFUSED = {"gv": ("gauge in V without calibration", "calibration"), "nounit": ("density without a unit", "density"), "nohead": ("no units in the header", "unit")}
# Files of mk2.py in place of step_a: words of the message, and the exit status that is wanted.
FORMAT = {
    "bom": ("", 0), "crlf": ("", 0), "degsign": ("", 0), "quoted": ("", 0), "gaugeNcommaunit": ("", 0), "mac": ("", 0),
    "nan": ("without a name", 2), "knots": ("unknown unit|did you mean|knot", 2),
    "utf16": ("UTF-8", 2), "latin1": ("UTF-8", 2), "decimalcomma": ("semicolon", 2), "semicolon": ("semicolon", 2), "tab": ("tab", 2), "empty": ("run file", 2),
    "onlymeta": ("header|row", 2), "nometa": ("unrig_run|kind|meta", 2), "truncated": ("cells|row|truncated|cut", 2), "text": ("OVERLOAD", 2), "gap": ("gap", 2), "dup": ("twice|duplicate|same time|repeat", 0),
    "back": ("increas|after", 2), "missingkey": ("speed", 2), "typokey": ("velocity|speed", 2), "badunit": ("sec2|unit", 2), "negspeed": ("negative|-0.6096", 2), "angle": ("column \"angle\"", 1), "Alpha": ("column \"Alpha\"", 1),
    "clip": ("clipped|saturat|end of its range", None), "const": ("never changes|constant|broken", None), "constalpha": ("never changes|dead|does not move|constant", None), "short": ("rows|short|samples", None),
}
RIGS = {
    "rig_typo": ("pitch_?axis", 2), "rig_nounit": ("unit", 2), "rig_nogauge": ("gauge", 2), "rig_short": ("mass|values|count", 2), "rig_mm": ("mm", 1), "rig_mass": ("kg", 1), "rig_flexscale": ("1e-3|flexib", 1),
    "rig_gauge16": ("gauge element|element", 1), "rig_cal15": ("calibration element|calibration_element|element", 1),
}


class Calls:
    def __init__(self, program, table):
        self.program, self.table, self.longest, self.rows = program, table, 0.0, []

    def check(self, rig, runs):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([self.program, "check", "--rig", rig, *runs], capture_output=True, text=True, errors="replace")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        self.longest = max(self.longest, seconds)
        said = [line for line in done.stderr.splitlines() if line.startswith("check:")]
        return done, said, seconds

    def note(self, what, where, verdict, done, said, seconds):
        text = (said or done.stderr.strip().splitlines() or ["(silent)"])[0]
        self.rows.append(f"{what}\t{where}\t{verdict}\t{done.returncode}\t{seconds:.2f} s\t{text}")
        print(self.rows[-1], file=self.table, flush=True)


def named(said, words):
    return any(re.search(words, line) for line in said)


def main():
    program, shared = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    table = open(sys.argv[3], "w") if len(sys.argv) > 3 else sys.stdout
    calls = Calls(program, table)
    with tempfile.TemporaryDirectory() as folder:
        base, made = os.path.join(folder, "base"), os.path.join(folder, "made")
        shutil.copytree(os.path.join(shared, "campaigns", "open", "null"), base)
        os.mkdir(made)
        shutil.copy(os.path.join(base, "rig.toml"), made)
        for script in ("mk.py", "mk2.py"): subprocess.run([sys.executable, os.path.join(shared, "user_trial", script)], cwd=made, check=True)
        rig, right = os.path.join(base, "rig.toml"), {run: os.path.join(base, run + ".csv") for run in RUNS}

        def beside(bad, suffix):
            runs = dict(right)
            for run in bad:
                runs[run] = os.path.join(folder, run + ".csv")  # under the name of the run
                shutil.copy(os.path.join(made, f"{run}_{suffix}.csv"), runs[run])
            return list(runs.values())

        one = {"calls": 0, "cause": 0, "run": 0}
        every = {"calls": 0, "cause": 0}
        for suffix, (what, where, words, in_all) in PHYSICAL.items():
            for run in where:
                done, said, seconds = calls.check(rig, beside([run], suffix))
                lines = [line for line in said if line.startswith(f"check: {run}.csv:")]
                others = [line for line in said if not line.startswith(f"check: {run}.csv:")]
                cause, guilty = named(lines, words), bool(lines) and not others
                one["calls"] += 1
                one["cause"] += cause
                one["run"] += guilty
                calls.note(what, run, "named" if cause and guilty else "run only" if guilty else "cause only" if cause else "MISSED", done, said, seconds)
            if in_all:
                bad = [run for run in where if os.path.exists(os.path.join(made, f"{run}_{suffix}.csv"))]
                if suffix in ("speed2", "speedft"): bad = STEPS
                done, said, seconds = calls.check(rig, beside(bad, suffix))
                cause = named(said, words)
                every["calls"] += 1
                every["cause"] += cause
                calls.note(what, "all of its runs", "named" if cause else "MISSED", done, said, seconds)
        harmless = {"calls": 0, "silent": 0}
        for suffix, what in HARMLESS.items():
            for bad in [[run] for run in RUNS] + [RUNS]:
                if not all(os.path.exists(os.path.join(made, f"{run}_{suffix}.csv")) for run in bad): continue
                done, said, seconds = calls.check(rig, beside(bad, suffix))
                harmless["calls"] += 1
                harmless["silent"] += not said and done.returncode == 0
                calls.note(what, ", ".join(bad), "silent" if not said else "FALSE ALARM", done, said, seconds)
        forms = {"calls": 0, "right": 0}
        for suffix, (what, words) in REFUSED.items():
            done, said, seconds = calls.check(rig, beside(["step_a"], suffix))
            right_so = done.returncode in (1, 2) and re.search(words, done.stderr)
            forms["calls"] += 1
            forms["right"] += bool(right_so)
            calls.note(what, "step_a", "named" if right_so else "MISSED", done, said, seconds)
        for name, (words, status) in FORMAT.items():
            shutil.copy(os.path.join(made, name + ".csv"), os.path.join(folder, "step_a.csv"))
            done, said, seconds = calls.check(rig, [os.path.join(folder, "step_a.csv")] + [right[r] for r in RUNS if r != "step_a"])
            right_so = (status is None or done.returncode == status) and (not words or re.search(words, done.stderr))
            forms["calls"] += 1
            forms["right"] += bool(right_so)
            calls.note(name, "step_a", "right" if right_so else "MISSED", done, said, seconds)
        rigs = {"calls": 0, "cause": 0}
        for name, (words, status) in RIGS.items():
            done, said, seconds = calls.check(os.path.join(made, name + ".toml"), list(right.values()))
            cause = done.returncode == status and (re.search(words, done.stderr) if status == 2 else named(said, words))
            rigs["calls"] += 1
            rigs["cause"] += bool(cause)
            calls.note(name, "rig file", "named" if cause else "MISSED", done, said, seconds)

        alarms, campaigns, recordings = [], 0, 0
        for collection in ("open", "concealed", "open2"):
            for campaign in sorted(os.listdir(os.path.join(shared, "campaigns", collection))):
                at = os.path.join(shared, "campaigns", collection, campaign)
                if not os.path.isdir(at): continue
                done, said, seconds = calls.check(os.path.join(at, "rig.toml"), [os.path.join(at, run + ".csv") for run in RUNS + ["heldout"]])
                campaigns += 1
                wrong = [line for line in said if "left out" not in line] or done.returncode != 0
                if wrong: alarms.append(f"{collection}/{campaign}")
                calls.note(f"{collection}/{campaign}", "as it is", "FALSE ALARM" if wrong else "silent" if not said else "left out", done, said, seconds)
        for rig_name in sorted(os.listdir(os.path.join(shared, "real"))):
            at = os.path.join(shared, "real", rig_name)
            for name in sorted(os.listdir(at)):
                if not name.endswith(".csv"): continue
                done, said, seconds = calls.check(os.path.join(at, "rig.toml"), [os.path.join(at, name)])
                recordings += 1
                wrong = [line for line in said if "left out" not in line] or done.returncode != 0
                if wrong: alarms.append(f"real/{rig_name}/{name}")
                calls.note(f"real/{rig_name}", name, "FALSE ALARM" if wrong else "silent" if not said else "left out", done, said, seconds)
    share = lambda c, key: f"{c[key]} of {c['calls']} ({100 * c[key] / c['calls']:.0f} %)"
    print("one bad run: cause", share(one, "cause") + ", run", share(one, "run"))
    print("in all runs: cause", share(every, "cause"))
    print("rig files:   cause", share(rigs, "cause"))
    print("of format:   right", share(forms, "right"))
    print("harmless:   silent", share(harmless, "silent"))
    print(f"false alarms: {len(alarms)} in {campaigns} campaigns and {recordings} recordings", *alarms)
    print(f"longest: {calls.longest:.2f} s of processor time")


main()
