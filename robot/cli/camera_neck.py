"""The head of a rig, real or emulated, moved gently while its camera is calibrated."""

import contextlib
from collections.abc import Callable, Iterator
from math import degrees
from typing import Any

from config.schema import Rig
from drivers.dynamixel import DynamixelBus
from drivers.errors import DriverError, SetupError
from drivers.serial_port import BlockingPort
from gaze.types import Angles3
from robot.body import Body
from robot.calibrate.camera_calibration import CameraCalibrationRefused
from robot.cli.terminal import say
from robot.clock import RealClock
from robot.safety.guard import Guard
from robot.types import JOINTS
from sim_mock.board_scene import BoardScene

NECK = tuple(name for name in JOINTS if name.startswith("neck_"))

Stopped = Callable[[], str | None]
"""Gives why to stop, None while there is no reason."""

_GENTLE_DEG_S = 15.0
_SETTLE_S = 0.4
_FIRST = JOINTS.index(NECK[0])


class JoggedNeck:
    """A robot.calibrate.camera_steps.Neck that goes through the guard, as jogging does."""

    def __init__(self, control: Any, mock: BoardScene | None, stopped: Stopped) -> None:
        """Take a started ManualControl, and the scene that must know of the head."""
        self._control, self._mock, self._stopped = control, mock, stopped
        self._angles: Angles3 = (0.0, 0.0, 0.0)

    def turn(self, head_rad: Angles3) -> None:
        """Move gently; where the guard holds it back, what is measured counts."""
        go_on(self._stopped)
        goal = {name: degrees(a) for name, a in zip(NECK, head_rad, strict=True)}
        moved = self._control.pose(goal)
        if moved.ended == "limp":
            raise SetupError("the torque went off on the way: see gazerig doctor, then begin anew")
        self.rest(_SETTLE_S)

    def rest(self, seconds: float) -> None:
        """Hold, and note where the head is."""
        moved = self._control.hold(seconds)
        go_on(self._stopped)
        self._angles = moved.last.joints.position_rad[_FIRST : _FIRST + 3]
        if self._mock is not None:
            self._mock.head_rad = self._angles

    def angles(self) -> Angles3:
        """Give yaw, pitch and roll as last measured."""
        return self._angles


@contextlib.contextmanager
def moving_neck(
    rig: Rig, mock: BoardScene | None, port: str | None, stopped: Stopped, yes: bool
) -> Iterator[JoggedNeck]:
    """Give a neck that moves gently; whatever happens, it ends with the torque off.

    mock: the simulated board, for which the servos are emulated too

    Raises:
        drivers.errors.SetupError: port or servos are not as configured, or the answer was no.
    """
    from robot.bringup.jog import JogParams, ManualControl  # type: ignore[import-not-found, unused-ignore]
    from robot.cli.wires import wires  # type: ignore[import-not-found, unused-ignore]

    say("hang the board upright, 0.5 to 1 m before the head, where it cannot move; the head")
    say("will look at it from several sides: keep your fingers away; Ctrl-C stops it")
    if mock is not None:
        mock.hang()
    elif not agrees(stopped, yes, "does the board hang, and is the head free to move?"):
        raise CameraCalibrationRefused("left out as you wished: nothing was written")
    with wires(rig, mock is not None, port) as wire:
        setups = [rig.joints[name].setup() for name in JOINTS]
        bus = DynamixelBus(BlockingPort(wire.path), setups, rig.bus.dynamixel)
        guard = Guard(rig.guard, tuple(rig.joints[name].limit() for name in JOINTS))
        params = JogParams(speed_deg_s=_GENTLE_DEG_S)
        control = ManualControl(Body(bus, rig.joints), guard, RealClock(), params, stopped)
        control.start()
        try:
            neck = JoggedNeck(control, mock, stopped)
            neck.rest(0.1)
            yield neck
        finally:
            try:
                control.park(rig.park_deg)
            except DriverError as error:
                say(f"not parked ({error})")
            finally:
                control.stop()
                say("torque off on all servos")


def go_on(stopped: Stopped) -> None:
    """Refuse to go on where there is a reason to stop.

    Raises:
        robot.calibrate.camera_calibration.CameraCalibrationRefused: with the reason.
    """
    why = stopped()
    if why is not None:
        raise CameraCalibrationRefused(f"stopped by {why}: nothing was written")


def agrees(stopped: Stopped, yes: bool, question: str) -> bool:
    """Ask on the terminal; yes: the answer is known."""
    from robot.cli.person import (  # type: ignore[import-not-found, unused-ignore]
        Lines,
        TerminalPerson,
    )

    return bool(TerminalPerson(Lines(None), stopped, yes).agrees(question))
