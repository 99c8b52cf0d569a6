#!/usr/bin/env python3
"""Draws the seed's figures from the runs that figures.sh has simulated: figures.py CSV_DIRECTORY PICTURE_DIRECTORY."""
import sys
import tomllib
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

SEED = Path(__file__).resolve().parents[2] / "sample_data" / "seed"
SEMICHORD = 0.0762  # m
SEMICHORD_TIME = 0.125  # s
FORCE = 0.03613 * 24**2 * 3 * 42 * 0.45359237 * 0.0254  # rho U^2 b l [N]
DEGREE = np.pi / 180

# Table 1 as printed.
TABLE_Q = dict(A=9.73e-3, B=-2.59e-3, C=-1.57e-3, D=1.77e-2, E=9.25e-3, F=-1.04e-3, G=-1.55e-2)
TABLE_G = dict(A=0.0, B=-1.33e-7, C=-1.63e-9, D=-5.10e-5, E=-5.50e-5, F=-3.79e-4, G=-2.40e-2)


def read_run(path):
    """Columns by name, and the time in semichords."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    names = [column.split(" [")[0] for column in lines[0].split(",")]
    run = dict(zip(names, np.loadtxt(lines[1:], delimiter=",").T))
    run["semichords"] = run["time"] / SEMICHORD_TIME
    return run


def table(c, t):
    """Table 1's form (section 3.10), with the signs of Appendix D."""
    return (
        c["A"]
        + c["B"] * np.exp(-0.29 * t)
        + c["C"] * np.exp(-0.0454 * t)
        + np.exp(-0.42 * t) * (c["D"] * np.sin(2.29 * t) + c["E"] * np.cos(2.29 * t))
        + np.exp(-0.825 * t) * (c["F"] * np.sin(49.75 * t) + c["G"] * np.cos(49.75 * t))
    )


def curvature_gain(rig_file):
    """C_N that the curvature of the first normal mode stands for, per q/b: omega^2 sum m phi (x - x_7) / (x_16 - x_7)."""
    normal = tomllib.loads(rig_file.read_text())["normal"]
    mass = np.array(normal["mass"]["values"]) / 386.0886  # lbf s^2/in
    station = np.array(normal["station"]["values"])
    flexibility = np.array(normal["flexibility"]["rows"]) * normal["flexibility"]["scale"]
    root = np.sqrt(mass)
    value, vector = np.linalg.eigh(root[:, None] * (flexibility + flexibility.T) / 2 * root)
    shape = vector[:, -1] / root
    shape /= shape[16]
    arm = np.maximum(station - station[6], 0) / (station[15] - station[6])
    return (mass * shape * arm).sum() / value[-1] * 3 * 4.4482216152605 / FORCE


def figure(name, title, ylabel, directory):
    fig, axes = plt.subplots(figsize=(7.2, 3.6), layout="constrained")
    axes.set(title=title, xlabel="semichords", ylabel=ylabel)
    axes.grid(alpha=0.3)
    return fig, axes, directory / f"{name}.png"


def save(fig, axes, path, loc="best"):
    axes.legend(loc=loc, fontsize=8)
    fig.savefig(path, dpi=100)
    plt.close(fig)


def main(csv, pictures):
    ideal = read_run(csv / "ideal_one_mode.csv")
    shown = (ideal["semichords"] >= 0) & (ideal["semichords"] <= 10)
    s = ideal["semichords"][shown]
    q = ideal["tip_displacement"][shown] / SEMICHORD
    g = ideal["tip_twist"][shown] - DEGREE

    fig, axes, path = figure("figure_4_1a", "Figure 4.1a: ideal step of 1 deg, normal coordinate", "q / b", pictures)
    axes.plot(s, 1e3 * table(TABLE_Q, s), "C3", lw=0.8, label="Table 1 as printed (1.31 times too large)")
    axes.plot(s, 1e3 * q, "C0", lw=0.8, label="unrig, the same two modes")
    axes.set_ylabel("1000 q / b")
    save(fig, axes, path)

    fig, axes, path = figure("figure_4_1b", "Figure 4.1b: ideal step of 1 deg, torsional coordinate", "g [deg]", pictures)
    axes.plot(s, table(TABLE_G, s) / DEGREE, "C3", lw=0.8, label="Table 1 as printed")
    axes.plot(s, g / DEGREE, "C0", lw=0.8, label="unrig, the same two modes")
    save(fig, axes, path)

    gain = curvature_gain(SEED / "rig.toml")
    five = read_run(csv / "ideal_five_modes.csv")
    fig, axes, path = figure("figure_4_2", "Figure 4.2: reading after an ideal step of 1 deg", r"$C_N$", pictures)
    equation = 2 * np.pi * DEGREE * (1 - 0.165 * np.exp(-0.0455 * s) - 0.335 * np.exp(-0.3 * s))
    axes.plot(s, gain * table(TABLE_Q, s), "C3", lw=0.7, label="curvature of one mode, Table 1 as printed")
    axes.plot(s, gain * q, "C0", lw=0.7, label="curvature of one mode, right")
    axes.plot(s, equation, "k", lw=1.2, label="Eq. 1.1, circulatory part")
    axes.plot(s, five["circulatory"][shown] / FORCE, "k--", lw=1.2, label="rigid rig, pitch rate included (Eq. 3.10)")
    axes.axhline(2 * np.pi * DEGREE, color="0.5", lw=0.8, ls=":", label=r"steady, $2\pi\Delta\alpha$")
    save(fig, axes, path, "lower right")

    full, one, two = (read_run(csv / f"step_{modes}.csv") for modes in (17, 1, 2))
    onset = 0.1 / SEMICHORD_TIME
    s = full["semichords"] - onset
    shown = (s >= -0.1) & (s <= 4)
    # The seed's reading: its one mode's curvature, on top of the steady reading.
    rise = one["tip_displacement"] - one["tip_displacement"][0]
    seeds = one["gauge"][0] + gain * rise / SEMICHORD * FORCE
    fig, axes, path = figure("section_4_2_3", "Section 4.2.3: step of 1.3 deg, what fewer modes leave", "gauge [N]", pictures)
    axes.plot(s[shown], full["gauge"][shown], "k", lw=1.2, label="recording: all modes")
    axes.plot(s[shown], (full["gauge"] - seeds)[shown] - 8, "C3", lw=0.9, label="left by one normal mode (curvature), 15 Hz; shifted by -8 N")
    axes.plot(s[shown], (full["gauge"] - two["gauge"])[shown] - 16, "C0", lw=0.9, label="left by two normal modes; shifted by -16 N")
    save(fig, axes, path)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
