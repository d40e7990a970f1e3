"""A servo bus whose servos a guardian lets go of, should the loop that drives it die or hang."""

from collections.abc import Sequence

from gazerig.drivers.errors import DriverError
from gazerig.drivers.types import BusHealth, ServoBus, ServoReading, ServoSetup
from gazerig.robot.guardian.guardian import Guardian

RETRY_S = 1.0
"""Time between attempts to take hold of servos that refused."""


class GuardedBus:
    """Puts signs of life and the guardian's doings into a bus; implements ``ServoBus``.

    Every read and write is a sign of life. A loop that hung and wakes again finds the torque
    off: it switches it off once more, confirmed, then takes hold where the joints are, as
    after a restart of the servos, and their readings are marked ``rearmed``.

    Args:
        bus: of servos without a watchdog.
        count: how many servos.
        guardian: the process that watches the loop.
        plan: the number of its plan for this bus's port.
    """

    def __init__(self, bus: ServoBus, count: int, guardian: Guardian, plan: int) -> None:
        self._bus, self._guardian, self._plan = bus, guardian, plan
        self._beat = guardian.beat
        self._silent: tuple[ServoReading | None, ...] = (None,) * count
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

    def read(self, now_s: float) -> tuple[ServoReading | None, ...]:
        """Read all servos; None of all while the guardian is letting go of them.

        Raises:
            BusLost: no servo has answered for longer than the bus waits.
        """
        self._beat()
        self._guardian.check(now_s)
        if self._lost_hold or self._guardian.released(self._plan):
            if self._guardian.releasing(self._plan):
                return self._silent
            self._take_hold_again(now_s)
        readings = self._bus.read(now_s)
        return self._marked(readings) if self._rearmed else readings

    def engage(self) -> tuple[int, ...]:
        """Switch torque on where the joints are, under the guardian's eyes.

        Raises:
            SetupError: the guardian did not start, or as the bus raises it.
            DriverError: as the bus raises it.
        """
        # Before the torque, which comes on servo by servo.
        self._guardian.arm(self._plan)
        goals = self._bus.engage()
        self._holding, self._lost_hold = True, False
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo; nothing to servos that the guardian has let go of.

        Raises:
            ValueError: a goal is not a number, or there are not as many as servos.
        """
        self._beat()
        if self._lost_hold or self._guardian.released(self._plan):
            return
        self._bus.write(goals_steps)

    def release(self) -> None:
        """Torque off on every servo; after that the guardian has nothing to let go of.

        Raises:
            BusLost: the port is gone; the guardian keeps trying.
        """
        self._holding = self._lost_hold = False
        self._rearmed.clear()
        self._bus.release()
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

    def retune(self, setups: Sequence[ServoSetup]) -> None:
        """Set the servos up so when the torque comes on the next time."""
        self._bus.retune(setups)

    def health(self) -> BusHealth:
        """Return byte and error counts."""
        return self._bus.health()

    def _take_hold_again(self, now_s: float) -> None:
        """Bring servos that the guardian has let go of back as after a restart."""
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
            self._bus.release()
            self._bus.engage()
        except DriverError as error:
            self._events.append(f"torque stays off: {error}")
            return
        self._lost_hold = False
        self._rearmed = set(range(len(self._silent)))
        self._events.append("torque on again where the joints are: going on slowly")

    def _marked(self, readings: tuple[ServoReading | None, ...]) -> tuple[ServoReading | None, ...]:
        """Return readings of which the first after torque-on says so."""
        marked = list(readings)
        for i in [i for i in self._rearmed if readings[i] is not None]:
            self._rearmed.discard(i)
            reading = readings[i]
            marked[i] = reading._replace(rearmed=True) if reading is not None else None
        return tuple(marked)
