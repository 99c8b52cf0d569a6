#!/usr/bin/env python3
"""The results of several `unrig trial` as one table.

  python3 sample_data/trials.py trial_1.json trial_2.json ... > TRIAL.md
  python3 sample_data/trials.py CASES > TRIAL.md        # the folder of `unrig trial --cases`: what is there of a study that has not come to its end

Size: r.m.s. of what the hidden effect does to the run that it changes most, over the noise; of two, each beside the bare rig, the smaller one. Right: exactly what was hidden was named, or nothing where nothing
was. As good: another set was named and the hidden one was reported with it, as one that these recordings cannot tell from it.

Of `unrig trial --law`: right is the hidden law by itself, or the same under another name; wrong alone, something named without it and without it among the rivals; in company, it is named beside something that is not there.
"""
import collections
import json
import pathlib
import statistics
import sys

VISIBLE = 3  # sizes from here on count
STATED = [0, 0.5, 0.8, 0.9, 0.95, 0.99, 1]
BINS = [0, 0.3, 1, 3, 10, 30, 100, float("inf")]


def kind(trial):
    """What became of a campaign with something hidden."""
    if trial.get("failure"):
        return "failed"
    if trial["right"]:
        return "right"
    if sorted(trial["hidden"]) in [sorted(other) for other in trial["equivalent"]]:
        return "as good"
    if trial["found"] and set(trial["found"]) < set(trial["hidden"]):
        return "one of two"
    if trial["found"]:
        return "wrong"
    return "unexplained" if trial["unexplained"] else "missed"


def share(part, whole):
    return f"{part} of {whole} ({100 * part / whole:.1f} %)" if whole else "0 of 0"


def size(trial):
    """Of the smallest of what is hidden."""
    return min(trial.get("sizes") or [trial["size"]])


def nine_in_ten(trials):
    """Smallest size from which on upwards nine in ten are right."""
    smallest, right = None, 0
    for count, t in enumerate(sorted(trials, key=lambda t: -size(t)), 1):
        right += t["right"]
        if t["right"] and 10 * right >= 9 * count:
            smallest = size(t)
    return f"{smallest:.2g}" if smallest else "-"


def of_law(trial):
    """What became of a campaign with a law."""
    law = trial["law"]
    for key, name in (("equation_right", "right"), ("among_rivals", "among rivals"), ("curve", "curve"), ("in_company", "in company"), ("wrong_alone", "wrong alone")):
        if law[key]:
            return name
    return "unexplained" if law["unexplained"] else "nothing seen"


def well_held(trial):
    """Whether a run held out is left with at most 1.2 times what an exact model leaves."""
    ratio = trial["law"]["heldout_over_exact"]
    return ratio is not None and ratio <= 1.2


def held(trial):
    """Whether the set of explanations holds what is true; `something-else` is none of the others."""
    hidden = sorted(trial["hidden"])
    alike = [sorted(one) for one in trial["explanations"]]
    return hidden in alike or (trial["misread"] not in (None, "stated") and sorted([*hidden, "rig-description"]) in alike) or (bool(hidden) and ["something-else"] in alike) or trial["right"]


def seeds(results):
    return ", ".join(sorted({str(r.get("seed", "as called")) for r in results}))


def read(name):
    """A result, or the cases of a study."""
    path = pathlib.Path(name)
    if not path.is_dir():
        return json.loads(path.read_text())
    trials = [json.loads(case.read_text()) for case in path.rglob("*.json")]
    return {"trials": sorted(trials, key=lambda t: t["trial"]), **({"laws": []} if any("law" in t for t in trials) else {})}


def print_laws(results):
    """The table of `unrig trial --law`."""
    trials = [t for r in results for t in r["trials"]]
    laws = [t for t in trials if "law" in t]
    inside, outside = [t for t in laws if not t["law"]["outside"]], [t for t in laws if t["law"]["outside"]]
    decided = [t for t in laws if (t["law"]["exact_ahead"] or 0) >= 10]
    named = sorted(t["law"]["rivals"] for t in inside if t["law"]["named"])
    print(f"{len(trials)} campaigns (seeds {seeds(results)}), {sum('failure' in t for t in trials)} failed\n")
    if inside:
        clear = [t for t in decided if t in inside]
        print(f"- of the dictionary, an exact model ahead by 10 or more in twice the log likelihood: {share(len(clear), len(inside))}; of these right or among the rivals {share(sum(of_law(t) in ('right', 'among rivals') for t in clear), len(clear))}")
        print(f"- wrong alone: {share(sum(t['law']['wrong_alone'] for t in inside), len(inside))}; class right: {share(sum(t['law']['class_right'] for t in inside), len(inside))}; held out at most 1.2 times: {share(sum(map(well_held, inside)), len(inside))}")
    if named:
        print(f"- rivals where something is named: {statistics.median(named):g} in the median, {named[-1]} at most")
    if outside:
        print(f"- outside the dictionary, a curve or unexplained: {share(sum(of_law(t) in ('curve', 'unexplained') for t in outside), len(outside))}; held out at most 1.2 times: {share(sum(map(well_held, outside)), len(outside))}; both: {share(sum(of_law(t) in ('curve', 'unexplained') and well_held(t) for t in outside), len(outside))}")
    seconds = sorted(t["seconds"] for t in trials if "seconds" in t)
    if seconds:
        print(f"- a diagnosis took {seconds[len(seconds) // 2]:.0f} s in the median, {seconds[-1]:.0f} s at most")
    columns = ["right", "among rivals", "curve", "in company", "wrong alone", "unexplained", "nothing seen"]
    for what, own in (("of the dictionary", inside), ("outside the dictionary", outside)):
        if not own:
            continue
        print(f"\n| {what} | campaigns | ahead by 10 | " + " | ".join(columns) + " | named | exact ahead | held out |\n" + "| --- " * (len(columns) + 6) + "|")
        for name in sorted({t["hidden"][0] for t in own}):
            row = [t for t in own if t["hidden"] == [name]]
            count = collections.Counter(of_law(t) for t in row)
            found = ", ".join(sorted({" + ".join(t["found"]) for t in row if t["found"]})).replace("law:", "")
            each = [", ".join("-" if t["law"][key] is None else f"{t['law'][key]:.{digits}g}" for t in row) for key, digits in (("exact_ahead", 2), ("heldout_over_exact", 3))]
            print(f"| {name.removeprefix('law:')} | {len(row)} | {sum(t in decided for t in row)} | " + " | ".join(str(count[c]) for c in columns) + f" | {found} | {' | '.join(each)} |")


def main():
    results = [read(name) for name in sys.argv[1:]]
    if any("laws" in r for r in results):
        return print_laws(results)
    trials = [t for r in results for t in r["trials"]]
    nulls, hidden = [t for t in trials if not t["hidden"]], [t for t in trials if t["hidden"]]
    visible = [t for t in hidden if size(t) >= VISIBLE]
    kinds = collections.Counter(kind(t) for t in visible)
    noise = sorted({f"{r['noise']['gauge']:.3g} {r['noise']['unit']}" if "noise" in r else "as called" for r in results})
    print(f"{len(trials)} campaigns (seeds {seeds(results)}), noise {', '.join(noise)}\n")
    print(f"- nothing hidden: {share(sum(not t['right'] or t['unexplained'] for t in nulls), len(nulls))} false alarms")
    print(f"- something hidden, size {VISIBLE} or more: " + "; ".join(f"{k} {share(kinds[k], len(visible))}" for k in ("right", "as good", "one of two", "wrong", "unexplained", "missed", "failed") if kinds[k]))
    seconds = sorted(t["seconds"] for t in trials)
    print(f"- a diagnosis took {seconds[len(seconds) // 2]:.1f} s in the median, {seconds[int(0.95 * len(seconds))]:.0f} s or less in 95 of 100, {seconds[-1]:.0f} s at most (two at a time, two cores)\n")
    columns = ["right", "as good", "one of two", "wrong", "unexplained", "missed", "failed"]
    if all(len(t["hidden"]) < 2 for t in trials):
        columns.remove("one of two")
    print(f"| hidden | campaigns | size {VISIBLE} or more | " + " | ".join(columns) + " | nine in ten from size | wrong names |")
    print("| --- " * (len(columns) + 5) + "|")
    for name in sorted({" + ".join(sorted(t["hidden"])) for t in hidden}):
        own = [t for t in hidden if " + ".join(sorted(t["hidden"])) == name]
        seen = [t for t in own if size(t) >= VISIBLE]
        count = collections.Counter(kind(t) for t in seen)
        wrong = sorted({" + ".join(sorted(t["found"])) for t in seen if kind(t) == "wrong"})
        print(f"| {name} | {len(own)} | {len(seen)} | " + " | ".join(str(count[c]) for c in columns) + f" | {nine_in_ten(own)} | {', '.join(wrong)} |")
    for what, of in (("noise", lambda t: t["noise"]), ("files", lambda t: "exact" if not t["misread"] else "off as stated" if t["misread"] == "stated" else f"{t['misread'].split('.')[0]} off")):
        print(f"\n| {what} | campaigns | size {VISIBLE} or more | " + " | ".join(columns) + " |\n" + "| --- " * (len(columns) + 3) + "|")
        for name in sorted({of(t) for t in hidden}):
            own = [t for t in hidden if of(t) == name]
            count = collections.Counter(kind(t) for t in own if size(t) >= VISIBLE)
            print(f"| {name} | {len(own)} | {sum(count.values())} | " + " | ".join(str(count[c]) for c in columns) + " |")
    stated = sorted((t["probability"], t["right"]) for t in trials if t["probability"] is not None)
    if stated:
        off = 0
        print("\n| stated probability | campaigns | in the mean | right |\n| --- | --- | --- | --- |")
        for low, high in zip(STATED, STATED[1:]):
            own = [(p, right) for p, right in stated if low <= p < high or p == high == 1]
            if own:
                off += abs(sum(p for p, _ in own) - sum(right for _, right in own)) / len(stated)
                print(f"| {low:g} to {high:g} | {len(own)} | {sum(p for p, _ in own) / len(own):.3f} | {sum(right for _, right in own)} |")
        print(f"\nCalibration error, weighted by count, {off:.3f}; Brier score {sum((p - right) ** 2 for p, right in stated) / len(stated):.3f}.")
    sets = [t for t in trials if t.get("explanations")]
    if sets:
        seen = [t for t in sets if not t["hidden"] or size(t) >= VISIBLE]
        print(f"\nThe set of explanations holds the truth in {share(sum(map(held, sets)), len(sets))}, where nothing is hidden or size {VISIBLE} or more in {share(sum(map(held, seen)), len(seen))}; {statistics.mean(len(t['explanations']) for t in sets):.2f} members on the mean.")
    for what, of in (("", trials), (" of campaigns with exact files", [t for t in trials if not t["misread"]]), (" of campaigns whose files state what they are off by", [t for t in trials if t["misread"] == "stated"])):
        deviations = [abs(p["value"] - p["truth"]) / p["std_error"] for t in of for p in t.get("named", [])]
        if deviations:
            print(f"\nIntervals of parameters of hidden effects that were named{what}: 68 % hold the truth in {share(sum(d < 1 for d in deviations), len(deviations))}, 95 % in {share(sum(d < 1.96 for d in deviations), len(deviations))}.")
    print("\n| size | campaigns | " + " | ".join(columns) + " |\n" + "| --- " * (len(columns) + 2) + "|")
    for low, high in zip(BINS, BINS[1:]):
        own = [t for t in hidden if low <= size(t) < high]
        count = collections.Counter(kind(t) for t in own)
        print(f"| {low:g} to {high:g} | {len(own)} | " + " | ".join(f"{100 * count[c] / len(own):.0f} %" if own else "-" for c in columns) + " |")


if __name__ == "__main__":
    main()
