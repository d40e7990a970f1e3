"""A servo bus whose servos a guardian releases, should the loop that drives it die or hang."""

from collections.abc import Sequence

from gazerig.drivers.errors import DriverError
from gazerig.drivers.types import BusHealth, Feedback, ServoBus, ServoConfig
from gazerig.robot.guardian.guardian import Guardian

RETRY_S = 1.0
"""Time between attempts to take hold of servos that refused."""


class GuardedBus:
    """Puts signs of life and the guardian's doings into a bus; implements ``ServoBus``.

    Every read and write is a sign of life. A loop that hung and wakes again finds the torque
    off: it switches it off once more, confirmed, then takes hold where the joints are, as
    after a restart of the servos, and their answers are marked ``rearmed``.

    Args:
        bus: of the servos.
        count: how many servos.
        guardian: the process that watches the loop.
        plan: the number of its plan for this bus's port.
    """

    def __init__(self, bus: ServoBus, count: int, guardian: Guardian, plan: int) -> None:
        self._bus, self._guardian, self._plan = bus, guardian, plan
        self._beat = guardian.beat
        self._silent = Feedback.of_none(count)
        self._holding = self._lost_hold = False
        self._retry_s = 0.0
        self._rearmed: set[int] = set()
        self._events: list[str] = []

    def open(self) -> None:
        """Open the bus, with a guardian started beside it; torque stays off.

        Raises:
            SetupError: no guardian can be started, or as the bus raises it.
        """
        self._guardian.join(self._plan)
        try:
            self._bus.open()
        except BaseException:
            self._guardian.leave(self._plan)
            raise

    def read(self, now_s: float) -> Feedback:
        """Read all servos; all are missing while the guardian is letting go of them.

        Raises:
            BusLost: no servo has answered for longer than the bus waits.
        """
        self._beat()
        self._guardian.check(now_s)
        if self._lost_hold or self._guardian.released(self._plan):
            if self._guardian.releasing(self._plan):
                return self._silent
            self._take_hold_again(now_s)
        feedback = self._bus.read(now_s)
        return self._marked(feedback) if self._rearmed else feedback

    def enable_torque(self) -> tuple[int, ...]:
        """Switch torque on where the joints are, under the guardian's eyes.

        Raises:
            SetupError: the guardian did not start, or as the bus raises it.
            DriverError: as the bus raises it.
        """
        # Before the torque, which comes on servo by servo.
        self._guardian.arm(self._plan)
        goals = self._bus.enable_torque()
        self._holding, self._lost_hold = True, False
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo; nothing to servos that the guardian has released.

        Raises:
            ValueError: a goal is not a number, or there are not as many as servos.
        """
        self._beat()
        if self._lost_hold or self._guardian.released(self._plan):
            return
        self._bus.write(goals_steps)

    def disable_torque(self) -> None:
        """Torque off on every servo; after that the guardian has nothing to release.

        Raises:
            BusLost: the port is gone; the guardian keeps trying.
        """
        self._holding = self._lost_hold = False
        self._rearmed.clear()
        self._bus.disable_torque()
        self._guardian.disarm(self._plan)

    def close(self) -> None:
        """Close the port and say goodbye to the guardian; safe to call twice."""
        try:
            self._bus.close()
        finally:
            self._guardian.leave(self._plan)

    def faults(self) -> tuple[str, ...]:
        """Name every latched servo fault found so far."""
        return self._bus.faults()

    def events(self) -> tuple[str, ...]:
        """Return what has happened since the last call."""
        events = (*self._guardian.events(), *self._events, *self._bus.events())
        self._events.clear()
        return events

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        """Set the servos up so when the torque comes on the next time."""
        self._bus.retune(setups)

    def health(self) -> BusHealth:
        """Return byte and error counts."""
        return self._bus.health()

    def _take_hold_again(self, now_s: float) -> None:
        """Bring servos that the guardian has released back as after a restart."""
        if not self._lost_hold:
            self._guardian.acknowledge(self._plan)
            if not self._holding:
                return
            self._lost_hold, self._retry_s = True, now_s
            self._events.append("the control loop stood still: the guardian switched torque off")
        if now_s < self._retry_s:
            return
        self._retry_s = now_s + RETRY_S
        try:
            # A packet of goals that was on its way as the loop stopped may have come after.
            self._bus.disable_torque()
            self._bus.enable_torque()
        except DriverError as error:
            self._events.append(f"torque stays off: {error}")
            return
        self._lost_hold = False
        self._rearmed = set(self._silent.missing)
        self._events.append("torque on again where the joints are: going on slowly")

    def _marked(self, feedback: Feedback) -> Feedback:
        """Return feedback in which the first answer of a servo after torque-on says so."""
        here = self._rearmed.difference(feedback.missing)
        self._rearmed -= here
        rearmed = [reset or i in here for i, reset in enumerate(feedback.rearmed)]
        return feedback._replace(rearmed=tuple(rearmed))
