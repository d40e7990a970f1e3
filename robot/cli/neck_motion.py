"""The head of a rig, real or emulated, moved gently while its camera is calibrated."""

import contextlib
from collections.abc import Callable, Iterator
from math import degrees
from typing import Any

from gazerig.config.schema import Rig
from gazerig.drivers.errors import SetupError
from gazerig.gaze.types import Angles3
from gazerig.robot.app.bus_wiring import guarded_rig_bus
from gazerig.robot.app.rig_limits import limits, park_rad
from gazerig.robot.calibration.camera_calibration import CameraCalibrationRefused
from gazerig.robot.cli.messages import left_alone
from gazerig.robot.cli.terminal import say
from gazerig.robot.control.body import Body
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.power_down import PowerDown
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.kinematics import NECK
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.cameras.charuco_scene import BoardScene

Stopped = Callable[[], str | None]
"""Gives why to stop, None while there is no reason."""

_GENTLE_DEG_S = 15.0
_SETTLE_S = 0.4


class JoggedNeck:
    """A ``calibration.camera_procedure.Neck`` that goes through the guard, as jogging does."""

    def __init__(self, control: Any, mock: BoardScene | None, stopped: Stopped) -> None:
        self._control, self._mock, self._stopped = control, mock, stopped
        self._angles: Angles3 = (0.0, 0.0, 0.0)

    def turn(self, head_rad: Angles3) -> None:
        """Move gently; where the guard holds it back, what is measured counts."""
        go_on(self._stopped)
        there = self._control.body.names
        axes = zip(NECK, head_rad, strict=True)
        goal = {name: degrees(a) for name, a in axes if name in there}
        moved = self._control.pose(goal)
        if moved.ended == "limp":
            raise SetupError("the torque went off on the way: see gazerig doctor, then begin anew")
        self.rest(_SETTLE_S)

    def rest(self, seconds: float) -> None:
        """Hold, and note where the head is."""
        moved = self._control.hold(seconds)
        go_on(self._stopped)
        at = dict(zip(self._control.body.names, moved.last.joints.position_rad, strict=True))
        self._angles = (at.get(NECK[0], 0.0), at.get(NECK[1], 0.0), at.get(NECK[2], 0.0))
        if self._mock is not None:
            self._mock.head_rad = self._angles

    def angles(self) -> Angles3:
        """Return yaw, pitch and roll as last measured."""
        return self._angles


@contextlib.contextmanager
def moving_neck(
    rig: Rig, mock: BoardScene | None, port: str | None, stopped: Stopped, yes: bool
) -> Iterator[JoggedNeck]:
    """Return a neck that moves gently; whatever happens, it ends with the torque off.

    mock: the simulated board, for which the servos are emulated too

    Raises:
        SetupError: port or servos are not as configured, or the answer was no.
    """
    from gazerig.robot.bringup.manual_control import JogParams, ManualControl, parked  # type: ignore[import-not-found, unused-ignore]
    from gazerig.robot.cli.ports import wires  # type: ignore[import-not-found, unused-ignore]

    if any(name not in rig.joints for name in NECK[:2]):
        raise CameraCalibrationRefused(
            "where the camera sits is found by turning the neck left, right, up and down, and "
            "this rig's does not: measure its place and write it into camera.position_mm"
        )
    say("hang the board upright, 0.5 to 1 m before the head, where it cannot move; the head")
    say("will look at it from several sides: keep your fingers away; Ctrl-C stops it")
    if mock is not None:
        mock.hang()
    elif not agrees(stopped, yes, "does the board hang, and is the head free to move?"):
        raise CameraCalibrationRefused("left out as you wished: nothing was written")
    with wires(rig, mock is not None, port) as wire:
        body = Body(guarded_rig_bus(rig, wire.paths), rig.joints, park_rad(rig))
        params = JogParams(speed_deg_s=_GENTLE_DEG_S)
        period_s = 1.0 / params.rate_hz
        guard = Guard(rig.guard, limits(rig.joints), rig.names, period_s=period_s)
        control = ManualControl(body, guard, RealClock(), params, stopped)
        with PowerDown(
            lambda again: parked(control, rig.park_deg, again),
            control.stop,
            say,
            Interrupts.of(stopped),
            "torque off on all servos",
            f": {left_alone(rig)}",
        ) as way_out:
            way_out.switch_on(control.start)
            neck = JoggedNeck(control, mock, stopped)
            neck.rest(0.1)
            yield neck


def go_on(stopped: Stopped) -> None:
    """Refuse to go on where there is a reason to stop.

    Raises:
        gazerig.robot.calibration.camera_calibration.CameraCalibrationRefused: with the reason.
    """
    why = stopped()
    if why is not None:
        raise CameraCalibrationRefused(f"stopped by {why}: nothing was written")


def agrees(stopped: Stopped, yes: bool, question: str) -> bool:
    """Ask on the terminal; yes: the answer is known."""
    from gazerig.robot.cli.prompts import (  # type: ignore[import-not-found, unused-ignore]
        Lines,
        TerminalPerson,
    )

    return bool(TerminalPerson(Lines(None), stopped, yes).agrees(question))
