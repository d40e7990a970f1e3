"""One channel of a Maestro led slowly from place to place, for a person to see which servo moves.

A first pulse cannot be slowed down: a servo without pulses goes there at once, at its own
speed. From then on the board leads it slowly. The pulses end with the walk, whatever
happens.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing
from gazerig.drivers.hobby_board.release import switch_off
from gazerig.drivers.maestro.commands import MOST_INPUT, name_errors
from gazerig.drivers.maestro.limits import SPEED_STEPS_S, speed_units
from gazerig.drivers.maestro.line import Line
from gazerig.drivers.servo_models import servo_label
from gazerig.drivers.types import ServoSetup

SLOW_STEPS_S = 20.0 / 360.0 * 16_000.0
"""20 deg/s of the servo's shaft."""

SETTLE_S = 0.4
"""From the first pulse until a servo has arrived from anywhere."""

LOOK_S = 0.05
FINE_STEPS = 2
LATE_S = 1.0


class Place(NamedTuple):
    """A place that a channel was sent to, and where the board's pulse ended, in steps."""

    asked: int
    got: int


def walk(
    line: Line,
    setup: ServoSetup,
    places: Sequence[int],
    sleep_until: Callable[[float], None],
    speed_steps_s: float = SLOW_STEPS_S,
) -> tuple[Place, ...]:
    """Lead a channel to places, the first at once, the others slowly; the pulses are off then.

    places: quarter microseconds

    Raises:
        ServoMissing: the board does not answer, or the channel is no servo's.
        ServoFault: the pulses do not end.
        BusLost: the port is gone.
    """
    speech = line.speech
    if 0 < _pulse(line, setup) <= MOST_INPUT:
        raise ServoMissing(f"{servo_label(setup)} is an input: set it to Servo in Pololu's program")
    units = speed_units(speed_steps_s)
    line.send(speech.speed(setup.id, units) + speech.acceleration(setup.id, 0))
    gone: list[Place] = []
    try:
        for nth, asked in enumerate(places):
            start = _pulse(line, setup)
            line.send(speech.target(setup.id, asked))
            way_s = abs(asked - start) / (units * SPEED_STEPS_S) if start else SETTLE_S
            gone.append(Place(asked, _arrived(line, setup, asked, way_s, sleep_until)))
            if not nth:
                _settle(line, setup, sleep_until)
    finally:
        _end(line, setup)
    return tuple(gone)


def _arrived(
    line: Line,
    setup: ServoSetup,
    asked: int,
    way_s: float,
    sleep_until: Callable[[float], None],
) -> int:
    """Wait until the board's pulse is where it was sent, or its time is over; gives where it is."""
    until_s = line.port.now_s() + way_s + LATE_S
    while True:
        sleep_until(line.port.now_s() + LOOK_S)
        got = _pulse(line, setup)
        if abs(got - asked) <= FINE_STEPS or line.port.now_s() >= until_s:
            return got


def _settle(line: Line, setup: ServoSetup, sleep_until: Callable[[float], None]) -> None:
    """Wait until a servo has arrived; the board is asked meanwhile, it may have a timeout."""
    until_s = line.port.now_s() + SETTLE_S
    while line.port.now_s() < until_s:
        sleep_until(line.port.now_s() + LOOK_S)
        _pulse(line, setup)


def _pulse(line: Line, setup: ServoSetup) -> int:
    for _ in range(3):
        found = line.pulses((setup.id,))
        if found is not None:
            return found[0]
    raise ServoMissing(
        f"{line.port.port_name}: no answer about {servo_label(setup)}: check its cable"
    )


def _end(line: Line, setup: ServoSetup) -> None:
    """Stop the pulses and see that they have.

    Raises:
        ServoFault: nobody confirms it.
    """
    try:
        left = switch_off(line, (setup.id,))
        sure = not left.holding and not left.mute
    except BusLost:
        sure = False
    if not sure:
        raise ServoFault(f"{servo_label(setup)} may still get pulses: switch the servo supply off")


def sent_home(line: Line) -> tuple[str, ...]:
    """Send all channels home and clear the errors; gives those that the board held, by name.

    Raises:
        ServoMissing: the board does not answer.
        BusLost: the port is gone.
    """
    register = line.greet()
    if register is None:
        raise ServoMissing(
            f"{line.port.port_name}: no Maestro answers: gazerig doctor names the cure"
        )
    line.send(line.speech.go_home())
    return name_errors(register)
