"""Views of a board at rest from several neck angles, step by step.

Nothing here prints: the caller of the steps shows them.
"""

from collections.abc import Callable, Iterator, Sequence
from math import atan, degrees, radians
from typing import NamedTuple

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import SetupError
from gazerig.drivers.vision.charuco_board import CharucoBoard
from gazerig.features.bringup.calibration.hand_eye import NeckView
from gazerig.features.bringup.manual_control import ManualControl
from gazerig.gaze.types import Angles2, Angles3, HeadGeometry
from gazerig.robot.model.kinematics import NECK

Look = Callable[[], Shot | None]
"""Returns the newest frame immediately, None before the first."""

# Fractions of the neck's range (yaw, pitch, roll): combinations of two axes, symmetric.
_PATTERN = (
    (0.0, 0.0, 0.0), (0.5, 0.5, 1.0), (1.0, 0.0, 0.0), (1.0, 0.0, -1.0), (0.9, 0.8, 0.0),
    (0.0, 1.0, 0.0), (-0.5, 0.5, -1.0), (-0.9, 0.8, 0.0), (-1.0, 0.0, 0.0), (-1.0, 0.0, 1.0),
    (-0.9, -0.8, 0.0), (-0.5, -0.5, 1.0), (0.0, -1.0, 0.0), (0.5, -0.5, -1.0), (0.9, -0.8, 0.0),
    (0.0, 0.0, 1.0), (0.0, 0.0, -1.0),
)  # fmt: skip
_YAW_DEG, _PITCH_DEG, _ROLL_DEG = 18.0, 11.0, 12.0
# A head that moved more while the frame was taken makes it useless.
_STILL_RAD = radians(0.2)
_SETTLE_S, _TIMEOUT_S = 0.4, 4.0


class JoggedNeck:
    """Neck that moves gently through the guard, like jogging; watch: receives its angles."""

    def __init__(
        self, control: ManualControl, watch: Callable[[Angles3], None] | None = None
    ) -> None:
        self._control, self._watch = control, watch
        self.angles: Angles3 = (0.0, 0.0, 0.0)
        """Yaw, pitch and roll as last measured."""

    def turn(self, head_rad: Angles3) -> None:
        """Move to a yaw, pitch and roll; if the guard limits it, the measured angles are used.

        Raises:
            DriverError: the movement is not possible.
        """
        there = self._control.body.names
        axes = zip(NECK, head_rad, strict=True)
        moved = self._control.pose({name: degrees(a) for name, a in axes if name in there})
        if moved.end_reason == "torque_off":
            raise SetupError(
                "the torque went off during the move: see gazerig doctor RIG, then start again"
            )
        self.rest(_SETTLE_S)

    def rest(self, seconds: float) -> None:
        """Hold still for a time, so that no watchdog expires, and measure the head."""
        moved = self._control.hold(seconds)
        at = dict(zip(self._control.body.names, moved.last.joints.position_rad, strict=True))
        self.angles = (at.get(NECK[0], 0.0), at.get(NECK[1], 0.0), at.get(NECK[2], 0.0))
        if self._watch is not None:
            self._watch(self.angles)


class NeckStep(NamedTuple):
    """Result at one neck angle: the requested angles, and the view, or None and why not."""

    asked_rad: Angles3
    view: NeckView | None
    why: str


def neck_angles(
    ranges_rad: Sequence[Angles2], lens: Intrinsics, width_px: int, height_px: int
) -> tuple[Angles3, ...]:
    """Plan angles at which a board straight ahead stays in the image.

    ranges_rad: lowest and highest permitted yaw, pitch and roll of the neck
    """
    half = (degrees(atan(0.5 * width_px / lens.fx_px)), degrees(atan(0.5 * height_px / lens.fy_px)))
    far_deg = (min(_YAW_DEG, 0.55 * half[0]), min(_PITCH_DEG, 0.5 * half[1]), _ROLL_DEG)

    def within(axis: int, share: float) -> float:
        # A tenth of the range is not used: no view is taken at its ends.
        low, high = (0.9 * end for end in ranges_rad[axis])
        return min(max(share * radians(far_deg[axis]), low), high)

    planned = [(within(0, yaw), within(1, pitch), within(2, roll)) for yaw, pitch, roll in _PATTERN]
    return tuple(dict.fromkeys(planned))


def neck_steps(
    neck: JoggedNeck,
    look: Look,
    now_s: Callable[[], float],
    board: CharucoBoard,
    geometry: HeadGeometry,
    angles_rad: Sequence[Angles3],
) -> Iterator[NeckStep]:
    """View the board from one neck angle after another, and straight ahead at the end.

    geometry: gives the head's pose for measured angles

    Raises:
        DriverError: head or camera have failed.
    """
    for asked in angles_rad:
        neck.turn(asked)
        arrived_s, view, why = now_s(), None, "no new frame came"
        while view is None and now_s() - arrived_s < _TIMEOUT_S:
            before = neck.angles
            neck.rest(0.04)
            shot = look()
            neck.rest(0.02)
            # A frame from before the head came to rest shows the board from another position.
            if shot is None or shot.captured_s <= arrived_s:
                continue
            moved_rad = max(abs(a - b) for a, b in zip(before, neck.angles, strict=True))
            seen = board.find(shot.image)
            if moved_rad > _STILL_RAD:
                why = "the head does not hold still"
            elif seen is None:
                why = "no board seen"
            else:
                view = NeckView(*geometry.head_pose(neck.angles), seen)
        yield NeckStep(asked, view, why)
    neck.turn((0.0, 0.0, 0.0))
