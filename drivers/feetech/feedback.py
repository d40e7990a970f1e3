"""From register units to what the rest of the machine is given, with what was last known.

The checksum of the bus is a sum of one byte: bytes spoilt in two places pass it now and
then. So a position that no joint can have come to since the last one is not given
(``gazerig.drivers.plausibility``), and on a disturbed line every answer needs a second one that
says the same.
"""

from collections.abc import Mapping, Sequence

from gazerig.drivers.feetech.memory_table import LOAD_UNIT, MODELS, STEPS_PER_TURN
from gazerig.drivers.feetech.views import Sample
from gazerig.drivers.servo_bus.feedback import FeedbackColumns, with_value
from gazerig.drivers.servo_bus.sync_read import Heard, Whole
from gazerig.drivers.servo_bus.turn import nearest_turn
from gazerig.drivers.types import ServoSetup

ALIKE_C, ALIKE_TENTH_V = 3, 10
"""So far apart temperatures and voltages of two answers right after one another may be."""

MOST_CELSIUS = 125
"""A temperature above is none."""

_LOADS = tuple(
    max(-1.0, min(1.0, (-(x & 0x3FF) if x & 0x400 else x) * LOAD_UNIT)) for x in range(0x800)
)
"""Load by its eleven bits: sign and magnitude."""


class FeetechFeedback(FeedbackColumns):
    """Feedback from answers of STS servos."""

    def __init__(self, setups: Sequence[ServoSetup]) -> None:
        self.set_limits(setups)
        self._ids = tuple(setup.id for setup in setups)
        super().__init__([MODELS[s.model].no_load_rpm / 60.0 * STEPS_PER_TURN for s in setups])

    def set_limits(self, setups: Sequence[ServoSetup]) -> None:
        """Take other ranges for the same servos."""
        self._ranges = [(setup.min_steps, setup.max_steps) for setup in setups]

    def take_whole(self, answer: Whole[Sample]) -> bool:
        """Take an answer in which nothing is amiss; False where anything must be looked at.

        One that tells torque and armed limits is always looked at.
        """
        if answer.group.view.armed:
            return False
        values, at, at_s = answer.values, answer.group.columns, answer.at_s
        positions, warm = values[at.position], values[at.temperature]
        if any(values[at.error]) or any(values[at.status]) or max(warm) > MOST_CELSIUS:
            return False
        if max(positions) & 0x8000:
            return False
        places = tuple(
            [
                p if low <= p <= high else nearest_turn(p, low, high, STEPS_PER_TURN)
                for p, (low, high) in zip(positions, self._ranges, strict=True)
            ]
        )
        if not self.places.whole(places, at_s):
            return False
        self._temperature = warm
        self._voltage = tuple([0.1 * tenths for tenths in values[at.voltage]])
        # Sign and magnitude, written out: this runs every tick.
        self._take_all(
            places,
            tuple([float(v if v < 0x8000 else 0x8000 - v) for v in values[at.velocity]]),
            tuple([_LOADS[x & 0x7FF] for x in values[at.load]]),
            at_s,
        )
        return True

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

    def take(self, slot: int, heard: Heard[Sample]) -> None:
        """Take one servo's answer."""
        sample = heard.sample
        if sample.torque is not None:
            self.set_torque(slot, sample.torque == 1)
        if sample.temperature <= MOST_CELSIUS:
            self._temperature = with_value(self._temperature, slot, sample.temperature)
        self._voltage = with_value(self._voltage, slot, 0.1 * sample.voltage)
        position = nearest_turn(sample.position, *self._ranges[slot], STEPS_PER_TURN)
        load = max(-1.0, min(1.0, sample.load * LOAD_UNIT))
        self._take_one(slot, position, float(sample.velocity), load, heard.at_s)

    def hold(self, slot: int, position: int, at_s: float, torque: bool) -> None:
        """Take the place of a servo that was just set up again and stands still."""
        near = nearest_turn(position, *self._ranges[slot], STEPS_PER_TURN)
        super().hold(slot, near, at_s, torque)
