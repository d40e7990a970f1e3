"""Draw the figures of docs/ from the program itself: python docs/figures/make_figures.py.

Every curve is what the models give at this moment; human data are marked as such, with
their sources.
"""

import sys
from collections.abc import Callable
from functools import partial
from math import degrees, inf, pi, radians, sin
from pathlib import Path
from typing import Literal
from unittest.mock import patch

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  # the backend must be chosen before
import start_figures  # noqa: E402

from gazerig.config.schema import load_rig, load_walk  # noqa: E402
from gazerig.gaze.angles import add, rotation, scale, sub, yaw_pitch  # noqa: E402
from gazerig.gaze.lids.blink import LidParams, closure  # noqa: E402
from gazerig.gaze.oculomotor.binocular import DELAY_S, BinocularController  # noqa: E402
from gazerig.gaze.oculomotor.head import HeadParams, HeadShare  # noqa: E402
from gazerig.gaze.oculomotor.saccade import SaccadeModel, SaccadeParams  # noqa: E402
from gazerig.gaze.scanpath.scanpath import ScanpathParams, markov_walk, normalise  # noqa: E402
from gazerig.gaze.types import PART_NAMES  # noqa: E402
from gazerig.robot.loop.loop import Tick, run  # noqa: E402
from gazerig.robot.model.frames import PoseHistory  # noqa: E402
from gazerig.robot.run.models import rig_kinematics  # noqa: E402
from gazerig.robot.run.options import RunOptions  # noqa: E402
from gazerig.robot.run.run import Run

sys.path.append(str(Path(__file__).parents[2] / "tests" / "helpers"))
from true_gaze import (  # noqa: E402
    gaze_angles,
    gaze_error_rad,
    true_part,
)

HERE = Path(__file__).parent
INK, HUMAN = "#1f5fa8", "#c0722e"
TICK_S = 0.005
STEP_AT_S = 2.0
"""The step of the scene steps-aside."""


def main() -> None:
    """Draw all figures into docs/figures."""
    HERE.mkdir(exist_ok=True)
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
    for draw in (
        main_sequence,
        head_goal,
        pursuit,
        vergence,
        reflex,
        blink,
        scanpath,
        capture_time,
    ):
        draw()
        print(f"docs/figures/{draw.__name__}.png")
    start_figures.main()


def saved(name: str, figure: plt.Figure) -> None:
    """Write one figure."""
    figure.tight_layout()
    figure.savefig(HERE / f"{name}.png", dpi=110)
    plt.close(figure)


def main_sequence() -> None:
    """Duration and peak speed over amplitude, beside human fits."""
    sizes = np.linspace(0.5, 60.0, 120)
    saccade = SaccadeModel(SaccadeParams(profile="min_jerk")).profile
    human = SaccadeModel(SaccadeParams()).profile
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6))
    left.plot(sizes, [1e3 * saccade.duration_s(radians(a)) for a in sizes], INK, label="eqs 2-6")
    left.plot(sizes, [1e3 * human.duration_s(radians(a)) for a in sizes], "tab:red", label="human")
    left.plot(sizes, 21.0 + 2.2 * sizes, HUMAN, ls="--", label="human, 21 + 2.2 A")
    left.plot(sizes, 25.0 + 2.4 * sizes, HUMAN, ls=":", label="human, 25 + 2.4 A (Eyes Alive)")
    left.set(xlabel="amplitude, deg", ylabel="duration, ms", title="duration")
    for profile, colour, label in ((saccade, INK, "eqs 2-6"), (human, "tab:red", "human")):
        times = np.arange(0.0, 0.25, 2e-4)
        moved = np.degrees(
            [[profile.displacement_rad(radians(a), t) for t in times] for a in sizes]
        )
        right.plot(sizes, np.diff(moved, axis=1).max(axis=1) / 2e-4, colour, label=label)
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
    share = HeadShare(HeadParams(goal_model="attention", min_salience=0.0), radians(55.0))
    pulls = np.linspace(-0.2, 1.2, 200)
    figure, axes = plt.subplots(figsize=(4.8, 3.4))
    axes.plot(pulls, [degrees(share.offset_rad(a)) for a in pulls], INK)
    axes.set(
        xlabel="attention, 0 = A1, 1 = A2",
        ylabel="head stops short by, deg",
        title="eq 7, sign corrected",
    )
    saved("head_goal", figure)


def followed(
    where: Callable[[float], tuple[float, float] | None],
    seconds: float,
    head: Callable[[float], float] = lambda t: 0.0,
    start: tuple[float, float] = (0.0, 0.0),
) -> np.ndarray:
    """Run the binocular controller of the profile mitake; return time, version, vergence (degrees).

    where: version and vergence that the target asks for, None: not seen; head: its yaw, degrees
    """

    def eyes(version: float, vergence: float) -> tuple[tuple[float, float], tuple[float, float]]:
        return (radians(version - vergence / 2), 0.0), (radians(version + vergence / 2), 0.0)

    controller, rows = BinocularController(), []
    for k in range(round((seconds + 1.0) / TICK_S)):
        t = k * TICK_S - 1.0
        seen = where(t - DELAY_S) if t >= DELAY_S else start
        if where(0.0) is None:
            seen = None
        R = rotation((radians(head(max(0.0, t))), 0.0, 0.0))
        if k == 0:
            controller.adopt(eyes(*start), None if seen is None else eyes(*seen), R, t)
        left, right = controller.step(None if seen is None else eyes(*seen), R, t, TICK_S)
        if t >= 0.0:
            version, vergence = 0.5 * (left[0] + right[0]), right[0] - left[0]
            rows.append((t + TICK_S, degrees(version), degrees(vergence)))
    return np.array(rows)


def ramp(deg_s: float, t_s: float) -> tuple[float, float]:
    """Return version and vergence of a target in steady motion, deg."""
    return deg_s * t_s, 0.0


def sine(hz: float, t_s: float) -> tuple[float, float]:
    """Return version and vergence of a target that swings by 5 deg."""
    return 5.0 * sin(2.0 * pi * hz * t_s), 0.0


def in_depth(vergence_deg: float, t_s: float) -> tuple[float, float]:
    """Return version and vergence of a target straight ahead."""
    return 0.0, vergence_deg


def pursuit() -> None:
    """Following a ramp and a sine that are seen 0.1 s late."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4))
    for speed in (10.0, 20.0, 30.0):
        t, version, _ = followed(partial(ramp, speed), 0.8).T
        left.plot(t, np.gradient(version, t), label=f"{speed:.0f} deg/s")
    left.axvline(0.1, color=HUMAN, ls="--", label="human latency, 100 ms (Robinson 1986)")
    left.set(xlabel="s", ylabel="eye speed, deg/s", title="ramps")
    for hz, style in ((0.2, "-"), (0.5, "--")):
        t, version, _ = followed(partial(sine, hz), 5.0).T
        right.plot(t, version, INK, ls=style, label=f"eye, {hz} Hz")
        right.plot(t, 5 * np.sin(2 * np.pi * hz * t), HUMAN, ls=style, lw=0.8, label="target")
    right.set(xlabel="s", ylabel="deg", title="sines")
    for axes in (left, right):
        axes.legend(fontsize=7)
    saved("pursuit", figure)


def vergence() -> None:
    """Steps in depth: converging and diverging by 4 deg."""
    figure, axes = plt.subplots(figsize=(4.8, 3.2))
    for start, step in ((2.0, 4.0), (8.0, -4.0)):
        t, _, values = followed(partial(in_depth, start + step), 2.0, start=(0.0, start)).T
        axes.plot(t, values, label=f"{start:.0f} to {start + step:.0f} deg")
    axes.set(xlabel="s", ylabel="vergence, deg", title="vergence: slower apart than together")
    axes.legend(fontsize=7)
    saved("vergence", figure)


def reflex() -> None:
    """The eye against a head that swings in the dark."""
    t, version, _ = followed(lambda t: None, 4.0, lambda t: 10 * np.sin(np.pi * t)).T
    swing = 10 * np.sin(np.pi * t)
    figure, axes = plt.subplots(figsize=(4.8, 3.2))
    axes.plot(t, swing, HUMAN, label="head, 0.5 Hz")
    axes.plot(t, version, INK, label="eye in the head")
    axes.plot(t, swing + version, "k", lw=0.8, label="gaze")
    axes.set(xlabel="s", ylabel="deg", title="vestibulo-ocular reflex in the dark")
    axes.legend(fontsize=7)
    saved("reflex", figure)


def blink() -> None:
    """Closure of the lids during a blink."""
    par = LidParams()
    lasts_s = [ms / 1e3 for ms in (par.close_ms, par.hold_ms, par.open_ms)]
    times = np.linspace(0.0, 0.35, 500)
    figure, axes = plt.subplots(figsize=(4.8, 3.0))
    axes.plot(1e3 * times, [closure(t, *lasts_s) for t in times], INK)
    axes.set(xlabel="ms since onset", ylabel="closure", title="a blink closes faster than it opens")
    saved("blink", figure)


def scanpath() -> None:
    """Transition matrix, and the dwell times drawn against table 1."""
    walk = load_walk("nakamoto_tsuruno")
    names = [PART_NAMES[code] for code in walk.order]
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2))
    matrix = normalise(walk.matrix)
    left.imshow(matrix, cmap="YlOrBr", vmin=0.0, vmax=0.55)
    left.grid(visible=False)
    left.set_xticks(range(8), names, rotation=60, ha="right")
    left.set_yticks(range(8), names)
    left.set(title="transitions, row to column", xlabel="to", ylabel="from")
    for i in range(8):
        for j in range(8):
            if matrix[i, j] > 0.0:
                left.text(j, i, f"{matrix[i, j]:.2f}", ha="center", va="center", fontsize=7)
    printed = ScanpathParams(law="literal")
    model = markov_walk(printed, walk, np.random.default_rng(0))
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


def watched(scene: str, seconds: float, placed_by: Literal["capture", "newest"]) -> np.ndarray:
    """Run a drawn scene; give rows of time and degrees: person, gaze, facing, head, gaze off."""
    rig = load_rig("desk")
    made = Run(rig, RunOptions(True, True, 0, scene, pixels=True))
    assert made.scene is not None
    people = made.scene.people
    rows: list[tuple[float, ...]] = []
    kinematics = rig_kinematics(rig)

    def watch(tick: Tick) -> None:
        person = people(tick.t_s - (rows[0][0] if rows else tick.t_s))[0]
        face, pose = person.p_world_face_m, tick.pose
        part = true_part(person, tick.target.part)
        middle = scale(add(pose.p_world_eye_left_m, pose.p_world_eye_right_m), 0.5)
        yaws = (
            yaw_pitch(sub(face, middle))[0],
            gaze_angles(pose)[0],
            kinematics.neck_angles_to(face)[0],
        )
        rows.append((tick.t_s, *yaws, pose.head_rad[0], gaze_error_rad(part, pose)))

    angles = PoseHistory.angles
    newest = placed_by == "newest"
    with patch.object(
        PoseHistory, "angles", lambda poses, t_s: angles(poses, inf if newest else t_s)
    ):
        made.robot.start(made.clock)
        run(made.robot, made.clock, made.loop, lambda s: "over" if s > seconds else None, watch)
        made.robot.stop()
    made.close()
    table = np.array(rows)
    table[:, 0] -= table[0, 0]
    table[:, 1:] = np.degrees(table[:, 1:])
    return table


def capture_time() -> None:
    """Pictures placed by the pose at their capture and by the newest: a quick step, a walk."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12.0, 3.8))
    ways: tuple[tuple[Literal["capture", "newest"], str, str], ...] = (
        ("capture", INK, "pose at the capture"),
        ("newest", HUMAN, "newest pose"),
    )
    for placed_by, colour, name in ways:
        t, person, gaze, facing, head, _ = watched("steps-aside", STEP_AT_S + 2.1, placed_by).T
        if placed_by == "capture":
            left.plot(t - STEP_AT_S, facing, "k", lw=0.8, label="straight at the person")
            middle.plot(t - STEP_AT_S, person, "k", lw=0.8, label="the person's face")
        left.plot(t - STEP_AT_S, head, colour, label=f"head, {name}")
        middle.plot(t - STEP_AT_S, gaze, colour, label=f"gaze, {name}")
        t, *_, off = watched("walks-past", 3.4, placed_by).T
        right.plot(t - 1.0, off, colour, label=name)
    step = {"xlim": (-0.2, 2.1), "xlabel": "s since the step began", "ylabel": "yaw, deg"}
    left.set(title="a step of 40 deg in 0.7 s: head", **step)
    middle.set(title="the same: gaze, over the parts of the face", **step)
    right.set(
        xlim=(-0.2, 2.4),
        ylim=(0.0, 10.0),
        xlabel="s since the walk began",
        ylabel="gaze off the face part, deg",
        title="1 m/s past at 1.5 m",
    )
    for axes in (left, middle, right):
        axes.legend(fontsize=7)
    saved("capture_time", figure)


if __name__ == "__main__":
    main()
