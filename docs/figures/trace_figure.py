"""Twenty seconds of gaze, head and lids: a person by published numbers, and three profiles.

The person's trace is drawn from published figures, not recorded; the profiles' are measured at
emulated servos, in the scene ``visitor``, where somebody steps aside, waves and steps aside again.
"""

from collections import defaultdict
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np

from gazerig.config.schema import load_rig
from gazerig.features.lab.analysis.human_norms import mean_head_deg
from gazerig.features.lab.simulated_run import simulate
from gazerig.gaze.angles import yaw_pitch
from gazerig.robot.loop.tick import Tick, cyclopean_direction
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run_rig import with_options
from gazerig.robot.run.surroundings import load_scene

BEGIN_S, SECONDS, RATE_HZ = 8.0, 20.0, 200.0
PROFILES = ("robot", "mitake", "nakamoto")
GAZE, HEAD, LID, FACE = "#1f5fa8", "#2b8a5a", "#7a7f85", "#c0722e"
_HEAD_M = (0.04, 0.0, 0.13)
_PARTS_DEG = (-2.0, 2.0, 0.0, 0.0)
"""Eyes, nose and mouth of a face 1 m away, sideways."""


class Trace(NamedTuple):
    """Columns of one panel: time in s, gaze and head in space in deg of yaw, lids 0 shut .. 1."""

    t_s: np.ndarray
    gaze_deg: np.ndarray
    head_deg: np.ndarray
    lid: np.ndarray


def evoked_blink_probability(amplitude_deg: float) -> float:
    """Return a blink's probability with a gaze shift: .5 at 17, .97 at 33 deg (Evinger 1994)."""
    return float(1.0 / (1.0 + np.exp(-0.217 * (amplitude_deg - 17.0))))


def of_profile(profile: str) -> Trace:
    """Return what a profile's head did before the visitor."""
    return recorded(
        RunOptions(True, True, 1, "visitor", profile=profile, seconds=BEGIN_S + SECONDS)
    )


def recorded(options: RunOptions) -> Trace:
    """Return what the head did in a run after ``BEGIN_S``, as its servos measured it."""
    rows: list[tuple[float, float, float, float]] = []

    def watch(tick: Tick) -> None:
        yaw = np.degrees(yaw_pitch(cyclopean_direction(tick))[0])
        head = np.degrees(tick.pose.head_rad[0])
        rows.append((tick.t_s, yaw, head, max(tick.pose.lid_left, tick.pose.lid_right)))

    options = options.check_and_complete()
    rig = load_rig(options.rig, options.character, options.profile)
    simulate(with_options(rig, options), options, watch=watch)
    table = np.array(rows)
    return Trace(*table[table[:, 0] >= BEGIN_S].T)


def face_deg(t_s: np.ndarray) -> np.ndarray:
    """Return where the visitor's face is, in deg of yaw from the head."""
    scene = load_scene("visitor")
    faces = np.array([scene.people(t)[0].p_world_face_m for t in t_s.tolist()])
    x, y, _ = (faces - np.array(_HEAD_M)).T
    return np.degrees(np.arctan2(y, x))


def of_person(seed: int = 4) -> Trace:
    """Return how a person would look at the same visitor, by published numbers.

    Rests: 2 to 3 a second (Ruhland et al. 2015), longer than 150 ms. Saccades: 25 + 2.4 A ms
    (Lee, Badler & Badler 2002), 5 to 10 % short beyond 10 deg and corrected after some 150 ms
    (Becker 1989). Looks away after bouts of 3.3 s (Binetti et al. 2016). Head: .77 of what exceeds
    17.9 deg (Stahl 1999). Blinks: 17 a minute (Bentivoglio et al. 1997), half of them incomplete,
    70 ms to shut (VanderWerf et al. 2003), more with large shifts (Evinger et al. 1994).
    """
    rng, t = np.random.default_rng(seed), BEGIN_S + np.arange(0.0, SECONDS, 1.0 / RATE_HZ)
    face = face_deg(t)
    gaze, head, lid = np.zeros_like(t), np.zeros_like(t), np.full_like(t, 0.8)
    offset, base, blinks, looked_s = 0.0, face[0], list[float](), 0.0
    k = 0
    while k < len(t):
        away = looked_s > rng.lognormal(np.log(3.3), 0.4)
        looked_s = 0.0 if away else looked_s
        goal = float(rng.choice((-1.0, 1.0)) * rng.uniform(12.0, 24.0)) if away else float(
            rng.choice(_PARTS_DEG) + rng.normal(0.0, 0.4)
        )  # fmt: skip
        size = abs(goal - offset)
        steps = [0.93, 1.0] if size > 10.0 and rng.random() < 0.4 else [1.0]
        start = offset
        for step in steps:
            k, offset = _flown(gaze, face, k, offset, start + step * (goal - start))
            rest_s = 0.15 if step < 1.0 else max(0.16, rng.lognormal(np.log(0.3), 0.45))
            end = min(len(t), k + round(rest_s * RATE_HZ))
            gaze[k:end] = offset + face[k:end]
            looked_s += rest_s
            k = end
        rare = evoked_blink_probability(size) if size > 10.0 else 0.1
        if rng.random() < rare and (not blinks or t[min(k, len(t) - 1)] - blinks[-1] > 2.0):
            blinks.append(t[min(k, len(t) - 1)] - rest_s + float(rng.normal(0.0, 0.04)))
        base = face[min(k, len(t) - 1)]
    head[:] = _followed(t, np.sign(gaze) * mean_head_deg(gaze), base)
    for begin in blinks:
        depth = 1.0 if rng.random() < 0.5 else rng.uniform(0.6, 0.95)
        since = t - begin
        shut = np.clip(since / 0.07, 0.0, 1.0) * np.exp(-np.clip(since - 0.1, 0.0, None) / 0.07)
        lid *= 1.0 - depth * shut
    return Trace(t, gaze, head, lid)


def _flown(
    gaze: np.ndarray, face: np.ndarray, k: int, start: float, goal: float
) -> tuple[int, float]:
    """Write one saccade from tick ``k``; return the tick after it, and where it has landed."""
    ticks = max(4, round((0.025 + 0.0024 * abs(goal - start)) * RATE_HZ))
    end = min(len(gaze), k + ticks)
    s = np.arange(end - k) / ticks
    s = s**0.9  # the peak comes before the middle (Collewijn et al. 1988)
    gaze[k:end] = face[k:end] + start + (goal - start) * s * s * s * (10.0 + s * (6.0 * s - 15.0))
    return end, goal


def _followed(t: np.ndarray, goal: np.ndarray, start: float) -> np.ndarray:
    """Return a head that goes to its goal in about half a second, some 40 ms after the eyes."""
    late = np.interp(t - 0.04, t, goal)
    out, x, v = np.zeros_like(t), float(late[0]), 0.0
    for k, wanted in enumerate(late.tolist()):
        a = 49.0 * (wanted - x) - 14.0 * v
        v += a / RATE_HZ
        x += v / RATE_HZ
        out[k] = x
    return out


def figure_of(traces: dict[str, Trace]) -> plt.Figure:
    """Return the figure: a panel each, lids above gaze and head."""
    figure, panels = plt.subplots(
        2 * len(traces), 1, figsize=(10.0, 2.3 * len(traces)), sharex=True,
        gridspec_kw={"height_ratios": [1, 4] * len(traces), "hspace": 0.32},
    )  # fmt: skip
    t = BEGIN_S + np.arange(0.0, SECONDS, 0.05)
    for (name, trace), lids, axes in zip(traces.items(), panels[::2], panels[1::2], strict=True):
        lids.plot(trace.t_s, trace.lid, color=LID, lw=0.9)
        lids.set(ylim=(-0.05, 1.0), yticks=(0.0, 0.8), ylabel="lid")
        lids.set_title(name, loc="left", fontsize=9, pad=2.0)
        axes.plot(t, face_deg(t), color=FACE, lw=1.0, label="the visitor's face")
        axes.plot(trace.t_s, trace.head_deg, color=HEAD, lw=1.4, label="head")
        axes.plot(trace.t_s, trace.gaze_deg, color=GAZE, lw=0.9, label="gaze")
        axes.set(ylabel="yaw, deg", ylim=(-50.0, 45.0))
    panels[1].legend(loc="lower left", fontsize=7, ncols=3)
    panels[-1].set_xlabel("time, s")
    return figure


def all_traces() -> dict[str, Trace]:
    """Return the traces of all panels by their titles."""
    titles = defaultdict(str, robot="the default profile, robot: measured at emulated servos")
    return {
        "a person, drawn from published numbers (no recording)": of_person(),
        **{titles[name] or f"profile {name}": of_profile(name) for name in PROFILES},
    }
