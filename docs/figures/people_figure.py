"""Twenty seconds of gaze, head and lids before a face, a walker, three people, and in a talk.

Measured at emulated servos with the default profile; faces are those that the scenes hold.
"""

from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from trace_figure import BEGIN_S, FACE, GAZE, HEAD, LID, SECONDS, Trace, recorded

from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.surroundings import load_scene

_HEAD_M = (0.04, 0.0, 0.13)


class Situation(NamedTuple):
    """A panel: its title, its shipped scene and the mode of conversation."""

    title: str
    scene: str
    conversation: str | None = None


SITUATIONS = (
    Situation("a face: a person sits still", "sits-still"),
    Situation("a walker: 1 m/s, 1.5 m away, back after a second", "walks-past"),
    Situation("three people who talk in turns: the speaker's line is thick", "three-people"),
    Situation("a talk: the robot speaks to a person who sits still", "sits-still", "talk"),
)


def faces_deg(scene_name: str, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the yaw of each person's face from the head, (n, people), and whether they speak."""
    scene = load_scene(scene_name)
    rows = [scene.people(t) for t in t_s.tolist()]
    faces = np.array([[person.p_world_face_m for person in people] for people in rows])
    x, y, _ = np.moveaxis(faces - np.array(_HEAD_M), 2, 0)
    yaw = np.degrees(np.arctan2(y, x))
    yaw[np.abs(yaw) > 60.0] = np.nan
    return yaw, np.array([[person.speaks for person in people] for people in rows])


def figure_of(traces: list[tuple[Situation, Trace]]) -> plt.Figure:
    """Return the figure: a panel each, lids above gaze and head."""
    figure, panels = plt.subplots(
        2 * len(traces), 1, figsize=(10.0, 2.3 * len(traces)), sharex=True,
        gridspec_kw={"height_ratios": [1, 4] * len(traces), "hspace": 0.32},
    )  # fmt: skip
    t = BEGIN_S + np.arange(0.0, SECONDS, 0.05)
    for (situation, trace), lids, axes in zip(traces, panels[::2], panels[1::2], strict=True):
        lids.plot(trace.t_s, trace.lid, color=LID, lw=0.9)
        lids.set(ylim=(-0.05, 1.0), yticks=(0.0, 0.8), ylabel="lid")
        lids.set_title(situation.title, loc="left", fontsize=9, pad=2.0)
        yaw, speaks = faces_deg(situation.scene, t)
        axes.plot(t, yaw, color=FACE, lw=0.8)
        axes.plot(t, np.where(speaks, yaw, np.nan), color=FACE, lw=2.5)
        axes.plot([], [], color=FACE, label="faces")
        axes.plot(trace.t_s, trace.head_deg, color=HEAD, lw=1.4, label="head")
        axes.plot(trace.t_s, trace.gaze_deg, color=GAZE, lw=0.9, label="gaze")
        axes.set(ylabel="yaw, deg", ylim=(-45.0, 45.0))
    panels[1].legend(loc="lower left", fontsize=7, ncols=3)
    panels[-1].set_xlabel("time, s")
    return figure


def all_traces() -> list[tuple[Situation, Trace]]:
    """Return the traces of all panels."""
    found = []
    for situation in SITUATIONS:
        options = RunOptions(
            True, True, 1, situation.scene, conversation=situation.conversation,
            seconds=BEGIN_S + SECONDS,
        )  # fmt: skip
        found.append((situation, recorded(options)))
    return found
