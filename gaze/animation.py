"""Motion laid over gaze: what gestures, expressions and levels add to the pose of the head.

Gaze goes on beneath: what is added to the head's angles is compensated by the eyes, which stay
on their target (the vestibulo-ocular reflex of ``gazerig.gaze.oculomotor``).
"""

from typing import NamedTuple

from gazerig.gaze.types import Angles2, Angles3


class PoseOffset(NamedTuple):
    """What is added to the pose that gaze asks for.

    head_rad: added to the head's (yaw, pitch, roll); the eyes compensate it
    eyes_rad: added to both eyes' (yaw, pitch) in the head
    lids: factors on the openings of the left and right upper and the left and right lower lid
    joints_rad: angles of the joints that gaze does not move, in their order
    """

    head_rad: Angles3 = (0.0, 0.0, 0.0)
    eyes_rad: Angles2 = (0.0, 0.0)
    lids: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    joints_rad: tuple[float, ...] = ()


NO_OFFSET = PoseOffset()


class Animation:
    """Everything that moves beside gaze, as one offset a tick."""

    def __init__(self, joints: tuple[str, ...] = ()) -> None:
        """Begin at rest.

        Args:
            joints: the joints that gaze does not move (``gazerig.robot.model.types.further``).
        """
        self._rest = PoseOffset(joints_rad=(0.0,) * len(joints))

    def reset(self, t_s: float) -> None:
        """Begin at rest at a time."""

    def step(self, t_s: float) -> PoseOffset:
        """Return what is added to the pose in this tick."""
        return self._rest
