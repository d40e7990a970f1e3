"""Feetech STS servos on one serial bus: one read and one write a tick.

The packets are our own. The maker's Python SDK (feetech-servo-sdk 1.0.0, module
scservo_sdk) is the Dynamixel SDK of old with other names: it has been left alone since its
first release, its packet time-out is computed wrongly so that every user patches it, its
group reads lose every answer after a missing one and its waiting spins a core. The rest on
the package index are copies of it. The protocol is small, and the port is ours anyway.

What an STS cannot do. It has no bus watchdog: when the host falls silent, a servo goes on
to its last goal and holds it, for ever. Nothing in the servo stands in for that: whoever
runs the bus must let go before leaving (``release``) or have a guardian beside it that
does (gazerig.robot.guardian), and what bounds the force until somebody cuts the power is the
torque limit (``strength``) and the servo's own overload protection, which leaves a fifth
of the torque after two seconds. So goals are sent a tick at a time, never far ahead.
Faults do not latch: their bits come and go, and so do the names in ``faults``.
"""

from collections.abc import Mapping, Sequence

from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.feetech.feedback import FeetechFeedback
from gazerig.drivers.feetech.group import Group
from gazerig.drivers.feetech.params import FeetechParams as FeetechParams
from gazerig.drivers.feetech.protocol import HEADER, GoalWrite
from gazerig.drivers.feetech.supervisor import FeetechSupervisor
from gazerig.drivers.feetech.views import Sample, View, again_turns, alone_turns, together_turns
from gazerig.drivers.port_bus import CUT
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.bus import RESTART_S, SmartServoBus
from gazerig.drivers.servo_bus.sync_read import Heard, Reader, Whole
from gazerig.drivers.types import ServoSetup


class FeetechBus(SmartServoBus):
    """A chain of STS servos in position mode; implements gazerig.drivers.types.ServoBus.

    Args:
        port: gazerig.drivers.serial.port.BlockingPort, or an emulated port with its methods.
        setups: the servos, in the order of every sequence given and taken.
        params: how to speak with them.

    Raises:
        ValueError: more servos than one packet of goals can hold, or a range beyond one turn.
    """

    _supervisor: FeetechSupervisor
    _feedback: FeetechFeedback

    def __init__(self, port: BusPort, setups: Sequence[ServoSetup], params: FeetechParams) -> None:
        self._params = params
        self._damaged = 0
        super().__init__(port, setups, FEETECH, params)

    def _assemble_family(self, firmware: Mapping[int, int] | None) -> None:
        self._feedback = FeetechFeedback(self._setups)
        turns = together_turns(self._params.torque_every)
        self._reader: Reader[View, Sample] = Reader(
            self._line, self._roll, turns, alone_turns(), Group, HEADER, again_turns()
        )
        self._supervisor = FeetechSupervisor(
            self._line, self._by_id, self._recovery, self._health, self._feedback
        )

    def _first_look(self) -> None:
        """Every answer tells its faults: there is nothing to ask for."""

    def _read(self, now_s: float) -> None:
        answer = self._reader.read(now_s)
        if not isinstance(answer, Whole):
            self._take(answer, now_s)
        elif not self._take_whole(answer, now_s):
            self._take(answer.each(), now_s)
        elif self._health.returning:
            self._health.heard_again(now_s, self._line.lateness)
        self._supervisor.service(self._roll.group, now_s)

    def _take_whole(self, answer: Whole[Sample], now_s: float) -> bool:
        """Take an answer in which nothing is amiss; False where anything must be looked at."""
        doubtful = self._disturbed(now_s) or self._reader.any_owing(now_s)
        return self._supervisor.at_ease and not doubtful and self._feedback.take_whole(answer)

    def _take(self, heard: dict[int, Heard[Sample]], now_s: float) -> None:
        """Take an answer servo by servo."""
        self._feedback.begin()
        if heard and self._health.silent_for_s(now_s) >= RESTART_S:
            # All were silent together: their power may have been cut.
            self._supervisor.mark_all_for_recovery()
        disturbed = self._disturbed(now_s)
        doubtful = {i: h for i, h in heard.items() if disturbed or self._reader.owing(i, now_s)}
        if doubtful:
            sure = {i: h for i, h in heard.items() if i not in doubtful}
            heard = sure | self._confirmed(doubtful)
        believed, dark = self._feedback.all_believed(heard), not self._roll.group
        for servo_id, one in heard.items():
            slot = self._slot[servo_id]
            if self._roll.answered(servo_id) and dark:
                continue  # the first answer after long silence may be an old one
            if believed or self._feedback.believes(slot, one):
                self._supervisor.check_status(servo_id, one.sample, now_s)
                self._feedback.take(slot, one)
            else:
                self._line.errors["implausible"] += 1
        self._supervisor.note_out(self._roll.out, now_s)
        self._health.note_silent(
            self._roll.out, now_s, self._roll.garbling, self._line.lateness, bool(heard)
        )

    def _disturbed(self, now_s: float) -> bool:
        """Return whether answers have been damaged of late."""
        places = self._feedback.places
        if (damaged := self._line.errors["corrupt"]) != self._damaged:
            self._damaged = damaged
            places.damaged(now_s)
        return places.disturbed(now_s)

    def _confirmed(self, heard: dict[int, Heard[Sample]]) -> dict[int, Heard[Sample]]:
        """Ask everybody who answered once more, and keep what both answers say.

        Raises:
            BusLost: the port is gone.
        """
        again = self._reader.again(tuple(heard))
        kept: dict[int, Heard[Sample]] = {}
        for servo_id, first in heard.items():
            self._roll.answered(servo_id)
            second = again.get(servo_id)
            both = second and self._feedback.confirmed(self._slot[servo_id], first, second)
            if both:
                kept[servo_id] = both
            else:
                self._line.errors["unconfirmed"] += 1
        return kept

    def _send(self, goals: Sequence[int]) -> None:
        """Send goals with the speeds that may be used for them.

        Raises:
            BusLost: the port is gone.
        """
        entering, speeds = self._supervisor.entering, self._speeds
        if entering:
            speeds = self._recovery.speeds(self._ids, entering.ids)
        withheld = self._supervisor.withheld(self._now_s)
        if not withheld:
            self._line.send(self._goals.packet(goals, speeds))
            return
        kept = [k for k, servo_id in enumerate(self._ids) if servo_id not in withheld]
        if kept:
            some = GoalWrite([self._ids[k] for k in kept])
            self._line.send(some.packet([goals[k] for k in kept], [speeds[k] for k in kept]))

    def _cannot_release(self) -> str:
        """Say what servos do that cannot be told to let go."""
        return (
            f"{self._port.port_name} is gone: torque could not be switched off; servos that have "
            "power go on to their last goal and hold it, as this kind has no bus watchdog: "
            f"{CUT} to free them"
        )
