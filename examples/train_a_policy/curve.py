"""Draw how a training went: python curve.py episodes.monitor.csv curve.png"""

import csv
import sys
from itertools import islice
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

WINDOW = 50
"""Episodes over which a share is averaged."""
OUTCOMES = {"arrived": "#30a46c", "collided": "#e5484d", "time limit": "#8b8d98"}


def main(table: str, picture: str) -> None:
    with Path(table).open() as lines:
        rows = list(csv.DictReader(islice(lines, 1, None)))  # the first line is a comment
    steps = np.cumsum([int(row["l"]) for row in rows])
    figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
    for outcome, colour in OUTCOMES.items():
        is_outcome = np.array([row["outcome"] == outcome for row in rows], dtype=float)
        share = np.convolve(is_outcome, np.full(WINDOW, 1.0 / WINDOW), "valid")
        axes.plot(steps[WINDOW - 1 :], 100.0 * share, color=colour, label=outcome)
    axes.set(xlabel="steps", ylabel=f"% of the last {WINDOW} episodes", ylim=(0.0, 102.0))
    axes.set_xlim(0.0, steps[-1])
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(picture, dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
