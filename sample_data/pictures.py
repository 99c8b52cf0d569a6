#!/usr/bin/env python3
"""Draws the README's pictures from the sample campaigns, by running unrig on them: pictures.py [DIRECTORY], from the top folder.

UNRIG names another program than build/unrig. Needs Matplotlib, which brings NumPy and Pillow (Debian: python3-matplotlib).
"""
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

CAMPAIGNS = Path(__file__).resolve().parent / "campaigns"
FITTED = ["dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"]
# Okabe and Ito's colours, told apart by colour-blind readers.
GREY, ORANGE, BLUE, BLACK = "#8c8c8c", "#d55e00", "#0072b2", "#000000"


def unrig(*words):
    subprocess.run([os.environ.get("UNRIG", "build/unrig"), *map(str, words)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def columns(path):
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    names = [name.split(" [")[0] for name in lines[0].split(",")]
    return dict(zip(names, np.genfromtxt(lines[1:], delimiter=",").T))


def fit(campaign, out, *options):
    folder = CAMPAIGNS / campaign
    unrig("fit", "--rig", folder / "rig.toml", *(folder / f"{run}.csv" for run in FITTED), *options, "-o", out)
    return out


def residual(fitted, run):
    """Time and residual of the gauge, as the report of the fit draws them."""
    page = fitted.with_suffix(".html")
    unrig("report", fitted, "-o", page)
    blocks = json.loads(re.search(r'id="report-data">(.*?)</script>', page.read_text(), re.S)[1])["blocks"]
    first = next(i for i, block in enumerate(blocks) if block.get("title") == f"Recording: {run}.csv")
    plot = next(block for block in blocks[first:] if block.get("title") == "gauge: residual")
    return np.array(plot["x"]), np.array(next(s["v"] for s in plot["series"] if s["name"] == "residual"), dtype=float)


def save(figure, picture):
    """With 128 colours, which is all that these pictures have beside smoothed edges, and a third of the size."""
    figure.savefig(picture, dpi=130)
    with Image.open(picture) as image:
        few = image.convert("RGB").quantize(128, dither=Image.Dither.NONE)
    few.save(picture, optimize=True)


def correction(work, picture):
    folder, run = CAMPAIGNS / "null", "step_b"
    unrig("correct", "--rig", folder / "rig.toml", "--fit", fit("null", work / "null.json"), folder / f"{run}.csv", "-o", work / "corrected.csv")
    corrected, truth = columns(work / "corrected.csv"), columns(folder / f"truth_{run}.csv")
    shown = (corrected["semichords"] > -0.5) & (corrected["semichords"] < 10)
    t, true = corrected["semichords"][shown], truth["circulatory"][shown]
    load, raw, point, curve = (corrected[name][shown] for name in ("circulatory", "gauge", "circulatory_std", "circulatory_band95"))
    step = truth["circulatory"][-1] - truth["circulatory"][0]

    figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(8.4, 6.2), height_ratios=[2.3, 1], layout="constrained")
    above.plot(t, raw, color=GREY, lw=0.9, label="what the strain gauge reads")
    above.fill_between(t, load - curve, load + curve, color=BLUE, alpha=0.3, lw=0)
    above.plot(t, load, color=BLUE, lw=2.2, label="corrected: circulatory load of a rigid rig, 95 % band")
    above.plot(t, true, color=BLACK, lw=1.3, ls=(0, (4, 3)), label="true load")
    above.set(ylabel="normal force [N]", title=f"unrig correct: a pitch step of 2.5° at 0.49 m/s (campaigns/null, {run})")
    above.set_ylim(top=58)
    above.legend(loc="lower right", framealpha=1)
    inset = above.inset_axes([0.42, 0.52, 0.55, 0.4])
    inset.plot(t, raw, color=GREY, lw=0.9)
    inset.fill_between(t, load - curve, load + curve, color=BLUE, alpha=0.3, lw=0)
    inset.plot(t, load, color=BLUE, lw=2.2)
    inset.plot(t, true, color=BLACK, lw=1.3, ls=(0, (4, 3)))
    inset.set(xlim=(-0.2, 1.2), ylim=(6, 16))
    inset.set_title("the beginning, enlarged: while the shaft turns the load is high", fontsize="small")
    above.indicate_inset_zoom(inset, edgecolor="0.4")
    below.fill_between(t, -100 * curve / step, 100 * curve / step, color=BLUE, alpha=0.15, lw=0, label="95 % band of the whole curve")
    below.fill_between(t, -196 * point / step, 196 * point / step, color=BLUE, alpha=0.35, lw=0, label="95 % band of a point")
    below.plot(t, 100 * (load - true) / step, color=BLUE, lw=1.6, label="corrected − true")
    below.axhline(0, color=BLACK, lw=0.8)
    below.set(xlabel="semichords travelled since the step began", ylabel="error\n[% of the step's load]", xlim=(-0.5, 10))
    below.legend(loc="upper right", ncols=3, framealpha=1)
    for axes in (above, below):
        axes.grid(color="0.9", lw=0.6)
        axes.set_axisbelow(True)
    save(figure, picture)


def diagnosis(work, picture):
    campaign, run = "highermode", "step_b"
    folder = CAMPAIGNS / campaign
    unrig("diagnose", "--rig", folder / "rig.toml", *(folder / f"{r}.csv" for r in FITTED), "--heldout", folder / "heldout.csv", "-o", work / "diagnosis.json")
    said = json.loads((work / "diagnosis.json").read_text())
    effect = said["missing"][0]["effect"]
    improved = next(r for r in said["improvement"]["runs"] if r["file"].endswith(f"{run}.csv"))
    rms = lambda x: np.sqrt(np.nanmean(x**2))
    time, before = residual(fit(campaign, work / "without.json"), run)
    _, after = residual(fit(campaign, work / "with.json", "--effect", effect), run)

    figure, axes = plt.subplot_mosaic([["before", "before"], ["map", "ranking"]], figsize=(8.4, 6.2), height_ratios=[1, 1.1], width_ratios=[1.5, 1], layout="constrained")
    axes["before"].plot(time, before, color=ORANGE, lw=0.8, label=f"model without it, fitted: r.m.s. {rms(before):.2f} N")
    axes["before"].plot(time, after, color=BLUE, lw=0.8, label=f"with {effect}: r.m.s. {rms(after):.3f} N (noise {improved['noise']:.3f} N)")
    axes["before"].set(xlabel="time [s]", ylabel="gauge − model [N]", xlim=(0.5, 4), title=f"unrig diagnose: \"{said['verdict']}\" (campaigns/{campaign}, {run})")
    axes["before"].set_ylim(top=1.45 * np.nanmax(before))
    axes["before"].legend(loc="upper right", ncols=2, framealpha=1)
    axes["before"].grid(color="0.9", lw=0.6)

    held = improved["map"]["time_frequency"]
    frequency, power = np.array(held["frequency"]), np.array(held["power"], dtype=float)
    low = (frequency > 0) & (frequency < 60)
    mesh = axes["map"].pcolormesh(held["time"], frequency[low], 10 * np.log10(np.maximum(power[low], 1e-2)), cmap="cividis", vmin=0, shading="nearest", rasterized=True)
    figure.colorbar(mesh, cax=axes["map"].inset_axes([1.02, 0, 0.03, 1]), label="power over the noise [dB]")
    axes["map"].set(xlim=(0.5, 4), xlabel="time [s]", ylabel="frequency [Hz]", title="what a model without it leaves")

    ranked = said["ranking"][::-1]
    chi2 = [r["reduced_chi2"] for r in ranked]
    bars = axes["ranking"].barh([r["effect"] for r in ranked], chi2, color=[BLUE if r["effect"] == effect else GREY for r in ranked])
    axes["ranking"].tick_params("y", labelsize="small")
    axes["ranking"].bar_label(bars, [f"{x:.2f}" if x < 10 else f"{x:.0f}" for x in chi2], padding=3, fontsize="small")
    axes["ranking"].axvline(1, color=BLACK, lw=1, ls=(0, (4, 3)))
    axes["ranking"].set(xscale="log", xlim=(0.5, 12 * max(chi2)), xlabel="reduced chi-square\n(1: only noise is left)", title="the effects fitted")
    save(figure, picture)


if __name__ == "__main__":
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "sample_data/pictures")
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        correction(Path(work), out / "correction.png")
        diagnosis(Path(work), out / "diagnosis.png")
