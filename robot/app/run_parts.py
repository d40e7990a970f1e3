"""Values passed between the parts of a run: its bus, and the placement of its camera."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from gazerig.drivers.camera.double_buffer import PoseBuffer
from gazerig.drivers.types import ServoBus
from gazerig.robot.model.frames import CameraMount, PoseHistory

TrueSteps = Callable[[], Mapping[str, float]]
"""Function that returns the present true positions of the servos in steps, by joint."""


class RunBus(NamedTuple):
    """The bus of the rig.

    true_steps: true positions of the servos, None if unknown in this process
    digest: returns the SHA-256 of all bytes sent, None if they are not counted
    close: ends the processes started for it
    fault: executes a fault command of the emulated servos, None for real or ideal ones
    """

    bus: ServoBus
    true_steps: TrueSteps | None = None
    digest: Callable[[], str | None] = lambda: None
    close: Callable[[], None] = lambda: None
    fault: Callable[[str], str] | None = None


class Sight(NamedTuple):
    """Placement of the camera, history of the head's pose, and its further receivers."""

    mount: CameraMount
    poses: PoseHistory
    turns: PoseBuffer | None
