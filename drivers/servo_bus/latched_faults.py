"""Supervision of servos with latched faults: an alert bit reports them, a restart clears them."""

from collections.abc import Collection, Sequence
from math import inf
from typing import Any

from gazerig.drivers.servo_bus.read_plan import Sample
from gazerig.drivers.servo_bus.supervisor import AGAIN_S, Supervisor
from gazerig.drivers.servo_bus.torque import TRIPPED

CHECK_S = 1.0
"""Interval of the checks whether a servo is still armed; the servos take turns."""

SLOW_S = 0.05
"""Interval of the reads of values that a group read does not cover; the servos take turns."""


class LatchedFaultSupervisor(Supervisor):
    """Supervisor of servos with latched faults."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._unnamed: set[int] = set()
        self._name_at_s = self._slow_at_s = -inf
        self._slow = 0

    def mark_all_for_recovery(self) -> None:
        """Mark every servo for recovery."""
        super().mark_all_for_recovery()
        self.due_s = -inf

    def start_supervision(self, entering: Collection[int]) -> None:
        """Start supervision under torque; ``entering``: servos outside their limits."""
        super().start_supervision(entering)
        self.due_s = -inf  # from now on the servos take turns

    def check_prepared(self) -> None:
        """Check servos that have just been prepared."""
        self._find_alerts(self._ids)

    def check_after_silence(self, servo_id: int) -> None:
        """Check whether a servo that was out of the group is still armed."""
        if self.engaged:
            self._check(servo_id)

    def check_status(self, servo_id: int, sample: Sample, now_s: float) -> None:
        """Check one servo's answer for faults and for lost torque or limits."""
        if self.engaged and servo_id in self._recovery.astray:
            self._check_turned_back(servo_id, sample)
        if sample.status:
            # Damaged bytes may look like a fault, which ends a run: read the servo once more.
            if servo_id in self._health.latches:
                self._record_latched(servo_id, sample.status)
            else:
                self._record_alert(servo_id)
        elif sample.error & self._family.codec.ALERT:
            self._record_alert(servo_id)
        elif (
            servo_id in self._health.latches
            or sample.is_blank
            or self._lacks_torque(servo_id, sample.torque)
        ):
            self._suspect(servo_id)

    def _record_alert(self, servo_id: int) -> None:
        """Record that a servo has raised the alert bit."""
        if servo_id not in self._health.faults:
            self._unnamed.add(servo_id)
            self.due_s = -inf

    def _lacks_torque(self, servo_id: int, torque: int | None) -> bool:
        """Return whether a servo's torque is off without a known reason."""
        known = servo_id in self._health.faults or servo_id in self.limp
        return self.engaged and torque == 0 and not known

    def _suspect(self, servo_id: int) -> None:
        self._suspects.add(servo_id)
        self.due_s = -inf

    def _record_latched(self, servo_id: int, status: int) -> None:
        if self._health.record_latched(servo_id, self._family.name_errors(status)):
            self._line.errors["alert"] += 1
            self._name_fault(servo_id)

    # --- after every read

    def service(self, group: Collection[int], now_s: float) -> None:
        """Do the tasks due after a read; servos that work again are recovered here.

        Raises:
            BusLost: the port is lost.
        """
        covered = self._plan.covers_torque
        if self._suspects and now_s >= self._recover_at_s:
            self._recover(group, now_s)
        if self._unnamed and now_s >= self._name_at_s:
            self._name_at_s = now_s + AGAIN_S
            self._find_alerts(tuple(self._unnamed))
        if self.engaged and now_s >= self._check_at_s:
            # This also handles a host that slept.
            due = self._next_to_check(group, now_s + CHECK_S)
            if due is not None:
                self._check(due)
        if not covered and now_s >= self._slow_at_s:
            # Torque, or voltage and temperature, of one servo; the next call reads the next.
            self._slow_at_s = now_s + SLOW_S
            self._slow = (self._slow + 1) % (2 * len(self._ids))
            slot, climate = divmod(self._slow, 2)
            servo_id = self._ids[slot]
            if servo_id in group:
                if climate:
                    registers = self._family.registers
                    volts = registers["present_input_voltage"]
                    warm = registers["present_temperature"]
                    span = warm.address + warm.size - volts.address
                    for data in self._line.ask_bytes((servo_id,), volts.address, span).values():
                        tenths = volts.decode(data[: volts.size])
                        self._feedback.set_climate(slot, tenths, warm.decode(data[-warm.size :]))
                else:
                    for torque in self._line.ask((servo_id,), "torque_enable").values():
                        self._feedback.set_torque(slot, bool(torque))
                        if self._lacks_torque(servo_id, torque):
                            self._suspect(servo_id)
        self.due_s = min(
            -inf if self.entering.places or self._rearmed else inf,
            self._recover_at_s if self._suspects else inf,
            self._name_at_s if self._unnamed else inf,
            self._check_at_s if self.engaged else inf,
            inf if covered else self._slow_at_s,
        )
        if self.entering.places or self._rearmed:
            self._mark_feedback(now_s)

    def _find_alerts(self, ids: Sequence[int]) -> None:
        """Read the latched errors of servos."""
        found = self._line.ask(ids, self._family.error_register)
        self._unnamed.difference_update(found)
        latched = {servo_id: status for servo_id, status in found.items() if status}
        for servo_id, status in latched.items():
            self._record_latched(servo_id, status)
        if latched and not self._plan.covers_torque:
            for servo_id, torque in self._line.ask(tuple(latched), "torque_enable").items():
                self._feedback.set_torque(self._slot[servo_id], bool(torque))

    # --- checks in rotation

    def _check(self, servo_id: int) -> None:
        """Check that a servo is still armed; a restart resets its RAM."""
        if servo_id in self.limp:
            return
        name, armed = ("bus_watchdog", self._watchdog) if self._watchdog else ("torque_enable", 1)
        state = self._line.ask((servo_id,), name).get(servo_id, armed)
        if state == TRIPPED:
            # If one servo has starved, the others have too.
            self._line.starved = True
        elif state != armed and servo_id not in self._health.faults:
            self._suspect(servo_id)
