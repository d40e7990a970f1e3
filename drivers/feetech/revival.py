"""Bringing STS servos back that have restarted, or whose bus had been gone.

Nothing of what they were told before is trusted: settings are compared anew, the goal
becomes the present position, and only then comes the torque.
"""

from collections.abc import Collection, Mapping, Sequence

from drivers.errors import ServoFault, ServoMissing
from drivers.event_log import EventLog
from drivers.feetech.line import FeetechLine
from drivers.feetech.memory_table import MODELS, STEPS_PER_TURN, acceleration_units, speed_units
from drivers.feetech.setup import Fitting
from drivers.feetech.torque import insist, positions, switch_off, switch_on
from drivers.feetech.turn import lost
from drivers.servo_bus.faults import Health
from drivers.slow_entry import entry_speed_steps_s
from drivers.types import ServoSetup

FAR_SIDE = "stands beyond its encoder's zero: turn it into its range by hand"


class Revival:
    """Sets servos up again while others run.

    Args:
        line, fitting: the bus, and what its servos must be like.
        setups: the servos by id.
        health, log: told what was found and done.
    """

    def __init__(
        self,
        line: FeetechLine,
        fitting: Fitting,
        setups: Mapping[int, ServoSetup],
        health: Health,
        log: EventLog,
    ) -> None:
        self._line = line
        self._fitting = fitting
        self._setups = setups
        self._health = health
        self._log = log
        self._said = ""

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

    def differs(self, servo_id: int) -> bool:
        """Tell whether a servo's settings are not as they should be; one that is silent may be.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        try:
            return bool(self._fitting.differences((servo_id,)))
        except ServoMissing:
            return False

    def _revive(self, ids: Sequence[int], engaged: bool, now_s: float) -> dict[int, int] | None:
        line = self._line
        line.write_all(ids, "status_return_level", [1] * len(ids))
        torque = line.ask(ids, "torque_enable")
        if not torque:
            return None
        same = self._same_models(tuple(torque))
        try:
            self._fitting.fit(same)
            well = tuple(
                i for i in same if torque[i] or not engaged or not self._health.exhausted(i, now_s)
            )
            if engaged:
                well = self._on_this_side(well)
                self.take_on(well)
            found = dict(zip(well, positions(line, well), strict=True))
        except ServoMissing:
            return None
        except ServoFault as fault:
            switch_off(line, same)
            if self._said != str(fault):
                self._said = str(fault)
                self._log.add(self._said)
            return None
        for servo_id in well:
            if engaged and not torque[servo_id]:
                self._health.restarted(servo_id, now_s)
        return found

    def _same_models(self, ids: tuple[int, ...]) -> tuple[int, ...]:
        """Leave out servos of another model than before."""
        numbers = self._line.ask(ids, "model_number")
        others = [i for i, n in numbers.items() if n != MODELS[self._setups[i].model].number]
        if others:
            # Damaged bytes may pass for another model: who has been exchanged says so twice.
            again = self._line.ask(others, "model_number")
            numbers = {i: n for i, n in numbers.items() if i not in others or again.get(i) == n}
        same = []
        for servo_id, number in numbers.items():
            model = self._setups[servo_id].model
            if number != MODELS[model].number:
                self._health.name(servo_id, f"is not {model} any more: exchanged?")
            else:
                same.append(servo_id)
        return tuple(same)

    def _on_this_side(self, ids: tuple[int, ...]) -> tuple[int, ...]:
        """Leave those limp that would go the wrong way round into their range.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer.
        """
        present = dict(zip(ids, positions(self._line, ids), strict=True))
        astray = [i for i in ids if self.is_lost(i, present[i])]
        if astray:
            # Damaged bytes may pass for such a place.
            again = dict(zip(astray, positions(self._line, astray), strict=True))
            astray = [i for i in astray if self.is_lost(i, again[i])]
        for servo_id in astray:
            self._health.name(servo_id, FAR_SIDE)
        if astray:
            switch_off(self._line, astray)
        return tuple(i for i in ids if i not in astray)

    def is_lost(self, servo_id: int, steps: int) -> bool:
        """Tell whether a servo that counts ``steps`` would go the wrong way into its range."""
        setup = self._setups[servo_id]
        return lost(steps, setup.min_steps, setup.max_steps)

    def take_on(self, ids: Sequence[int]) -> tuple[tuple[int, ...], set[int]]:
        """Set goals to the present positions, clipped to the limits, then torque on.

        Those outside their limits come inside slowly. Gives the goals, and who is outside.

        Raises:
            drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
            drivers.errors.ServoFault: a servo refuses its torque, or has lost its zero.
        """
        line = self._line
        if not ids:
            return (), set()
        present = positions(line, ids)
        self._refuse_lost(ids, present)
        goals = [self.clip(i, p) for i, p in zip(ids, present, strict=True)]
        outside = {i for i, p, g in zip(ids, present, goals, strict=True) if p != g}
        accels = [acceleration_units(self._setups[i].max_accel_steps_s2) for i in ids]
        insist(line, ids, "acceleration", accels)
        switch_on(line, ids, goals, self.speeds(ids, outside))
        return tuple(goals), outside

    def _refuse_lost(self, ids: Sequence[int], present: Sequence[int]) -> None:
        """See that no servo would go the wrong way round into its range.

        Raises:
            drivers.errors.ServoFault: one would.
        """
        for servo_id, steps in zip(ids, present, strict=True):
            if self.is_lost(servo_id, steps):
                low, high = self._setups[servo_id].min_steps, self._setups[servo_id].max_steps
                raise ServoFault(
                    f"{self._line.who(servo_id)} stands at {steps}, beyond its encoder's zero, and "
                    f"would go the long way round into {low}..{high}: turn it in there by hand"
                )

    def speeds(self, ids: Sequence[int], outside: Collection[int]) -> list[int]:
        """Give Goal Speeds, slow for those outside their limits."""
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
