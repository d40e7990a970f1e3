"""Access to one hobby servo on a board, moved slowly by a person who watches it.

The servo has no position sensor: its position is that of its pulse unless something blocks it. The
board has no watchdog: a guardian stops the pulses if this program is killed.
"""

from collections.abc import Callable

from gazerig.drivers.bus.servo_models import US_STEPS
from gazerig.drivers.errors import BusLost
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.robot.guardian.guardian import GuardedBus, Guardian
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.joint import JointParams

PERIOD_S = 0.03
SPEED_US_S = 200.0
"""18 deg/s of the shaft: slow enough to stop before something bends."""

NEAR_STEPS = 4
TIMEOUT_S = 1.0
"""Time after the planned arrival at which an unreached goal is given up."""

SILENT_S = 2.0


class HobbyServoAccess:
    """The servo of one joint.

    Args:
        name: name of the joint.
        joint: configuration of the joint.
        port: port of the board; opened by ``open``.
        params: protocol of the board.
        clock: clock of the host.
        stopped: called regularly; returns why to stop, None without a reason.
        pulses_us: range of permitted pulses.
        guardian: has one plan, for this servo; None: nothing else stops its pulses.
    """

    def __init__(
        self,
        name: str,
        joint: JointParams,
        port: BusPort,
        params: MaestroParams | Pca9685Params,
        clock: Clock,
        stopped: Callable[[], str | None],
        pulses_us: tuple[float, float],
        guardian: Guardian | None = None,
    ) -> None:
        self.name, self.joint = name, joint
        self.who = f"{name} (channel {joint.id})"
        self._clock, self._stopped = clock, stopped
        low, high = (round(end * US_STEPS) for end in pulses_us)
        speed = SPEED_US_S * US_STEPS
        self._setup = ServoConfig(joint.id, joint.model, low, high, speed, name)
        self._maestro = isinstance(params, MaestroParams)
        board: Board
        if isinstance(params, MaestroParams):
            board = MaestroBoard(port, params)
        else:
            board = Pca9685Board(port, params)
        bus = HobbyBoardBus(board, [self._setup])
        self._bus: ServoBus = (
            bus if guardian is None else GuardedBus(bus, [self._setup], guardian, 0)
        )
        self._goal = self._pulse = 0
        self._on = False
        self._said: list[str] = []

    @property
    def place_us(self) -> float:
        """Return the commanded pulse."""
        return self._goal / US_STEPS

    @property
    def pulse_us(self) -> float:
        """Return the present pulse."""
        return self._pulse / US_STEPS

    def open(self) -> float | None:
        """Find board and channel; return the pulse width in us, None without pulses.

        Raises:
            SetupError: the board or the channel does not answer.
        """
        self._bus.open()
        self._read()
        return self._pulse / US_STEPS if self._on else None

    def begin(self, place_us: float) -> float:
        """Hold the joint at its present pulse, or start with a given one; return the pulse in us.

        A servo without pulses moves there immediately, at its own speed.

        Raises:
            ServoMissing: the channel does not accept it.
        """
        self._bus.retune([self._setup._replace(rest_steps=self._within(place_us))])
        (self._goal,) = self._bus.enable_torque()
        return self.place_us

    def aim(self, place_us: float) -> float:
        """Move slowly to a pulse; return that pulse, limited to the permitted range."""
        self._goal = self._within(place_us)
        return self.place_us

    def look(self) -> bool:
        """Wait a moment and continue the motion; return whether it is at its goal.

        Raises:
            BusLost: the board does not answer any more.
            CalibrationStopped: a person or the system requested the end.
        """
        why = self._stopped()
        if why is not None:
            raise CalibrationStopped(why)
        self._clock.sleep_until(self._clock.now_s() + PERIOD_S)
        at = self._read()
        self._bus.write([self._goal])
        return abs(at - self._goal) <= NEAR_STEPS

    def arrive(self) -> float:
        """Move the servo to its goal; return the pulse in us at the end.

        Raises:
            BusLost, CalibrationStopped: see ``look``.
        """
        way = abs(self._goal - self._read()) / US_STEPS
        end_s = self._clock.now_s() + way / SPEED_US_S + TIMEOUT_S
        while not self.look():
            if self._clock.now_s() > end_s:
                self._goal = self._pulse
                break
        return self.place_us

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call."""
        said, self._said = self._said, []
        return (*self._bus.events(), *said)

    def disable(self) -> None:
        """Stop its pulses and close the port; safe to call at any time.

        Raises:
            BusLost: the port has disappeared.
        """
        try:
            self._bus.disable_torque()
        finally:
            self._bus.close()

    def _within(self, place_us: float) -> int:
        low, high = self._setup.min_steps, self._setup.max_steps
        return min(max(round(place_us * US_STEPS), low), high)

    def _read(self) -> int:
        """Read the board until it replies; return its present pulse in steps."""
        end_s = self._clock.now_s() + SILENT_S
        while True:
            feedback = self._bus.read(self._clock.now_s())
            if not feedback.missing:
                self._pulse, self._on = int(feedback.position_steps[0]), feedback.torque[0]
                if feedback.rearmed[0]:
                    # Keep the pulse of the board, for any reason.
                    sent_us, self._goal = self.place_us, self._pulse
                    remedy = (
                        ": if it never comes farther, widen the range of its channel in "
                        "Pololu's program"
                    )
                    self._said.append(
                        f"{self.who} was sent to {sent_us:g} us and is held at "
                        f"{self.pulse_us:g} us{remedy if self._maestro else ''}"
                    )
                return self._pulse
            if self._clock.now_s() > end_s:
                raise BusLost(f"{self.who}: the board does not answer: check its cable and power")
            self._clock.sleep_until(self._clock.now_s() + PERIOD_S)
