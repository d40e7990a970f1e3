"""What a run hands from part to part: its bus, and where its camera is."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from gazerig.drivers.camera.pose_buffer import PoseBuffer
from gazerig.drivers.types import ServoBus
from gazerig.robot.model.frames import CameraMount, PoseHistory

TrueSteps = Callable[[], Mapping[str, float]]
"""Returns the true positions of the servos now in steps, by joint."""


def _no_digest() -> str | None:
    return None


def _nothing() -> None:
    return None


class RunBus(NamedTuple):
    """The bus of the rig.

    true_steps: where the servos truly are, None where that is unknown in this process
    digest: returns the SHA-256 of all bytes sent, None where they are not counted
    close: ends what was started for it
    fault: carries out a fault command of the emulated servos, None where they are real or ideal
    """

    bus: ServoBus
    true_steps: TrueSteps | None = None
    digest: Callable[[], str | None] = _no_digest
    close: Callable[[], None] = _nothing
    fault: Callable[[str], str] | None = None


class Sight(NamedTuple):
    """Where the camera sits, where the head was when, and who else receives it."""

    mount: CameraMount
    poses: PoseHistory
    turns: PoseBuffer | None
