"""From register units to what the rest of the machine is given, with what was last known.

The checksum of the bus is a sum of one byte: bytes spoilt in two places pass it now and
then. So a position that no joint can have come to since the last one is not given
(``gazerig.drivers.plausibility``), and on a disturbed line every answer needs a second one that
says the same.
"""

from collections.abc import Mapping, Sequence

from gazerig.drivers.feetech.memory_table import CURRENT_UNIT_MA, LOAD_UNIT, MODELS, STEPS_PER_TURN
from gazerig.drivers.feetech.views import Sample
from gazerig.drivers.plausibility import Plausibility
from gazerig.drivers.servo_bus.sync_read import Heard, Whole
from gazerig.drivers.servo_bus.turn import nearest_turn
from gazerig.drivers.types import ServoReading, ServoSetup

ALIKE_C, ALIKE_TENTH_V = 3, 10
"""So far apart temperatures and voltages of two answers right after one another may be."""

MOST_CELSIUS = 125
"""A temperature above is none."""


_new = tuple.__new__


class Readings:
    """Makes readings; keeps torque, fault, temperature and voltage from one to the next.

    places: which positions can be true
    """

    def __init__(self, setups: Sequence[ServoSetup]) -> None:
        count = len(setups)
        self.set_limits(setups)
        self._ids = tuple(setup.id for setup in setups)
        self.places = Plausibility(
            [MODELS[s.model].no_load_rpm / 60.0 * STEPS_PER_TURN for s in setups]
        )
        self._torque = [False] * count
        self._fault = [""] * count
        self._warm: list[float | None] = [None] * count
        self._volts: list[float | None] = [None] * count

    def set_limits(self, setups: Sequence[ServoSetup]) -> None:
        """Take other ranges for the same servos."""
        self._ranges = [(setup.min_steps, setup.max_steps) for setup in setups]

    def expect_torque(self, on: bool) -> None:
        """Note that the torque has been switched for all."""
        self._torque = [on] * len(self._torque)

    def name_fault(self, slot: int, fault: str) -> None:
        """Note what a servo suffers from, "" for nothing."""
        self._fault[slot] = fault

    def whole(self, answer: Whole[Sample]) -> list[ServoReading | None] | None:
        """Take an answer in which nothing is amiss; None where anything must be looked at.

        One that tells torque and armed limits is always looked at.
        """
        if answer.group.view.armed:
            return None
        values, at, at_s = answer.values, answer.group.columns, answer.at_s
        positions, warm = values[at.position], values[at.temperature]
        if any(values[at.error]) or any(values[at.status]) or max(warm) > MOST_CELSIUS:
            return None
        if max(positions) & 0x8000:
            return None
        places = [
            p if low <= p <= high else nearest_turn(p, low, high, STEPS_PER_TURN)
            for p, (low, high) in zip(positions, self._ranges, strict=True)
        ]
        if not self.places.whole(places, at_s):
            return None
        self._warm = [float(t) for t in warm]
        self._volts = [0.1 * tenths for tenths in values[at.voltage]]
        # One tuple a servo and no call: this runs every tick.
        return [
            _new(
                ServoReading,
                (
                    p,
                    float(v if v < 0x8000 else 0x8000 - v),
                    (c if c < 0x8000 else 0x8000 - c) * CURRENT_UNIT_MA,
                    at_s,
                    False,
                    on,
                    fault,
                    max(-1.0, min(1.0, (-(x & 0x3FF) if x & 0x400 else x & 0x3FF) * LOAD_UNIT)),
                    t,
                    u,
                    False,
                    True,
                ),
            )
            for p, v, c, x, on, fault, t, u in zip(
                places,
                values[at.velocity],
                values[at.current],
                values[at.load],
                self._torque,
                self._fault,
                self._warm,
                self._volts,
                strict=True,
            )
        ]

    def believes(self, slot: int, heard: Heard[Sample]) -> bool:
        """Return whether one servo's answer can be true; to be asked once for every answer."""
        position = nearest_turn(heard.sample.position, *self._ranges[slot], STEPS_PER_TURN)
        return self.places.one(slot, position, heard.at_s)

    def all_believed(self, heard: Mapping[int, Heard[Sample]]) -> bool:
        """Return whether everybody has answered in one exchange, and all of it can be true."""
        if len(heard) < len(self._ranges):
            return False
        answers = list(heard.values())
        at_s = answers[0].at_s
        if any(one.at_s != at_s for one in answers):
            return False
        positions = [
            nearest_turn(one.sample.position, *span, STEPS_PER_TURN)
            for one, span in zip([heard[i] for i in self._ids], self._ranges, strict=True)
        ]
        return self.places.whole(positions, at_s)

    def confirmed(
        self, slot: int, first: Heard[Sample], second: Heard[Sample]
    ) -> Heard[Sample] | None:
        """Return what two answers right after one another both say; None where they differ."""
        one, other = first.sample, second.sample
        alike = (
            abs(one.temperature - other.temperature) <= ALIKE_C
            and abs(one.voltage - other.voltage) <= ALIKE_TENTH_V
            and self.places.pair(slot, one.position, first.at_s, other.position, second.at_s)
        )
        if not alike:
            return None
        # The middle of both, and the smaller of what nothing else can tell damage of.
        return first._replace(
            sample=one._replace(
                error=one.error & other.error,
                position=(one.position + other.position) // 2,
                velocity=min(one.velocity, other.velocity, key=abs),
                load=min(one.load, other.load, key=abs),
                current=min(one.current, other.current, key=abs),
            )
        )

    def one(self, slot: int, heard: Heard[Sample]) -> ServoReading:
        """Take one servo's answer."""
        sample = heard.sample
        position = nearest_turn(sample.position, *self._ranges[slot], STEPS_PER_TURN)
        if sample.torque is not None:
            self._torque[slot] = sample.torque == 1
        if sample.temperature <= MOST_CELSIUS:
            self._warm[slot] = float(sample.temperature)
        self._volts[slot] = 0.1 * sample.voltage
        return self._make(
            slot,
            position,
            float(sample.velocity),
            sample.current * CURRENT_UNIT_MA,
            heard.at_s,
            bool(sample.error),
            max(-1.0, min(1.0, sample.load * LOAD_UNIT)),
        )

    def held(self, slot: int, position: int, at_s: float, torque: bool) -> ServoReading:
        """Make the first reading of a servo that was just set up again and stands still."""
        self._torque[slot] = torque
        position = nearest_turn(position, *self._ranges[slot], STEPS_PER_TURN)
        self.places.place(slot, position, at_s)
        return self._make(slot, position, 0.0, 0.0, at_s, False, 0.0)

    def _make(
        self,
        slot: int,
        position: int,
        velocity: float,
        current_ma: float,
        at_s: float,
        alert: bool,
        load: float,
    ) -> ServoReading:
        return ServoReading(
            position,
            velocity,
            current_ma,
            at_s,
            alert,
            self._torque[slot],
            self._fault[slot],
            load,
            self._warm[slot],
            self._volts[slot],
        )
