"""Errors of the gaze from the true faces in a run of a world, and the largest misses."""

import time
from bisect import bisect_left, bisect_right
from collections import Counter
from math import degrees
from typing import NamedTuple

import numpy as np

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between, sub
from gazerig.gaze.types import Vec3
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run
from gazerig.robot.control.tick import Tick
from gazerig.sim_mock.true_gaze import gaze_error_rad, true_part

_MISS_DEG = 2.0
_WAKES_S = 0.7
"""The eyes reach the first face within this time."""
_WAITS_S = 0.16
"""So long after the choice, at most, the eyes wait for their saccade: the pause after the last one
(`min_interval_ms`), and lids and head that go first."""


class Look(NamedTuple):
    """One tick on a face, outside saccades; angles in degrees.

    off_deg: measured gaze from the nearest person's true part
    face_deg: the target's place from the true part that it is meant to be
    point_deg: intended direction of the eyes from the target
    """

    t_s: float
    off_deg: float
    face_deg: float
    point_deg: float


class Looks:
    """Gathers the looks of a run, tick by tick."""

    def __init__(self, made: Assembly) -> None:
        self._made = made
        self.looks: list[Look] = []
        self.pictures = 0
        self._chosen_s: list[float] = []
        self._saccades_s: list[float] = []
        self._before: tuple[int, int] | None = None

    def watch(self, tick: Tick) -> None:
        """Note one tick."""
        room, scene = self._made.room, self._made.scene
        begun = room.start_s() if room is not None else None
        if tick.detections is not None:
            self.pictures = tick.detections.number
        if begun is None or scene is None:
            return
        t_s, target = tick.t_s - begun, tick.target
        shift, saccades = self._before or (-1, tick.gaze.saccades)
        if target.shift != shift:
            self._chosen_s.append(t_s)
        if tick.gaze.saccades != saccades:
            self._saccades_s.append(t_s)
        self._before = target.shift, tick.gaze.saccades
        if target.kind != "face" or tick.gaze.phase == "saccade":
            return
        parts = [true_part(one, target.part) for one in scene.people(t_s)]
        pose = tick.pose
        eye: Vec3 = pose.p_world_eye_left_m

        def apart_deg(a: Vec3, b: Vec3) -> float:
            return degrees(angle_between(sub(a, eye), sub(b, eye)))

        self.looks.append(
            Look(
                t_s,
                min(degrees(gaze_error_rad(part, pose)) for part in parts),
                min(apart_deg(target.p_world_m, part) for part in parts),
                apart_deg(tick.gaze.gaze_point_world_m, target.p_world_m),
            )
        )

    def causes(self, above_deg: float) -> dict[str, float]:
        """Return the share of each cause in the looks that are farther off than this."""
        worst = [look for look in self.looks if look.off_deg > above_deg]
        found = Counter(map(self._cause, worst))
        return {cause: n / len(worst) for cause, n in found.most_common()}

    def _cause(self, look: Look) -> str:
        if look.t_s < _WAKES_S:
            return "the first look"
        waits = look.point_deg > _MISS_DEG and self._waits(look.t_s)
        if waits:
            return "chosen, the saccade to come"
        return "the face is taken to be elsewhere" if look.face_deg > _MISS_DEG else "else"

    def _waits(self, t_s: float) -> bool:
        """Return whether a target was chosen a moment ago and a saccade begins in a moment."""
        chosen = bisect_right(self._chosen_s, t_s)
        coming = bisect_left(self._saccades_s, t_s)
        return (
            chosen > 0
            and t_s - self._chosen_s[chosen - 1] <= _WAITS_S
            and coming < len(self._saccades_s)
            and self._saccades_s[coming] - t_s <= _WAITS_S
        )


def looked(seconds: float, blind: bool, seed: int = 0) -> tuple[Looks, float]:
    """Return the looks of a run of the conversation, and its processor time, s.

    blind: with detections that are computed instead of pictures
    """
    began = time.process_time()
    options = RunOptions(True, True, seed, world="conversation", no_pictures=blind)
    made = assemble(load_rig("desk"), options)
    looks = Looks(made)
    made.robot.start(made.clock)
    try:
        run(
            made.robot,
            made.clock,
            made.loop,
            lambda s: "over" if s > seconds else None,
            looks.watch,
        )
    finally:
        made.robot.stop()
        made.close()
    return looks, time.process_time() - began


def text(name: str, looks: Looks, spent_s: float) -> str:
    """Return the figures of a run in two lines."""
    off = np.array([look.off_deg for look in looks.looks])
    median, most = np.percentile(off, (50, 95))
    causes = ", ".join(f"{cause} {100.0 * x:.0f} %" for cause, x in looks.causes(most).items())
    return (
        f"{name:20} median {median:.2f}, 95 % {most:.2f}, below 2 deg "
        f"{100.0 * float(np.mean(off < _MISS_DEG)):.0f} %; {len(off)} ticks on a face, "
        f"{looks.pictures} pictures, {spent_s:.1f} s of processor\n  the others: {causes}"
    )
