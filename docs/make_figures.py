"""Draw the figures of docs/gaze.md from the program itself: make figures.

Every curve is what the models give at this moment; human data are marked as such, with
their sources.
"""

from math import degrees, radians
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  # the backend must be chosen before

from config.schema import load_walk  # noqa: E402
from gaze.head import Head, HeadParams  # noqa: E402
from gaze.lids import LidParams, Lids  # noqa: E402
from gaze.saccade import Saccade, SaccadeParams  # noqa: E402
from gaze.scanpath import ScanpathParams, markov_walk, normalised  # noqa: E402
from gaze.types import PART_NAMES  # noqa: E402

HERE = Path(__file__).parent / "figures"
INK, HUMAN = "#1f5fa8", "#c0722e"


def main() -> None:
    """Draw all figures into docs/figures."""
    HERE.mkdir(exist_ok=True)
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
    for draw in (main_sequence, head_goal, blink, scanpath):
        draw()
        print(f"docs/figures/{draw.__name__}.png")


def saved(name: str, figure: plt.Figure) -> None:
    """Write one figure."""
    figure.tight_layout()
    figure.savefig(HERE / f"{name}.png", dpi=110)
    plt.close(figure)


def main_sequence() -> None:
    """Duration and peak speed over amplitude, beside human fits."""
    sizes = np.linspace(0.5, 60.0, 120)
    saccade = Saccade(SaccadeParams())
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6))
    left.plot(sizes, [1e3 * saccade.duration_s(radians(a)) for a in sizes], INK, label="eqs 2-6")
    left.plot(sizes, 21.0 + 2.2 * sizes, HUMAN, ls="--", label="human, 21 + 2.2 A")
    left.plot(sizes, 25.0 + 2.4 * sizes, HUMAN, ls=":", label="human, 25 + 2.4 A (Eyes Alive)")
    left.set(xlabel="amplitude, deg", ylabel="duration, ms", title="duration")
    peaks = [degrees(saccade.peak_speed_rad_s(radians(a))) for a in sizes]
    right.plot(sizes, peaks, INK, label="eqs 2-6")
    right.plot(
        sizes, 551 * (1 - np.exp(-sizes / 14)), HUMAN, ls="--", label="human, 551 (1 - exp(-A/14))"
    )
    right.axhspan(470, 534, color=HUMAN, alpha=0.15, label="Collewijn 1988: 502 +- 32 from 40 deg")
    right.set(xlabel="amplitude, deg", ylabel="peak speed, deg/s", title="peak speed")
    for axes in (left, right):
        axes.legend(fontsize=7)
    saved("main_sequence", figure)


def head_goal() -> None:
    """Offset of the head goal over the amount of attention (eq 7)."""
    params = HeadParams(pull_least=0.0, pull_most=1.0)
    limits = ((-2.0, 2.0), (-1.0, 1.0))
    pulls = np.linspace(-0.2, 1.2, 200)
    figure, axes = plt.subplots(figsize=(4.8, 3.4))
    for limit, style in ((55.0, "-"), (20.0, "--")):
        head = Head(params, radians(limit), limits)
        offsets = [degrees(head.offset_rad(a)) for a in pulls]
        axes.plot(pulls, offsets, INK, ls=style, label=f"eye limit {limit:.0f} deg")
    axes.set(
        xlabel="attention, 0 = A1, 1 = A2",
        ylabel="head stops short by, deg",
        title="eq 7, sign corrected",
    )
    axes.legend(fontsize=7)
    saved("head_goal", figure)


def blink() -> None:
    """Closure of the lids during a blink."""
    lids = Lids(LidParams(), np.random.default_rng(0))
    times = np.linspace(0.0, 0.35, 500)
    figure, axes = plt.subplots(figsize=(4.8, 3.0))
    axes.plot(1e3 * times, [lids.closure(t) for t in times], INK)
    axes.set(xlabel="ms since onset", ylabel="closure", title="a blink closes faster than it opens")
    saved("blink", figure)


def scanpath() -> None:
    """Transition matrix, and the dwell times drawn against table 1."""
    walk = load_walk("nakamoto_tsuruno")
    names = [PART_NAMES[code] for code in walk.order]
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2))
    matrix = normalised(walk.matrix)
    left.imshow(matrix, cmap="YlOrBr", vmin=0.0, vmax=0.55)
    left.grid(visible=False)
    left.set_xticks(range(8), names, rotation=60, ha="right")
    left.set_yticks(range(8), names)
    left.set(title="transitions, row to column", xlabel="to", ylabel="from")
    for i in range(8):
        for j in range(8):
            if matrix[i, j] > 0.0:
                left.text(j, i, f"{matrix[i, j]:.2f}", ha="center", va="center", fontsize=7)
    model = markov_walk(ScanpathParams(shortest_dwell_ms=0.0), walk, np.random.default_rng(0))
    drawn = [np.array([model.dwell_s(i) for _ in range(4000)]) for i in range(8)]
    right.boxplot(drawn, showfliers=False, medianprops={"color": INK})
    right.errorbar(
        range(1, 9), walk.dwell_mean_s, walk.dwell_sd_s, fmt="o", color=HUMAN, label="table 1"
    )
    right.plot(range(1, 9), [d.mean() for d in drawn], "x", color=INK, label="mean drawn")
    right.set_xticks(range(1, 9), names, rotation=60, ha="right")
    right.set(ylim=(0.0, 0.7), ylabel="dwell, s", title="dwell times, 4000 draws a part")
    right.legend(fontsize=7)
    saved("scanpath", figure)


if __name__ == "__main__":
    main()
