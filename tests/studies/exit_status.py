"""Does an exit status of 1 go with a wrong answer, and only with one? `fit` of every campaign as it is, with nothing that is missing named, and `correct` of its steps.

    python3 tests/studies/exit_status.py build/unrig FOLDER...

FOLDERs hold campaigns (rig.toml and runs). Where the true load lies beside a step (truth_*.csv), the error of the circulatory load: its r.m.s. over its range, and over the stated standard deviation.
EXIT_STATUS.md has the table.
"""
import csv
import math
import pathlib
import subprocess
import sys
import tempfile


def columns(path):
    with open(path) as f:
        rows = list(csv.reader(line for line in f if not line.startswith("#")))
    return {name.split(" [")[0]: [float(row[i] or "nan") for row in rows[1:]] for i, name in enumerate(rows[0]) if not name.startswith("made by")}


def error(corrected, truth):
    """r.m.s. over the range, and over the standard deviation, in which the first sample has none."""
    load, std, true = columns(corrected)["circulatory"], columns(corrected)["circulatory_std"], columns(truth)["circulatory"]
    pairs = [(a, s, t) for a, s, t in zip(load, std, true) if not math.isnan(a)]  # empty where no load is known
    off = math.sqrt(sum((a - t) ** 2 for a, _, t in pairs) / len(pairs))
    scaled = [((a - t) / s) ** 2 for a, s, t in pairs if s > 0]
    return off / (max(true) - min(true)), math.sqrt(sum(scaled) / len(scaled))


def main():
    program = sys.argv[1]
    print("| campaign | fit | step | correct | error of the load, % of its range | over its standard deviation |\n| --- | --- | --- | --- | --- | --- |")
    for rig in sorted(path for folder in sys.argv[2:] for path in pathlib.Path(folder).glob("*/rig.toml")):
        campaign = rig.parent
        runs = [path for path in sorted(campaign.glob("*.csv")) if not path.name.startswith(("truth_", "heldout"))]
        with tempfile.TemporaryDirectory() as out:
            fit = pathlib.Path(out) / "fit.json"
            status = subprocess.run([program, "fit", "--quiet", "--rig", rig, *runs, "-o", fit], capture_output=True).returncode
            for step in sorted(path for path in campaign.glob("*.csv") if path.name.startswith(("step", "heldout"))):
                corrected, truth = pathlib.Path(out) / "corrected.csv", campaign / f"truth_{step.name}"
                corrected.unlink(missing_ok=True)
                done = subprocess.run([program, "correct", "--quiet", "--rig", rig, "--fit", fit, step, "-o", corrected], capture_output=True).returncode if fit.exists() else "-"
                off, scaled = error(corrected, truth) if truth.exists() and corrected.exists() else (math.nan, math.nan)
                words = ("", "") if math.isnan(off) else (f"{100 * off:.2f}", f"{scaled:.2f}")
                print(f"| {campaign.name} | {status} | {step.stem} | {done} | {words[0]} | {words[1]} |", flush=True)


if __name__ == "__main__":
    main()
