"""People as articulated figures: the pose of every segment of every body at any time.

A script and a seed determine the motion, so every process computes the same poses from the time
alone. The motion of a whole round is computed once, with a row every 10 ms, and interpolated
linearly between rows. The frames of segments are those of body_motion.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gazerig.features.world import object_handover
from gazerig.features.world.body_motion import SEGMENTS, SIDES, BodyMotion, arm_poses
from gazerig.features.world.gait import RATE_HZ
from gazerig.features.world.measures import Measures, measures
from gazerig.features.world.motions import FIST_M, Frame, fist_pose
from gazerig.features.world.opponent_motion import Opponent, OpponentRow, OpponentTrack
from gazerig.features.world.rotations import quaternions, rotation_matrix, unit
from gazerig.features.world.time_profiles import smooth_rise
from gazerig.features.world.timeline import timed_acts
from gazerig.gaze.types import Floats, Vec3
from gazerig.sim_mock.scenes.script import SceneScript
from gazerig.sim_mock.scenes.timeline import TimedAct

_SEGMENT = {name: number for number, name in enumerate(SEGMENTS)}
_KEPT_POSES = 16
_PUNCH_OUT_M = 0.35
"""Distance of a fist ahead of its guard at which it is turned as in a punch."""


class Segments(NamedTuple):
    """All segments at one time: positions (n, 3) in m, quaternions (n, 4), w first."""

    p_m: Floats
    quat: Floats


class Figures:
    """All people of a script, and the things that they hold.

    Args:
        script: checked script (see script_faults).
        seed: seed of blinks, gaze wandering, and acts with a random time.
        shared: file in which several processes share the motion, None for none.
    """

    def __init__(self, script: SceneScript, seed: int = 0, shared: Path | None = None) -> None:
        self.script, self.seed, self.shared = script, seed, shared
        self.names: tuple[str, ...] = (
            *(f"{name}/{segment}" for name in script.people for segment in SEGMENTS),
            *(f"thing/{name}" for name in script.things),
        )
        self.row = {name: i for i, name in enumerate(self.names)}
        self._last: tuple[float, Segments] | None = None
        self._poses: dict[float, Floats] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.script, self.seed, self.shared)

    @cached_property
    def timelines(self) -> Mapping[str, tuple[TimedAct, ...]]:
        """Return the timed acts of each person."""
        return {name: timed_acts(self.script, name, self.seed) for name in self.script.people}

    @cached_property
    def measures(self) -> Mapping[str, Measures]:
        """Return the measures of each person."""
        return {name: measures(one.stature_m) for name, one in self.script.people.items()}

    @cached_property
    def _table(self) -> Floats:
        """Return positions and quaternions (rows, n, 7) over a round."""
        if self.shared is not None:
            with suppress(OSError):  # the file is not written yet, or was deleted with the run
                return np.asarray(np.load(self.shared, mmap_mode="r"))
        script = self.script
        # The last row is at the end of the round or just after.
        t_s = np.arange(int(np.ceil(script.round_s * RATE_HZ)) + 2) / RATE_HZ
        bodies = [
            BodyMotion(script, self.timelines, name, body, t_s, self.seed)
            for name, body in self.measures.items()
        ]
        eyes = {name: body.eyes_about_m for name, body in zip(script.people, bodies, strict=True)}
        rows = [row for body in bodies for row in body.pose(eyes)]
        hands = {(body.name, side): body.hands[side] for body in bodies for side in SIDES}
        ahead = {body.name: body.ahead for body in bodies}
        for name in script.things:
            found = object_handover.holders(script, self.timelines, name)
            rows.append(object_handover.thing_poses(t_s, found, hands, ahead))
        return np.stack(rows, axis=1) if rows else np.zeros((len(t_s), 0, 7))

    def with_shared_file(self, file: Path) -> "Figures":
        """Return the same people, with their motion in a file once ``share`` has written it."""
        return type(self)(self.script, self.seed, file)

    def share(self) -> None:
        """Write the motion into the shared file for the other processes, if there is one."""
        if self.shared is not None:
            half = self.shared.with_suffix(".half.npy")
            np.save(half, self._table)
            half.rename(self.shared)

    def segments(self, t_s: float) -> Segments:
        """Return all segments at a time; the time continues over rounds."""
        if self._last is not None and self._last[0] == t_s:
            return self._last[1]
        at = (t_s % self.script.round_s) * RATE_HZ
        row = int(at)
        before, after = self._table[row], self._table[row + 1]
        now = before + (at - row) * (after - before)
        if self.boxer is not None and (rows := self._track.rows(t_s)) is not None:
            now = self._moved(now, rows)
        quat = now[:, 3:]
        found = Segments(now[:, :3], quat / np.sqrt((quat * quat).sum(axis=1, keepdims=True)))
        self._last = (t_s, found)
        return found

    # --- the boxer that a person moves

    @cached_property
    def boxer(self) -> str | None:
        """Return the name of the first person with gloves, None without one."""
        return next((name for name, one in self.script.people.items() if one.gloves), None)

    @cached_property
    def _track(self) -> OpponentTrack:
        return OpponentTrack(self.shared and self.shared.with_suffix(".moved"))

    @cached_property
    def opponent(self) -> Opponent | None:
        """Return the boxer as a person moves it, None without one; of one process alone."""
        return None if self.boxer is None else Opponent(lambda: self._home_m, lambda: self._track)

    @cached_property
    def _home_m(self) -> Vec3:
        hand = self._guard[_SEGMENT["left_hand"]]
        x, y, z = (hand[:3] - FIST_M * rotation_matrix(hand[3:])[:, 2]).tolist()
        return x, y, z

    @cached_property
    def _of_boxer(self) -> slice:
        first = self.row[f"{self.boxer}/{SEGMENTS[0]}"]
        return slice(first, first + len(SEGMENTS))

    @cached_property
    def _guard(self) -> Floats:
        """Return the boxer's segments (n, 7) at the first time with nothing but guard."""
        acts = self.timelines[self.boxer or ""]
        own = [one for one in acts if one.act.do not in ("guard", "look_at")]
        times = np.arange(0.5, self.script.round_s, 0.05).tolist()
        free = (t for t in times if not any(one.start_s <= t <= one.end_s for one in own))
        return np.array(self._table[int(next(free, 0.0) * RATE_HZ)][self._of_boxer])

    def _boxer_at(self, row: OpponentRow) -> Floats:
        """Return the boxer's segments (n, 7) as the person moves them; the last rows are kept."""
        if row.number not in self._poses:
            rows = self._track.row_after(row)  # a whole array of times takes as long as one time
            for one, pose in zip(rows, self._boxer_over(rows), strict=True):
                self._poses[one.number] = pose
            while len(self._poses) > _KEPT_POSES:
                del self._poses[next(iter(self._poses))]
        return self._poses[row.number]

    def _boxer_over(self, rows: Sequence[OpponentRow]) -> Floats:
        """Return the boxer's segments (rows, n, 7) as the person moves them."""
        found = np.repeat(self._guard[None], len(rows), axis=0)
        body = self.measures[self.boxer or ""]
        shift = np.array([(*row.body_m, 0.0) for row in rows])
        found[:, :, :3] += shift[:, None]
        R = rotation_matrix(self._guard[_SEGMENT["torso"], 3:])
        ahead = np.repeat(unit(R[None, :, 0] * (1.0, 1.0, 0.0)), len(rows), axis=0)
        left = np.cross((0.0, 0.0, 1.0), ahead)
        by = np.array([row.fist_m for row in rows]) - self._home_m - shift
        for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
            # The other hand stays in guard, and sinks with the first one.
            by_m = by if side == "left" else np.minimum(by, 0.0) * (0.0, 0.0, 1.0)
            at = [_SEGMENT[f"{side}_{part}"] for part in ("upper_arm", "forearm", "hand")]
            shoulder, wrist = found[:, at[0], :3].copy(), found[:, at[2], :3] + by_m
            frame = Frame(shoulder, shoulder, shoulder, ahead, left, sign, body)
            hand = fist_pose(frame, wrist, smooth_rise((by_m * ahead).sum(axis=1) / _PUNCH_OUT_M))
            for segment, (p_m, R_segment) in zip(at, arm_poses(shoulder, hand, body), strict=True):
                found[:, segment] = np.concatenate((p_m, quaternions(R_segment)), axis=1)
        return found

    def _moved(self, now: Floats, rows: tuple[OpponentRow, OpponentRow, float]) -> Floats:
        """Return all segments with the boxer between the script's pose and the person's."""
        before, after, between = rows
        first, moved, own = self._boxer_at(before), now.copy(), now[self._of_boxer]
        pose = first + between * (_near(self._boxer_at(after), first) - first)
        share = before.share + between * (after.share - before.share)
        moved[self._of_boxer] += share * (_near(pose, own) - own)
        return moved


def _near(poses: Floats, others: Floats) -> Floats:
    """Return the same poses (n, 7), each quaternion with the sign that is nearer to another."""
    away = (poses[:, 3:] * others[:, 3:]).sum(axis=1, keepdims=True) < 0.0
    return np.concatenate((poses[:, :3], np.where(away, -poses[:, 3:], poses[:, 3:])), axis=1)
