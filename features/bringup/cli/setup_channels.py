"""Which servo hangs on which channel of a board: each is moved a little, and a person says."""

from collections.abc import Callable, Mapping, Sequence
from math import radians

import typer

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, ServoFault
from gazerig.drivers.hobby_board.board import Board
from gazerig.drivers.hobby_board.models import US_STEPS
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.channel_test import FINE_STEPS, ChannelPosition, walk
from gazerig.robot.cli.terminal import say, signals
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams

WIGGLE_DEG = 5.0

Explain = Callable[[ServoConfig, ChannelPosition], str]
"""Says why a board's pulse is not where it was sent, and the cure."""


def try_channels(
    board: Board,
    setups: Sequence[ServoConfig],
    joints: Mapping[str, JointParams],
    yes: bool,
    explain: Explain,
) -> list[str]:
    """Move one channel after the other; return the joints that were skipped.

    Raises:
        ServoMissing: the board does not answer, and no user is asked (``yes``).
        ServoFault: pulses could not be stopped.
        BusLost: the port is gone.
    """
    say(
        "Now each channel moves its servo a little. Keep fingers away: as a servo's pulses begin "
        "it goes to its rest place at once, wherever it is."
    )
    left = []
    for n, setup in enumerate(setups, 1):
        say(f"{n} of {len(setups)}: {servo_label(setup)}")
        if not _channel(board, setup, joints[setup.name], yes, explain):
            left.append(setup.name)
    return left


def walked(
    board: Board, setup: ServoConfig, places: Sequence[int], *speed_steps_s: float
) -> tuple[ChannelPosition, ...]:
    """Lead a channel over places; a request to end is obeyed with pulses off.

    Raises:
        KeyboardInterrupt: the user asked for the end.
    """
    clock = RealClock()
    with signals() as stopped:
        stopped.never_raise()

        def sleep_until(t_s: float) -> None:
            stopped.refuse()
            clock.sleep_until(t_s)

        return walk(board, setup, places, sleep_until, *speed_steps_s)


def rest_steps(setup: ServoConfig) -> int:
    """Return the pulse at which a joint rests, within its range."""
    middle = (setup.min_steps + setup.max_steps) // 2
    rest = middle if setup.rest_steps is None else setup.rest_steps
    return min(max(rest, setup.min_steps), setup.max_steps)


def _channel(
    board: Board, setup: ServoConfig, joint: JointParams, yes: bool, explain: Explain
) -> bool:
    """Move one channel's servo until the person knows it, or skips it."""
    rest, low, high = wiggle(setup, joint)
    while True:
        at = f"it goes to {rest / US_STEPS:g} us at once, then {WIGGLE_DEG:g} deg to and fro"
        if not yes and not typer.confirm(f"   move it? {at}", default=False, err=True):
            return False
        try:
            gone = walked(board, setup, (rest, low, high, rest))
        except ServoFault:
            raise
        except DriverError as error:
            if yes:
                raise
            say(f"   {error}")
            continue
        for one in gone:
            if abs(one.asked - one.got) > FINE_STEPS:
                say(f"   {explain(setup, one)}")
                break
        name = setup.name.replace("_", " ")
        if yes or typer.confirm(f"   did the {name} move, and nothing else?", err=True):
            return True
        say(
            f"   then plug its servo into channel {setup.id}, or write the channel that it is on "
            f"as joints.{setup.name}.id; n at the next question skips it"
        )


def wiggle(setup: ServoConfig, joint: JointParams) -> tuple[int, int, int]:
    """Return the rest place and two places about it, in steps, all within the joint's range."""
    made, rest = joint.made(), rest_steps(setup)
    angle = made.angle_rad(rest)
    least, most = radians(joint.min_deg), radians(joint.max_deg)
    ends = (max(least, angle - radians(WIGGLE_DEG)), min(most, angle + radians(WIGGLE_DEG)))
    low, high = (min(max(round(made.steps(end)), setup.min_steps), setup.max_steps) for end in ends)
    return rest, low, high
