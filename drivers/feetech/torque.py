"""Switching the torque on and off, so that nothing moves that was not asked to.

Some firmware follows the last goal as soon as the torque comes on, and some switches the
torque on with a goal. So the first goal is the present place, it is written together with
the speed that may be used for it, and both are read back before the torque comes on.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple, TypeVar

from drivers.errors import ServoFault, ServoMissing
from drivers.feetech.line import FeetechLine
from drivers.feetech.memory_table import REGISTERS, STEPS_PER_TURN, name_errors
from drivers.feetech.protocol import GoalWrite

TRIES = 3

JUMP_STEPS = STEPS_PER_TURN // 4
"""No hand moves a joint so far while the torque comes on."""

STILL_STEPS = 16
"""A limp joint held by a hand moves so far between two questions."""

Value = TypeVar("Value")

_GOAL, _SPEED = REGISTERS["goal_position"], REGISTERS["goal_speed"]


def positions(line: FeetechLine, ids: Sequence[int]) -> tuple[int, ...]:
    """Read every position, as the servos count.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer.
    """
    found = line.ask(ids, "present_position")
    _raise_missing(line, [servo_id for servo_id in ids if servo_id not in found])
    return tuple(found[servo_id] for servo_id in ids)


def insist(line: FeetechLine, ids: Sequence[int], name: str, values: Sequence[int]) -> None:
    """Write a register and read it back until every servo has its value.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer or does not take it.
    """
    _until(
        line,
        dict(zip(ids, values, strict=True)),
        lambda left: line.write_all(tuple(left), name, left.values()),
        lambda left: line.ask(left, name),
        name,
    )


def insist_goals(
    line: FeetechLine, ids: Sequence[int], goals: Sequence[int], speeds: Sequence[int]
) -> None:
    """Write goals with their speeds and read them back until every servo has them.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
    """
    wanted = dict(zip(ids, zip(goals, speeds, strict=True), strict=True))
    _until(line, wanted, partial(_send_goals, line), partial(_ask_goals, line), "goal_position")


def _send_goals(line: FeetechLine, wanted: Mapping[int, tuple[int, int]]) -> None:
    goals = [goal for goal, _ in wanted.values()]
    speeds = [speed for _, speed in wanted.values()]
    line.send(GoalWrite(tuple(wanted)).packet(goals, speeds))


def _ask_goals(line: FeetechLine, ids: Sequence[int]) -> dict[int, tuple[int, int]]:
    found = line.ask_bytes(ids, GoalWrite.ADDRESS, GoalWrite.SIZE)
    return {i: (_GOAL.decode(data[:2]), _SPEED.decode(data[4:])) for i, data in found.items()}


def _prepare_goals(
    line: FeetechLine,
    ids: Sequence[int],
    goals: Sequence[int],
    speeds: Sequence[int],
    present: Sequence[int],
) -> None:
    """Write goals with their speeds to limp servos; a servo may keep its own place as goal.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
    """
    places = dict(zip(ids, present, strict=True))
    wanted = dict(zip(ids, zip(goals, speeds, strict=True), strict=True))

    def ask(left: Sequence[int]) -> dict[int, tuple[int, int]]:
        # Where a limp servo's goal goes with its place, nothing can leap either.
        return {
            i: (wanted[i][0] if abs(goal - places[i]) <= STILL_STEPS else goal, speed)
            for i, (goal, speed) in _ask_goals(line, left).items()
        }

    _until(line, wanted, partial(_send_goals, line), ask, "goal_position")


def _until(
    line: FeetechLine,
    wanted: Mapping[int, Value],
    send: Callable[[Mapping[int, Value]], None],
    ask: Callable[[Sequence[int]], Mapping[int, Value]],
    name: str,
) -> None:
    """Send and ask until every servo has what is wanted of it."""
    left: dict[int, Value] = dict(wanted)
    found: Mapping[int, Value] = {}
    for _ in range(TRIES):
        send(left)
        found = ask(tuple(left))
        left = {servo_id: v for servo_id, v in left.items() if found.get(servo_id) != v}
        if not left:
            return
    _raise_missing(line, [servo_id for servo_id in left if servo_id not in found])
    refused = ", ".join(f"{line.who(servo_id)}: {value}" for servo_id, value in left.items())
    raise ServoMissing(
        f"{line.port.port_name}: {name} is not taken ({refused}): restart the servo power"
    )


def switch_on(
    line: FeetechLine, ids: Sequence[int], goals: Sequence[int], speeds: Sequence[int]
) -> None:
    """Set the goals, then the torque, and see that every position is still the same.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
        drivers.errors.ServoFault: a servo refuses its torque, or its position jumped.
    """
    before = positions(line, ids)
    _prepare_goals(line, ids, goals, speeds, before)
    try:
        insist(line, ids, "torque_enable", [1] * len(ids))
    except ServoMissing:
        ailing = {i: status for i, status in line.ask(ids, "status").items() if status}
        if not ailing:
            raise
        named = ", ".join(
            f"{line.who(i)}: {' and '.join(name_errors(status))}" for i, status in ailing.items()
        )
        raise ServoFault(f"{named}: let it cool, free it, check its supply") from None
    for servo_id, was, now in zip(ids, before, positions(line, ids), strict=True):
        if abs(now - was) > JUMP_STEPS:
            raise ServoFault(
                f"{line.who(servo_id)}: position jumped from {was} to {now} as the torque came on: "
                "restart the servo power"
            )
    insist_goals(line, ids, goals, speeds)


class Released(NamedTuple):
    """Servos that still report torque, and those that report nothing."""

    holding: tuple[int, ...]
    mute: tuple[int, ...]


def switch_off(line: FeetechLine, ids: Sequence[int]) -> Released:
    """Take the torque away, and see that it is gone."""
    left = tuple(ids)
    found: dict[int, int] = {}
    for _ in range(TRIES):
        # Twice: no servo confirms a group write, and this one matters most.
        for _ in range(2):
            line.write_all(left, "torque_enable", [0] * len(left))
        found = line.ask(left, "torque_enable")
        left = tuple(servo_id for servo_id in left if found.get(servo_id, 1))
        if not left:
            break
    holding = tuple(servo_id for servo_id in left if servo_id in found)
    return Released(holding, tuple(servo_id for servo_id in left if servo_id not in found))


def _raise_missing(line: FeetechLine, missing: Sequence[int]) -> None:
    if missing:
        named = ", ".join(line.who(servo_id) for servo_id in missing)
        raise ServoMissing(f"{line.port.port_name}: no answer from {named}: check its cable")
