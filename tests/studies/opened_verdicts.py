#!/usr/bin/env python3
"""What `unrig diagnose` says of the opened campaigns beside what is true of them, and the processor time that it takes.

  python3 tests/studies/opened_verdicts.py build/unrig CAMPAIGNS SECONDS [NAME ...] > OPENED.md

CAMPAIGNS holds `open`, `concealed` and `open2`, each with a KEY.json; SECONDS goes to --limit. Names: these campaigns only. One after the other; the keys are opened for the second column only.
"""
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

FOLDERS = ("open", "concealed", "open2")


def campaigns(root, names):
    for folder in FOLDERS:
        key = json.loads((root / folder / "KEY.json").read_text())
        key = key.get("campaigns", key)
        for path in sorted((p for p in (root / folder).iterdir() if (p / "rig.toml").exists()), key=lambda p: (p.name[0], len(p.name), p.name)):
            if not names or path.name in names:
                yield path, key.get(path.name, {}).get("effects", [])


def diagnose(unrig, folder, seconds):
    """The diagnosis, or None, and processor time."""
    runs = sorted(p for p in folder.glob("*.csv") if not p.name.startswith(("truth", "heldout")))
    held = [argument for p in sorted(folder.glob("heldout*.csv")) for argument in ("--heldout", p)]
    with tempfile.TemporaryDirectory() as scratch:
        output = pathlib.Path(scratch) / "diagnosis.json"
        command = [unrig, "diagnose", "--quiet", "--limit", seconds, "--rig", folder / "rig.toml", *runs, *held, "-o", output]
        process = subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        used = os.wait4(process.pid, 0)[2]
        return json.loads(output.read_text()) if output.exists() else None, used.ru_utime + used.ru_stime


def said(d):
    if d is None:
        return "no answer"
    text = " and ".join(f"law: {m['law']['name']}" if m["effect"] == "law" else m["effect"] for m in d["missing"]) or ("unexplained" if d["unexplained"] else "nothing")
    text += "; something remains" if d["missing"] and d["unexplained"] else ""
    text += "; cannot be told from " + ", ".join(" + ".join(other) for other in d["equivalent"]) if d["equivalent"] else ""
    return text + ("; stopped" if d.get("stopped") else "")


def main():
    unrig, root, seconds, names = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3], sys.argv[4:]
    print("| campaign | true | said | multiplications [1e9] | processor time [s] |\n| --- | --- | --- | --- | --- |")
    times, works = [], []
    for folder, effects in campaigns(root, names):
        d, used = diagnose(unrig, folder, seconds)
        times.append(used)
        works.append(d["work"] if d else 0)
        print(f"| {folder.name} | {', '.join(effects) or 'nothing'} | {said(d)} | {works[-1]:.1f} | {used:.1f} |", flush=True)
    print(f"\n{len(times)} campaigns: median {statistics.median(times):.1f} s, 95 of 100 below {sorted(times)[min(len(times) - 1, int(0.95 * len(times)))]:.1f} s, longest {max(times):.1f} s; {sum(works):.0f}e9 multiplications, median {statistics.median(works):.1f}e9.")


if __name__ == "__main__":
    main()
