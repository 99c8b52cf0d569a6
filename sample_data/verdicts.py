#!/usr/bin/env python3
"""Verdicts of `unrig diagnose` on a folder of campaigns as a table.

  python3 sample_data/verdicts.py build/unrig sample_data/concealed [RESULTS] > VERDICTS.md

Each campaign is a folder with rig.toml, runs (*.csv) and heldout.csv; truth_*.csv are not read. What `diagnose` says is written down as it comes out;
what was true stands beside it where the folder has a KEY.json, which is opened for that column only. The search ends by its counted work, whatever the machine's speed. RESULTS: a
folder for what `diagnose` writes, NAME.json.gz.
"""
import datetime
import gzip
import json
import pathlib
import subprocess
import sys
import tempfile

LIMIT = 1800  # seconds a campaign


def diagnose(unrig, folder, results=None):
    runs = sorted(p for p in folder.glob("*.csv") if p.name != "heldout.csv" and not p.name.startswith("truth"))
    with tempfile.TemporaryDirectory() as scratch:
        output = pathlib.Path(scratch) / "diagnosis.json"
        command = [unrig, "diagnose", "--rig", folder / "rig.toml", *runs, "--heldout", folder / "heldout.csv", "--limit", "inf", "-o", output]
        try:
            subprocess.run([str(c) for c in command], capture_output=True, timeout=LIMIT, check=False)
        except subprocess.TimeoutExpired:
            return None
        if not output.exists():
            return None
        if results:
            results.mkdir(parents=True, exist_ok=True)
            (results / f"{folder.name}.json.gz").write_bytes(gzip.compress(output.read_bytes(), mtime=0))
        return json.loads(output.read_text())


def truth(key, name):
    """The last column: effects and parameters of KEY.json; empty where there is none."""
    if key is None:
        return ""
    said = key[name]
    numbers = "; ".join(f"{k} {v:.4g}" for k, v in said["parameters"].items() if isinstance(v, (int, float)))
    return f" {', '.join(said['effects']) or 'nothing'}{': ' if numbers else ''}{numbers} |"


def row(name, d, key):
    if d is None:
        return f"| {name} | no verdict within {LIMIT} s | | | | | |{truth(key, name)}"
    name_of = lambda m: f"law: {m['law']['name']}, {m['equation']}".replace("|", "\\|") if m["effect"] == "law" else m["effect"]
    found = ", ".join(f"{name_of(m)} ({m['probability']:.3f})" for m in d["missing"]) or ("unexplained" if d["unexplained"] else "nothing missing")
    if d["missing"] and d["unexplained"]:
        found += "; something remains"
    if d["equivalent"]:
        found += "; cannot be told from " + ", ".join(" + ".join(other) for other in d["equivalent"])
    found += "; stopped" if d.get("stopped") else ""
    parameters = "; ".join(
        f"{p['name'].split('.', 1)[1]} {p['value']:.5g}" + (f" ± {p['std_error']:.2g}" if p["std_error"] is not None else "") + f" {p['unit']}"
        for m in d["missing"] for p in m["parameters"] if "run" not in p)
    fitted = [r for r in d["improvement"]["runs"] if not r["heldout"]]
    held = [r for r in d["improvement"]["runs"] if r["heldout"]]
    rms = lambda rows, key: (sum(r[key] ** 2 for r in rows) / len(rows)) ** 0.5
    return (f"| {name} | {found} | {parameters} | {rms(fitted, 'rms_before'):.4f} → {rms(fitted, 'rms_after'):.4f} | {rms(fitted, 'noise'):.4f} | "
            f"{rms(held, 'rms_before'):.4f} → {rms(held, 'rms_after'):.4f} | {d['improvement']['bic_after'] - d['improvement']['bic_before']:.0f} |{truth(key, name)}")


def table(named, key=None):
    known = key is not None
    print("| campaign | verdict (probability among the sets tried) | parameters | fitted, r.m.s. before → after [N] | noise [N] | held out, before → after [N] | ΔBIC |" + " true |" * known)
    print("| --- | --- | --- | --- | --- | --- | --- |" + " --- |" * known)
    for name, d in named:
        print(row(name, d, key), flush=True)


def main():
    unrig, campaigns = sys.argv[1], pathlib.Path(sys.argv[2])
    results = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else None
    print(f"{datetime.date.today()}, `python3 sample_data/verdicts.py {' '.join(sys.argv[1:])}`\n")
    answers = campaigns / "KEY.json"
    key = json.loads(answers.read_text()) if answers.exists() else None
    table(((folder.name, diagnose(unrig, folder, results)) for folder in sorted(campaigns.iterdir()) if (folder / "rig.toml").exists()), key)


if __name__ == "__main__":
    main()
