"""Offset that is added to the pose by gaze, and angles that tracks give instead of it."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from gazerig.gaze.track.track import LID_CHANNELS, POSE_CHANNELS
from gazerig.gaze.types import Angles2, Angles3

_EYES, _LIDS = POSE_CHANNELS.index("eyes_yaw"), POSE_CHANNELS.index(LID_CHANNELS[0])

Owned = Mapping[int, tuple[float, float]]
"""Value, and share 0..1, of each channel that tracks give instead of gaze."""


class PoseOffset(NamedTuple):
    """Offset that is added to the pose by gaze.

    head_rad: added to the head's (yaw, pitch, roll); the eyes compensate it
    eyes_rad: added to both eyes' (yaw, pitch) in the head
    lids: factors on the openings of the left and right upper and the left and right lower lid
    joints_rad: angles of the joints that gaze does not move, in their order
    owned: what tracks give instead of gaze
    """

    head_rad: Angles3 = (0.0, 0.0, 0.0)
    eyes_rad: Angles2 = (0.0, 0.0)
    lids: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    joints_rad: tuple[float, ...] = ()
    owned: Owned = {}

    def to_flat(self) -> tuple[float, ...]:
        """Return all values as one sequence: head, eyes, lids, joints."""
        return (*self.head_rad, *self.eyes_rad, *self.lids, *self.joints_rad)

    @classmethod
    def from_flat(cls, values: Sequence[float], owned: Owned = {}) -> "PoseOffset":  # noqa: B006
        """Return the offset from the result of ``to_flat``."""
        yaw, pitch, roll, eye_yaw, eye_pitch, a, b, c, d, *joints = values
        offset = cls((yaw, pitch, roll), (eye_yaw, eye_pitch), (a, b, c, d), (), owned)
        mixed = [offset.mix(len(POSE_CHANNELS) + i, angle) for i, angle in enumerate(joints)]
        return offset._replace(joints_rad=tuple(mixed))

    def mix(self, channel: int, value: float) -> float:
        """Return the value of a channel for the value by gaze."""
        owned, share = self.owned.get(channel, (0.0, 0.0))
        return value + share * (owned - value)

    def mix_head(self, head: Angles3) -> Angles3:
        """Return the head's angles."""
        return self.mix(0, head[0]), self.mix(1, head[1]), self.mix(2, head[2])

    def mix_eye(self, eye: Angles2) -> Angles2:
        """Return the angles of an eye in the head."""
        return self.mix(_EYES, eye[0]), self.mix(_EYES + 1, eye[1])

    def mix_lids(
        self, openings: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        """Return the openings of the lids, 0 shut .. 1 open."""
        mixed = [self.mix(_LIDS + i, opening) for i, opening in enumerate(openings)]
        a, b, c, d = [min(max(one, 0.0), 1.0) for one in mixed]
        return a, b, c, d


NO_OFFSET = PoseOffset()
