"""The head of a rig, real or emulated, moved gently while its camera is calibrated."""

import contextlib
from collections.abc import Callable, Iterator
from math import degrees

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.camera_calibration import CameraCalibrationRefused
from gazerig.features.bringup.cli.manual_session import holding_rig
from gazerig.features.bringup.cli.ports import rig_ports
from gazerig.features.bringup.cli.prompts import Lines, TerminalPerson
from gazerig.features.bringup.manual_control import JogParams, ManualControl
from gazerig.gaze.types import Angles3
from gazerig.robot.cli.terminal import say
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.model.kinematics import NECK
from gazerig.sim_mock.cameras.charuco_scene import BoardScene

StopReason = Callable[[], str | None]
"""Returns why to stop, None while there is no reason."""

_GENTLE_DEG_S = 15.0
_SETTLE_S = 0.4


class JoggedNeck:
    """A ``calibration.camera_procedure.Neck`` that goes through the guard, as jogging does."""

    def __init__(
        self, control: ManualControl, mock: BoardScene | None, stopped: StopReason
    ) -> None:
        self._control, self._mock, self._stopped = control, mock, stopped
        self._angles: Angles3 = (0.0, 0.0, 0.0)

    def turn(self, head_rad: Angles3) -> None:
        """Move gently; if the guard holds it back, the measured angles count."""
        refuse_stop(self._stopped)
        there = self._control.body.names
        axes = zip(NECK, head_rad, strict=True)
        goal = {name: degrees(a) for name, a in axes if name in there}
        moved = self._control.pose(goal)
        if moved.ended == "torque_off":
            raise SetupError(
                "the torque went off during the move: see gazerig doctor, then start again"
            )
        self.rest(_SETTLE_S)

    def rest(self, seconds: float) -> None:
        """Hold still, and measure the head."""
        moved = self._control.hold(seconds)
        refuse_stop(self._stopped)
        at = dict(zip(self._control.body.names, moved.last.joints.position_rad, strict=True))
        self._angles = (at.get(NECK[0], 0.0), at.get(NECK[1], 0.0), at.get(NECK[2], 0.0))
        if self._mock is not None:
            self._mock.head_rad = self._angles

    def angles(self) -> Angles3:
        """Return yaw, pitch and roll as last measured."""
        return self._angles


@contextlib.contextmanager
def moving_neck(
    rig: Rig, mock: BoardScene | None, port: str | None, stopped: StopReason, yes: bool
) -> Iterator[JoggedNeck]:
    """Return a neck that moves gently; whatever happens, it ends with the torque off.

    mock: the simulated board, for which the servos are emulated too

    Raises:
        SetupError: port or servos are not as configured, or the answer was no.
    """
    if any(name not in rig.joints for name in NECK[:2]):
        raise CameraCalibrationRefused(
            "the camera's place is found by turning the neck left, right, up and down, and "
            "this rig's does not: measure its place and write it into camera.position_mm"
        )
    say("hang the board upright, 0.5 to 1 m before the head, where it cannot move; the head")
    say("will look at it from several sides: keep your fingers away; Ctrl-C stops it")
    if mock is not None:
        mock.hang()
    elif not confirm(stopped, yes, "does the board hang, and is the head free to move?"):
        raise CameraCalibrationRefused("left out as you asked: nothing was written")
    params = JogParams(speed_deg_s=_GENTLE_DEG_S)
    with (
        rig_ports(rig, mock is not None, port) as wire,
        holding_rig(rig, wire.paths, params, stopped, Interrupts.of(stopped)) as control,
    ):
        neck = JoggedNeck(control, mock, stopped)
        neck.rest(0.1)
        yield neck


def refuse_stop(stopped: StopReason) -> None:
    """Refuse to continue if there is a reason to stop.

    Raises:
        CameraCalibrationRefused: with the reason.
    """
    why = stopped()
    if why is not None:
        raise CameraCalibrationRefused(f"stopped by {why}: nothing was written")


def confirm(stopped: StopReason, yes: bool, question: str) -> bool:
    """Ask on the terminal; yes: the reply is known."""
    return TerminalPerson(Lines(None), stopped, yes).agrees(question)
