"""What a scan has found, in words and in plain values; printed by the command line."""

from collections.abc import Container, Iterator, Sequence

from gazerig.drivers.bus.servo_models import BusKind
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.servo_bus.discovery import FoundServo
from gazerig.features.bringup.bus_search import SearchRound, found_of


def servo_plain(kind: BusKind, servo: FoundServo) -> dict[str, object]:
    """Return a servo as JSON can hold it."""
    return {
        "kind": kind,
        "id": servo.id,
        "number": servo.number,
        "firmware": servo.firmware,
        "baud": servo.baud,
        "model": servo.model,
    }


def board_plain(looked: SearchRound) -> dict[str, object]:
    """Return a Maestro as JSON can hold it; pulses in us, 0 for none."""
    board = looked.board
    if board is None:
        raise ValueError("no board answered")
    pulses = [pulse / US_STEPS for pulse in board.pulses]
    return {**board._asdict(), "channels": looked.channels, "baud": looked.baud, "pulses": pulses}


def board_text(looked: SearchRound) -> Iterator[str]:
    """Return a description of what a board reported."""
    board = looked.board
    if board is None:
        return
    if looked.channels is not None:
        size = f"{looked.channels} channels"
    else:
        size = "6 channels or more (asking for one too many would send all of them home)"
    crc = "on" if board.crc else "off"
    yield f"Pololu Maestro: {size}, {' and '.join(board.forms)} form, CRC {crc}"
    given = [f"{n}: {pulse / US_STEPS:g} us" for n, pulse in enumerate(board.pulses) if pulse]
    yield f"pulses: {', '.join(given) or 'none'} (channels 0..{len(board.pulses) - 1})"
    yield f"errors it held, cleared by asking: {', '.join(board.errors) or 'none'}"
    yield {True: "its own script runs", False: "no script runs", None: "its script: no answer"}[
        board.script
    ]


def remarks(
    rounds: Sequence[SearchRound], where: str, requested: Sequence[BusKind] = ()
) -> Iterator[str]:
    """Return remarks on a scan beyond its tables of servos and boards.

    requested: kinds that were to be asked, unless one before them answered
    """
    found = found_of(rounds)
    boards = sum(1 for one in rounds if one.board is not None)
    if not boards or found:
        count = f"{len(found)} servo{'s' if len(found) != 1 else ''}"
        yield f"{count} on {where}; {_asked(rounds)}"
    unasked = [kind for kind in requested if kind not in {one.kind for one in rounds}]
    if unasked and boards:
        yield "nothing else was sent: packets for servos would move what hangs on the board"
    elif unasked and found:
        yield f"{' and '.join(unasked)} was not asked, as others answered: --kind all asks it too"
    for one in rounds:
        yield from _odd(one, {rate.baud for rate in rounds if rate.answered})
    if not found and not boards:
        yield (
            "no servo answers: is the servo supply on? does each servo's LED flash once when it "
            "comes on? is the first cable in the right plug of the adaptor? is another program "
            "using the port? a Maestro on USB: is it set to 'USB Dual Port', and is this the "
            "first of its two ports?"
        )


def _asked(rounds: Sequence[SearchRound]) -> str:
    """Return a text: which kinds were searched at which baud rates."""
    rates: dict[BusKind, list[str]] = {}
    for one in rounds:
        if one.possible:
            rates.setdefault(one.kind, []).append(str(one.baud))
    return "; ".join(f"asked {kind} at {', '.join(some)} bit/s" for kind, some in rates.items())


def _odd(one: SearchRound, heard: Container[int]) -> Iterator[str]:
    """Return what was unusual at one baud rate."""
    twice = {servo.id for servo in one.found if one.found.count(servo) > 1}
    for servo_id in sorted({*one.shared, *twice}):
        yield (
            f"two or more servos have id {servo_id} at {one.baud} bit/s: connect them one at a "
            "time and run gazerig setup"
        )
    if one.found or one.baud in heard:
        return
    if one.protocol_1:
        ids = ", ".join(map(str, one.protocol_1))
        yield (
            f"at {one.baud} bit/s something answers in Protocol 1 as id {ids}: another maker's "
            "servo (gazerig scan --kind feetech), or one whose Protocol Type must be set to 2 with "
            "Dynamixel Wizard 2.0"
        )
    elif one.junk:
        yield (
            f"at {one.baud} bit/s only pieces came: a wrong rate, a loose plug, or two servos "
            "with one id"
        )
