"""Bringing servos back that have restarted, or whose bus had been gone.

Nothing of what they were told before is trusted: settings are compared anew, the goal
becomes the present position, and only then comes the torque.
"""

from collections.abc import Collection, Mapping, Sequence

from drivers.dynamixel.control_table import MODELS, STEPS_PER_TURN
from drivers.errors import ServoFault, ServoMissing
from drivers.event_log import EventLog
from drivers.servo_bus.faults import Health
from drivers.servo_bus.line import Line
from drivers.servo_bus.provisioning import Fitting, speed_units
from drivers.servo_bus.torque import find_latched, insist, positions, switch_off, switch_on
from drivers.slow_entry import entry_speed_steps_s
from drivers.types import ServoSetup


class Revival:
    """Sets servos up again while others run.

    Args:
        line, fitting: the bus, and what its servos must be like.
        setups: the servos by id.
        watchdog: Bus Watchdog to arm, in its units; 0 for none.
        health, log: told what was found and done.
    """

    def __init__(
        self,
        line: Line,
        fitting: Fitting,
        setups: Mapping[int, ServoSetup],
        watchdog: int,
        health: Health,
        log: EventLog,
    ) -> None:
        self._line = line
        self._fitting = fitting
        self._setups = setups
        self._watchdog = watchdog
        self._health = health
        self._log = log

    def revive(self, ids: Sequence[int], engaged: bool, now_s: float) -> dict[int, int] | None:
        """Set servos up as at the start, holding where they are if ``engaged``.

        Gives the position of each that is well again; none where something failed and
        should be tried again.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        # Others are waiting: what fails is tried again later, not at once.
        before, self._line.tries = self._line.tries, 1
        try:
            return self._revive(ids, engaged, now_s)
        finally:
            self._line.tries = before

    def _revive(self, ids: Sequence[int], engaged: bool, now_s: float) -> dict[int, int] | None:
        line = self._line
        line.write_all(ids, "status_return_level", [2] * len(ids))
        torque = line.ask(ids, "torque_enable")
        if not torque:
            return None
        whole = self._whole(tuple(torque))
        try:
            self._fitting.fit(whole)
            well = tuple(
                i for i in whole if torque[i] or not engaged or not self._health.exhausted(i, now_s)
            )
            if engaged:
                self.take_on(well)
            found = dict(zip(well, positions(line, well), strict=True))
        except ServoMissing:
            return None
        except ServoFault as fault:
            switch_off(line, whole)
            self._log.add(str(fault))
            return None
        for servo_id in well:
            self._health.cleared(servo_id)
            if engaged and not torque[servo_id]:
                line.errors["restarted"] += 1
                self._health.restarted(servo_id, now_s)
        return found

    def _whole(self, ids: tuple[int, ...]) -> tuple[int, ...]:
        """Leave out servos with a latched error, or of another model than before."""
        latched = find_latched(self._line, ids)
        numbers = self._line.ask(ids, "model_number")
        whole = []
        for servo_id in ids:
            model = self._setups[servo_id].model
            if servo_id in latched:
                self._health.latched(servo_id, latched[servo_id])
            elif servo_id not in numbers:
                continue
            elif numbers[servo_id] != MODELS[model].number:
                self._health.name(servo_id, f"is not {model} any more: exchanged?")
            else:
                whole.append(servo_id)
        return tuple(whole)

    def take_on(self, ids: Sequence[int]) -> tuple[tuple[int, ...], set[int]]:
        """Set goals to the present positions, clipped to the limits, then torque on.

        Those outside their limits come inside slowly. Gives the goals, and who is outside.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
            drivers.errors.ServoFault: a servo has latched an error or lost its zero.
        """
        line = self._line
        if not ids:
            return (), set()
        insist(line, ids, "bus_watchdog", [0] * len(ids))
        present = positions(line, ids)
        goals = [self.clip(i, p) for i, p in zip(ids, present, strict=True)]
        outside = {i for i, p, g in zip(ids, present, goals, strict=True) if p != g}
        insist(line, ids, "profile_velocity", self.entry_speeds(ids, outside))
        switch_on(line, ids, goals)
        insist(line, ids, "bus_watchdog", [self._watchdog] * len(ids))
        return tuple(goals), outside

    def entry_speeds(self, ids: Sequence[int], outside: Collection[int]) -> list[int]:
        """Give Profile Velocities, slow for those outside their limits."""
        setups = [self._setups[i] for i in ids]
        return [
            speed_units(
                entry_speed_steps_s(s, STEPS_PER_TURN) if s.id in outside else s.max_speed_steps_s
            )
            for s in setups
        ]

    def clip(self, servo_id: int, steps: int) -> int:
        """Keep a goal inside a servo's limits."""
        setup = self._setups[servo_id]
        return min(max(steps, setup.min_steps), setup.max_steps)
