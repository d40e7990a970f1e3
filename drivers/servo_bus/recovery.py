"""Recovery of servos that have restarted, or whose bus was lost.

Nothing written to them before is relied on: settings are compared again, the goal becomes the
present position, and only then is torque switched on.
"""

from collections.abc import Collection, Mapping, Sequence

from gazerig.drivers.bus.goal_limits import entry_speed_steps_s, far_outside_steps
from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.servo_bus.faults import ServoHealth
from gazerig.drivers.servo_bus.feedback import nearest_turn
from gazerig.drivers.servo_bus.provisioning import Provisioning
from gazerig.drivers.servo_bus.torque import (
    find_faults,
    read_positions,
    switch_off,
    switch_on,
    write_verified,
)
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig

FAR_SIDE = "is beyond its encoder's zero: turn it into its range by hand"


class Recovery:
    """Recovery of servos while others run.

    Args:
        line: Exchanges on the bus.
        provisioning: Settings of its servos.
        setups: The servos by id.
        watchdog: Value of Bus Watchdog, in its units; 0 for none.
        health: Records the faults found.
        log: Records events.

    astray: servos without torque because of where they are
    """

    def __init__(
        self,
        line: Transactions,
        provisioning: Provisioning,
        setups: Mapping[int, ServoConfig],
        watchdog: int,
        health: ServoHealth,
        log: EventLog,
    ) -> None:
        self._line, self._family = line, line.family
        self._provisioning = provisioning
        self._setups = setups
        self._watchdog = watchdog
        self._health = health
        self._log = log
        self._last_reported = ""
        self.astray: set[int] = set()

    def recover(self, ids: Sequence[int], engaged: bool, now_s: float) -> dict[int, int] | None:
        """Set servos up as at the start, holding their positions if ``engaged``.

        Returns:
            The position of each recovered servo by id; None if a step failed and should be tried
            again.

        Raises:
            BusLost: the port is lost.
        """
        # Other servos are waiting: failures are tried again later, not immediately.
        before, self._line.tries = self._line.tries, 1
        try:
            line, health = self._line, self._health
            line.write_all(ids, "status_return_level", [self._family.answer_level] * len(ids))
            torque = line.ask(ids, "torque_enable")
            if not torque:
                return None
            whole = self._recoverable(self._same_models(tuple(torque)), torque if engaged else {})
            try:
                self._provisioning.apply(whole)
                well = tuple(
                    i
                    for i in whole
                    if torque[i] or not engaged or not health.has_exhausted_restarts(i, now_s)
                )
                if engaged:
                    well = self._release_astray(well)
                    self.enable(well)
                found = dict(zip(well, read_positions(line, well), strict=True))
            except ServoMissing:
                return None
            except ServoFault as fault:
                switch_off(line, whole)
                if self._last_reported != str(fault):
                    self._last_reported = str(fault)
                    self._log.add(self._last_reported)
                return None
            for servo_id in well:
                if self._family.faults_latch:
                    health.record_cleared(servo_id)
                if engaged and not torque[servo_id]:
                    line.errors["restarted"] += 1
                    health.record_restarted(servo_id, now_s)
            return found
        finally:
            self._line.tries = before

    def has_differences(self, servo_id: int) -> bool:
        """Return whether a servo's settings are wrong; False for a silent servo.

        Raises:
            BusLost: the port is lost.
        """
        try:
            return bool(self._provisioning.differences((servo_id,)))
        except ServoMissing:
            return False

    def _same_models(self, ids: tuple[int, ...]) -> tuple[int, ...]:
        """Return the servos whose model has not changed."""
        expected = {i: self._family.models[self._setups[i].model].number for i in ids}
        numbers = self._line.ask(ids, "model_number")
        others = [i for i, n in numbers.items() if n != expected[i]]
        if others:
            # Damaged bytes may look like another model: an exchanged servo reports it twice.
            again = self._line.ask(others, "model_number")
            numbers = {i: n for i, n in numbers.items() if i not in others or again.get(i) == n}
        for servo_id in numbers:
            if numbers[servo_id] != expected[servo_id]:
                model = self._setups[servo_id].model
                self._health.record_fault(servo_id, f"is no longer {model}: exchanged?")
        return tuple(i for i in ids if numbers.get(i) == expected[i])

    def _recoverable(self, ids: tuple[int, ...], torque: Mapping[int, int]) -> tuple[int, ...]:
        """Return the servos whose errors do not prevent torque: the others would delay them.

        torque: torque, on or off, of each servo that must have it
        """
        family = self._family
        found = find_faults(self._line, ids)
        if family.faults_latch:
            for servo_id, bits in found.items():
                self._health.record_latched(servo_id, family.name_errors(bits))
            return tuple(i for i in ids if i not in found)
        denied = {i for i, bits in found.items() if bits & family.torque_faults}
        return tuple(i for i in ids if i not in denied or torque.get(i, 1))

    def _release_astray(self, ids: tuple[int, ...]) -> tuple[int, ...]:
        """Switch servos off that are where no torque must move them from; return the others."""
        astray = self._find_astray(ids)
        # Damaged bytes may look like such a position.
        astray = self._find_astray(tuple(astray)) if astray else {}
        for servo_id, text in astray.items():
            self._health.record_fault(servo_id, text)
        self.astray.update(astray)
        if astray:
            switch_off(self._line, tuple(astray))
        return tuple(i for i in ids if i not in astray)

    def _find_astray(self, ids: Sequence[int]) -> dict[int, str]:
        """Return the servos far outside their limits, or that would move in the wrong direction."""
        positions = zip(ids, read_positions(self._line, ids), strict=True)
        found = {servo_id: self.astray_text(servo_id, steps) for servo_id, steps in positions}
        return {servo_id: text for servo_id, text in found.items() if text}

    def astray_text(self, servo_id: int, steps: int) -> str:
        """Return why a servo at ``steps`` must get no torque, "" if it may."""
        if self._family.single_turn and self.is_lost(servo_id, steps):
            return FAR_SIDE
        return far_outside_steps(self._setups[servo_id], steps)

    def is_lost(self, servo_id: int, steps: int) -> bool:
        """Return whether a servo at ``steps`` would move into its range in the wrong direction."""
        setup = self._setups[servo_id]
        turn = self._family.steps_per_turn
        return nearest_turn(steps, setup.min_steps, setup.max_steps, turn) != steps

    def enable(self, ids: Sequence[int]) -> tuple[tuple[int, ...], set[int]]:
        """Set goals to the present positions, clipped to the limits, then switch torque on.

        Servos outside their limits move inside slowly.

        Returns:
            The goals in steps, and the ids of the servos outside.

        Raises:
            ServoMissing: a servo does not answer or rejects its goal.
            ServoFault: a servo refuses its torque, or has lost its zero.
        """
        line, family = self._line, self._family
        if not ids:
            return (), set()
        if family.watchdog_unit_s is not None:
            write_verified(line, ids, "bus_watchdog", [0] * len(ids))
        present = read_positions(line, ids)
        if family.single_turn:
            for servo_id, steps in zip(ids, present, strict=True):
                if self.is_lost(servo_id, steps):
                    low, high = self._setups[servo_id].min_steps, self._setups[servo_id].max_steps
                    raise ServoFault(
                        f"{self._line.label(servo_id)} is at {steps}, beyond its encoder's zero, "
                        f"and would move into {low}..{high} in the wrong direction: turn it into that "
                        "range by hand"
                    )
        goals = [self.clip(i, p) for i, p in zip(ids, present, strict=True)]
        outside = {i for i, p, g in zip(ids, present, goals, strict=True) if p != g}
        speeds = self.speeds(ids, outside)
        accel = family.acceleration_units
        armed = (
            speeds
            if family.arming.limits_speed
            else [accel(self._setups[i].max_accel_steps_s2) for i in ids]
        )
        write_verified(line, ids, family.arming.register, armed)
        switch_on(line, ids, goals, speeds)
        if family.watchdog_unit_s is not None:
            write_verified(line, ids, "bus_watchdog", [self._watchdog] * len(ids))
        return tuple(goals), outside

    def speeds(self, ids: Sequence[int], outside: Collection[int]) -> list[int]:
        """Return speed limits in register units, slow for servos outside their limits."""
        turn, units = self._family.steps_per_turn, self._family.speed_units
        setups = [self._setups[i] for i in ids]
        return [
            units(entry_speed_steps_s(s, turn) if s.id in outside else s.max_speed_steps_s)
            for s in setups
        ]

    def clip(self, servo_id: int, steps: int) -> int:
        """Return a goal clipped to a servo's limits."""
        setup = self._setups[servo_id]
        return min(max(steps, setup.min_steps), setup.max_steps)
