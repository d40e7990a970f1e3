"""Calibration of one hobby servo on a board, moved slowly by a person who reads its angles.

The servo has no position sensor: its position is that of its pulse unless something blocks it. The
board has no watchdog: a guardian stops the pulses if this program is killed.
"""

from collections.abc import Callable
from math import degrees
from typing import Protocol

from gazerig.drivers.bus.servo_models import US_STEPS
from gazerig.drivers.errors import BusLost
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.features.bringup.calibration.joint_calibration import (
    LinkageFit,
    end_names,
    is_lid,
    range_within,
    with_calibration,
    zero_name,
)
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.robot.guardian.guardian import GuardedBus, Guardian
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.joint import JointParams

PULSES_US = (500.0, 2500.0)
"""Range of the pulses; 180 deg or more of a hobby servo."""
PERIOD_S = 0.03
SPEED_US_S = 200.0
"""18 deg/s of the shaft: slow enough to stop before something bends."""

NEAR_STEPS = 4
TIMEOUT_S = 1.0
"""Time after the planned arrival at which an unreached goal is given up."""

SILENT_S = 2.0


def angle_now(joint: JointParams, position: float) -> float:
    """Return the angle of a position according to the rig file, to a tenth of a degree."""
    return round(degrees(joint.angle_rad(position * joint.model_facts.unit_steps)), 1) + 0.0


class Operator(Protocol):
    """A person who answers; ``live`` is called more than 20 times a second meanwhile.

    Every method but ``tell`` raises CalibrationStopped if the user requested the end.
    """

    def tell(self, line: str) -> None:
        """Show the present activity."""
        ...

    def wait(self, question: str, live: Callable[[], str]) -> None:
        """Return when the person is done; ``live`` returns the line to show meanwhile."""
        ...

    def steer(self, question: str, servo: "HobbyServoAccess") -> None:
        """Return when the person has moved a hobby servo to the desired position."""
        ...

    def ask_number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        """Return the person's number, or the proposed one if the person accepts it."""
        ...


class HobbyServoAccess:
    """The servo of one joint, and the person who steers it.

    Args:
        name: name of the joint.
        joint: configuration of the joint.
        port: port of the board; opened by ``begin``.
        params: protocol of the board.
        clock: clock of the host.
        stopped: called regularly; returns why to stop, None without a reason.
        person: steers the servo.
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
        person: Operator,
        guardian: Guardian | None = None,
    ) -> None:
        self.name, self.joint = name, joint
        self.who = f"{name} (channel {joint.id})"
        self._clock, self._stopped, self._person = clock, stopped, person
        low, high = (round(end * US_STEPS) for end in PULSES_US)
        speed = SPEED_US_S * US_STEPS
        self._setup = ServoConfig(joint.id, joint.model, low, high, speed, name)
        maestro = isinstance(params, MaestroParams)
        board = MaestroBoard(port, params) if maestro else Pca9685Board(port, params)
        self._board_bus = bus = HobbyBoardBus(board, [self._setup])
        self._bus: ServoBus = (
            bus if guardian is None else GuardedBus(bus, [self._setup], guardian, 0)
        )
        self._goal = self._pulse = 0
        self._on = False

    @property
    def place_us(self) -> float:
        """Return the commanded pulse."""
        return self._goal / US_STEPS

    def begin(self) -> None:
        """Hold the joint at its present pulse, or at the first pulse that the user chooses.

        A servo without pulses moves there immediately, at its own speed.

        Raises:
            SetupError: the board or the channel does not answer.
        """
        self._bus.open()
        at_us = self._read()
        if not self._on:
            rest = self.joint.make_linkage().steps(0.0) / self.joint.model_facts.unit_steps
            at_us = self._person.ask_number(
                f"{self.who} gets no pulses, so its position is not known: it goes to the first "
                "one at once, at its own full speed. Keep your fingers out. "
                "At which pulse width (us) shall it begin?",
                float(round(rest)),
                str,
            )
        self.aim(at_us)
        self._board_bus.retune([self._setup._replace(rest_steps=self._goal)])
        (self._goal,) = self._bus.enable_torque()
        self._tell_events()
        self._person.tell(
            f"{self.who}: held at {self.place_us:g} us; should this program die, its guardian stops "
            "the pulses; should the computer die, cut the servo power"
        )

    def mark(self, where: str) -> float:
        """Let the user move the joint to a position; return the pulse width in us."""
        self._person.steer(f"move {self.name} {where}, then press Enter", self)
        return self._arrive()

    def move_to(self, place_us: float) -> float:
        """Move the joint slowly to a pulse width; return the reached width."""
        self.aim(place_us)
        return self._arrive()

    def aim(self, place_us: float) -> float:
        """Start a slow motion to a pulse; return that pulse, limited to the permitted range."""
        low, high = self._setup.min_steps, self._setup.max_steps
        self._goal = min(max(round(place_us * US_STEPS), low), high)
        return self.place_us

    def live(self) -> str:
        """Continue the motion; return pulse width and angle as text."""
        self.look()
        angle = angle_now(self.joint, self.place_us)
        return f"{self.name}: {self.place_us:g} us ({angle:+.1f} deg so far)"

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
        self._read()
        self._bus.write([self._goal])
        self._tell_events()
        return abs(self._pulse - self._goal) <= NEAR_STEPS

    def disable(self) -> None:
        """Stop its pulses and close the port; safe to call at any time.

        Raises:
            BusLost: the port has disappeared.
        """
        try:
            self._bus.disable_torque()
        finally:
            self._bus.close()

    def _arrive(self) -> float:
        """Move the servo to its goal; return the pulse in us at the end."""
        way_us = abs(self.place_us - self._read())
        end_s = self._clock.now_s() + way_us / SPEED_US_S + TIMEOUT_S
        while not self.look():
            if self._clock.now_s() > end_s:
                self._goal = self._pulse
        return self.place_us

    def _read(self) -> float:
        """Read the board until it replies; return its present pulse in us."""
        end_s = self._clock.now_s() + SILENT_S
        while (feedback := self._bus.read(self._clock.now_s())).missing:
            if self._clock.now_s() > end_s:
                raise BusLost(f"{self.who}: the board does not answer: check its cable and power")
            self._clock.sleep_until(self._clock.now_s() + PERIOD_S)
        self._pulse, self._on = int(feedback.position_steps[0]), feedback.torque[0]
        if feedback.rearmed[0]:
            # Keep the pulse of the board, for any reason.
            sent_us, self._goal = self.place_us, self._pulse
            self._person.tell(
                f"{self.who} was sent to {sent_us:g} us and is held at {self.place_us:g} us: if it "
                "never comes farther on a Maestro, widen the range of its channel in Pololu's "
                "program"
            )
        return self._pulse / US_STEPS

    def _tell_events(self) -> None:
        for line in self._bus.events():
            self._person.tell(line)


Place = tuple[float, float]
"""(angle, position)"""


def calibrate_by_marks(hobby: HobbyServoAccess, person: Operator, margin_deg: float) -> LinkageFit:
    """Mark the ends of a joint, its zero, and a position between each two; ask for their angles.

    margin_deg: distance from the ends, not for lids

    Raises:
        CalibrationRefused: the marks do not give a linkage.
        DriverError: the servo does not answer any more.
        CalibrationStopped: the person ended it.
    """
    name, joint = hobby.name, hobby.joint
    positive, negative = end_names(name)

    def ask(at: float, proposed: float) -> Place:
        asked = f"{name} at {at:g} {joint.model_facts.unit}: how many degrees ({positive} is +)?"
        return person.ask_number(asked, proposed, hobby.live), at

    hobby.begin()
    if is_lid(name):
        meets = "meets the upper lid" if "lower" in name else "shall meet the lower lid"
        marked, ends = [], (("to where it is fully OPEN", 1), (f"to where it is SHUT: {meets}", -1))
    else:
        end = "to its {} end, as far as it goes freely"
        marked = [(0.0, hobby.mark(zero_name(name)))]
        ends = ((end.format(positive), 1), (end.format(negative), -1))
    for where, sign in ends:
        at = hobby.mark(where)
        marked.append(ask(at, sign * abs(angle_now(joint, at))))
    marked.sort()
    between = []
    for one, other in zip(marked, marked[1:], strict=False):
        at = hobby.move_to(float(round((one[1] + other[1]) / 2.0)))
        between.append(ask(at, round((one[0] + other[0]) / 2.0, 1)))
    points = sorted((round(angle, 1) + 0.0, at) for angle, at in (*marked, *between))
    kept_deg = 0.0 if is_lid(name) else margin_deg
    made = LinkageFit(tuple(points), *range_within(name, points[0][0], points[-1][0], kept_deg))
    with_calibration(name, joint, made)
    # A lid stays shut, so that the other lid can be moved to meet it; friction must hold both.
    hobby.move_to(marked[0][1] if is_lid(name) else dict(marked)[0.0])
    hobby.live()  # the shaft is a moment behind its pulse
    return made
