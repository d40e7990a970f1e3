"""Offset that is added to the pose by gaze, as one value."""

from typing import NamedTuple

from gazerig.gaze.track.owned_pose import OwnedPose
from gazerig.gaze.types import Angles2, Angles3


class PoseOffset(NamedTuple):
    """Offset that is added to the pose by gaze.

    head_rad: added to the head's (yaw, pitch, roll); the eyes compensate it
    eyes_rad: added to both eyes' (yaw, pitch) in the head
    lids: factors on the openings of the left and right upper and the left and right lower lid
    joints_rad: angles of the joints that gaze does not move, in their order
    owned: angles that tracks give instead of gaze, None without such a track
    """

    head_rad: Angles3 = (0.0, 0.0, 0.0)
    eyes_rad: Angles2 = (0.0, 0.0)
    lids: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    joints_rad: tuple[float, ...] = ()
    owned: OwnedPose | None = None

    def combine(self, other: "PoseOffset") -> "PoseOffset":
        """Return both combined: angles are added, factors of the lids multiplied."""
        if not any(self.joints_rad) and self[:3] == NO_OFFSET[:3]:
            return other
        if not any(other.joints_rad) and other[:3] == NO_OFFSET[:3]:
            return self
        a, b = self.to_flat(), other.to_flat()
        lids = [x * y for x, y in zip(a[5:9], b[5:9], strict=True)]
        angles = [x + y for x, y in zip(a, b, strict=True)]
        return PoseOffset.from_flat((*angles[:5], *lids, *angles[9:]))

    def to_flat(self) -> tuple[float, ...]:
        """Return all values as one sequence: head, eyes, lids, joints."""
        return (*self.head_rad, *self.eyes_rad, *self.lids, *self.joints_rad)

    @classmethod
    def from_flat(cls, values: tuple[float, ...]) -> "PoseOffset":
        """Return the offset from the result of ``flat``."""
        yaw, pitch, roll, eye_yaw, eye_pitch, a, b, c, d, *joints = values
        return cls((yaw, pitch, roll), (eye_yaw, eye_pitch), (a, b, c, d), tuple(joints))


NO_OFFSET = PoseOffset()
