#!/usr/bin/python3
"""Draws what identify fitted: commanded, measured and fitted wheel speeds, and the residual."""

import csv
import sys

try:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
except ImportError as error:
    sys.exit(f"plot_identification: the picture needs matplotlib (apt install python3-matplotlib): {error}")

COMMAND, MEASURED, FITTED = "#000000", "#56b4e9", "#d55e00"


def read(path):
    with open(0 if path == "-" else path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}


def draw(data, path):
    figure, axes = plt.subplots(3, 1, figsize=(11, 8), sharex=True, gridspec_kw={"height_ratios": [3, 3, 2]})
    for axis, side in zip(axes, ("left", "right")):
        axis.plot(data["time"], data[f"measured_{side}"], ".", color=MEASURED, markersize=3, label="measured")
        axis.plot(data["time"], data[f"fitted_{side}"], color=FITTED, linewidth=1.2, label="fitted model")
        axis.step(data["time"], data[f"command_{side}"], where="post", color=COMMAND, linewidth=0.8, linestyle="--",
                  label="command")
        axis.set_ylabel(f"{side} wheels [rad/s]")
    axes[0].legend(ncol=3, loc="upper right", frameon=False)
    for side, color in (("left", MEASURED), ("right", FITTED)):
        # Equal: not fitted, because the commands before are not in the recording.
        residual = [m - f if m != f else float("nan") for m, f in zip(data[f"measured_{side}"], data[f"fitted_{side}"])]
        axes[2].plot(data["time"], residual, color=color, linewidth=0.7, label=side)
    axes[2].legend(ncol=2, loc="upper right", frameon=False)
    axes[2].set_ylabel("measured - fitted [rad/s]")
    axes[2].set_xlabel("time [s]")
    for axis in axes:
        axis.grid(alpha=0.3)
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
    figure.tight_layout()
    try:
        figure.savefig(path, dpi=120, metadata={"Software": ""})
    except (OSError, ValueError) as error:
        sys.exit(f"plot_identification: {error}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: plot_identification.py IDENTIFICATION.csv PICTURE.png; - reads the standard input")
    draw(read(sys.argv[1]), sys.argv[2])
