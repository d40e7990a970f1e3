"""What is wrong with the channels of a board of hobby servos, whatever its make. Pure.

A make says what it was asked and what it calls things; the rules are here.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import Diagnostic

WHERE = "the board"
UNASKED = "was not asked: others give pulses, and were it not there, the board would send them home"


class BoardRules(NamedTuple):
    """What differs from make to make.

    most_input: a channel that answers up to so much is an input; 0: none can be
    left_on, outside: what to do about pulses inside and outside a joint's range that no program
        sends; {name} is the joint
    notes: what no board of the make tells, and what to do about it
    """

    most_input: int
    left_on: str
    outside: str
    notes: tuple[Diagnostic, ...]


def examine(
    rules: BoardRules,
    setups: Sequence[ServoConfig],
    pulses: Mapping[int, int | None],
    channels: int,
    own: Sequence[Diagnostic],
    well: str,
) -> list[Diagnostic]:
    """Judge a board that answers.

    Args:
        rules: of its make.
        setups: the servos of the rig.
        pulses: by channel, quarter microseconds, 0 for none, None where it kept silent; channels
            that were not asked are missing.
        channels: how many it has.
        own: what the make has found wrong beside.
        well: what is said where nothing is wrong.
    """
    findings = [*own, *_channels(rules, setups, pulses, channels)]
    if not any(finding.level in ("warn", "error") for finding in findings):
        given = sum(1 for pulse in pulses.values() if pulse)
        well = f"{well}; pulses on {given} of {len(pulses)} channels"
        findings.insert(0, Diagnostic("ok", well, WHERE))
    untold = Diagnostic(
        "note",
        "hobby servos tell nothing: position, load, temperature and supply cannot be examined",
        "the servos",
    )
    return [*findings, untold, *rules.notes]


def _channels(
    rules: BoardRules,
    setups: Sequence[ServoConfig],
    pulses: Mapping[int, int | None],
    channels: int,
) -> Iterator[Diagnostic]:
    """Judge every channel of the rig."""
    for setup in setups:
        pulse, where = pulses.get(setup.id), servo_label(setup)
        if setup.id >= channels:
            what = f"the board has channels 0..{channels - 1} only"
            yield Diagnostic("error", what, where, "correct its id in the YAML")
        elif setup.id not in pulses:
            remedy = "stop the pulses of all servos and look again"
            yield Diagnostic("note", UNASKED, where, remedy)
        elif pulse is None:
            what = "the board does not answer about this channel"
            remedy = "has it so many channels? correct its id, or bus.maestro.channels"
            yield Diagnostic("error", what, where, remedy)
        elif 0 < pulse <= rules.most_input:
            remedy = "set its channel to Servo in Pololu's program"
            yield Diagnostic("error", "is an input", where, remedy)
        elif pulse:
            yield _left_on(rules, setup, pulse)


def _left_on(rules: BoardRules, setup: ServoConfig, pulse: int) -> Diagnostic:
    what = f"gets pulses of {pulse / US_STEPS:g} us though no program runs it"
    if setup.min_steps <= pulse <= setup.max_steps:
        return Diagnostic("warn", what, servo_label(setup), rules.left_on.format(name=setup.name))
    low, high = setup.min_steps / US_STEPS, setup.max_steps / US_STEPS
    return Diagnostic(
        "error",
        f"{what}, outside its range {low:g}..{high:g} us",
        servo_label(setup),
        rules.outside.format(name=setup.name),
    )
