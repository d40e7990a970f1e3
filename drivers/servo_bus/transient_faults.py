"""Supervision of servos with transient faults: every answer contains them, none latches."""

from collections.abc import Collection
from typing import Any

from gazerig.drivers.bus.plausibility import DISTURBED_S
from gazerig.drivers.servo_bus.read_plan import Sample
from gazerig.drivers.servo_bus.supervisor import Supervisor

CHECK_S = 0.1
"""Interval of the comparisons of settings on a disturbed line; the servos take turns."""

GONE_S = 1.0
"""A fault has ended when its bit was absent for this time: bits flicker at the threshold."""

RESTART_S = 0.1
"""Silence after which a servo may have restarted: it gets no goals until it is set up."""


class TransientFaultSupervisor(Supervisor):
    """Supervisor of servos with transient faults."""

    withholds_goals = True

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._torque_off: set[int] = set()
        self._out_since_s: dict[int, float] = {}
        self._seen_s: dict[int, dict[int, float]] = {}
        self._last_errors: dict[int, int] = {}
        self._doubted: set[int] = set()

    @property
    def is_idle(self) -> bool:
        """Return whether no servo has a condition that an answer could change."""
        doubts = self._torque_off or self._doubted or self._seen_s or self._health.faults
        return not (doubts or any(self._last_errors.values()))

    def start_supervision(self, entering: Collection[int]) -> None:
        """Start supervision under torque; ``entering``: servos outside their limits."""
        super().start_supervision(entering)
        self._torque_off.clear()
        self._doubted.clear()
        # Earlier faults have ended: all servos have just accepted goals and torque.
        for servo_id in [i for i in self._health.faults if i not in self._health.latches]:
            del self._health.faults[servo_id]
            self._name_fault(servo_id)

    def stop_supervision(self) -> None:
        """Stop supervision, as the servos have no torque."""
        super().stop_supervision()
        self._torque_off.clear()
        self._doubted.clear()

    def check_prepared(self) -> None:
        """Do nothing: every answer of servos that have just been prepared contains their faults."""

    def withheld_ids(self, now_s: float) -> frozenset[int]:
        """Return the servos that must get no goals now.

        Some firmware switches torque on with a goal, so a servo that may have restarted, or has no
        torque, first gets its present position as goal.
        """
        out = self._out_since_s
        if not out and not self._suspects and not self._torque_off:
            return self.limp
        away = {i for i, since_s in out.items() if now_s - since_s >= RESTART_S}
        return self.limp | away | self._suspects | self._torque_off

    # --- one servo's answer

    def _clear_state(self, servo_id: int) -> None:
        self._torque_off.discard(servo_id)

    def check_status(self, servo_id: int, sample: Sample, now_s: float) -> None:
        """Check one servo's answer for faults and for lost torque or limits."""
        error = sample.error | (sample.status or 0)
        # Damaged bytes may look like a fault, which ends a run: two consecutive reports are needed.
        confirmed = error & self._last_errors.get(servo_id, 0)
        self._last_errors[servo_id] = error
        if confirmed or servo_id in self._seen_s:
            seen_s = self._seen_s.setdefault(servo_id, {})
            before = self._recent_faults(servo_id)
            for bit in range(8):
                if confirmed >> bit & 1:
                    seen_s[1 << bit] = now_s
            for bit in [b for b, at_s in seen_s.items() if now_s - at_s >= GONE_S]:
                del seen_s[bit]
            now = self._recent_faults(servo_id)
            health = self._health
            worse = servo_id in health.faults and servo_id not in health.latches
            if now != before and not worse:
                if now:
                    health.record_fault(servo_id, " and ".join(self._family.name_errors(now)))
                    health.latches.add(servo_id)
                    self._line.errors["alert"] += 1
                else:
                    health.record_cleared(servo_id)
                self._name_fault(servo_id)
            if not seen_s:
                del self._seen_s[servo_id]
        if not self.engaged:
            return
        if servo_id in self._recovery.astray:
            self._check_turned_back(servo_id, sample)
        if sample.torque is not None and servo_id not in self.limp:
            # A servo that seems no longer armed is read once more.
            if sample.torque == 1 and self._is_armed(servo_id, sample):
                self._torque_off.discard(servo_id)
                self._doubted.discard(servo_id)
            elif servo_id not in self._torque_off or not self._has_known_reason(servo_id):
                self._doubted.add(servo_id)

    def record_out_of_group(self, out: Collection[int], now_s: float) -> None:
        """Record the servos out of the group; those that return later may have restarted."""
        for servo_id in [i for i in self._out_since_s if i not in out]:
            since_s = self._out_since_s.pop(servo_id)
            if self.engaged and now_s - since_s >= RESTART_S:
                self._suspects.add(servo_id)
        for servo_id in out:
            self._out_since_s.setdefault(servo_id, now_s)

    def _recent_faults(self, servo_id: int) -> int:
        return sum(self._seen_s.get(servo_id, ()))

    def _is_armed(self, servo_id: int, sample: Sample) -> bool:
        """Return whether speed and torque limits are as they were written."""
        wanted = self._family.armed_values(self._setups[servo_id]).items()
        return all(limit is None or getattr(sample, name) == limit for name, limit in wanted)

    def _has_known_reason(self, servo_id: int) -> bool:
        """Return whether the reason for a servo's lack of torque is known."""
        if servo_id not in self._health.faults:
            return False
        if servo_id not in self._health.latches:
            return True
        return bool(self._recent_faults(servo_id) & self._family.torque_faults)

    # --- after every read

    def service(self, group: Collection[int], now_s: float) -> None:
        """Do the tasks due after a read; servos that work again are recovered here.

        Raises:
            BusLost: the port is lost.
        """
        disturbed = now_s - self._feedback.places.damaged_s <= DISTURBED_S
        if disturbed and self.engaged and now_s >= self._check_at_s:
            # One servo's settings on a disturbed line; the next servo at the next call. An
            # instruction changed by noise may pass the one-byte checksum and overwrite any
            # register: limits, gains, mode. A servo that differs is set up again at low speed.
            servo_id = self._next_to_check(group, now_s + CHECK_S)
            if servo_id is not None:
                # Shortly after trouble on the line the answers do not contain torque.
                if servo_id not in self.limp:
                    self._doubted.add(servo_id)
                if self._recovery.has_differences(servo_id):
                    self._line.errors["setting changed"] += 1
                    self._suspects.add(servo_id)
        if self._doubted and group:
            window = self._plan.armed_window
            if window is not None:
                ids = tuple(i for i in self._ids if i in self._doubted and i in group)
                found = self._line.ask_bytes(ids, window.address, window.length)
                for servo_id, data in found.items():
                    self._doubted.discard(servo_id)
                    sample = window.sample(0, data)
                    if sample.torque != 1:
                        self._torque_off.add(servo_id)
                        if not self._has_known_reason(servo_id):
                            self._suspects.add(servo_id)
                    elif not self._is_armed(servo_id, sample):
                        # A restart too short to be noticed, after which a goal switched torque on.
                        self._suspects.add(servo_id)
        if self._suspects and now_s >= self._recover_at_s:
            self._recover(group, now_s)
        if self.entering.places or self._rearmed:
            self._mark_feedback(now_s)
