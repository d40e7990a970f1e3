"""Switching the torque on and off, so that nothing moves that was not asked to.

Some firmware follows the last goal as soon as the torque comes on, so goals are read
back before; some wraps the position by a turn at that moment, so positions are read
again after.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from drivers.dynamixel.control_table import STEPS_PER_TURN, name_errors
from drivers.errors import ServoFault, ServoMissing
from drivers.servo_bus.line import Line

TRIES = 3
TRIPPED = 255
"""Bus Watchdog (98) reads so after it has stopped the servo."""

JUMP_STEPS = STEPS_PER_TURN // 4
"""No hand moves a joint so far while the torque comes on: the position has wrapped."""


def positions(line: Line, ids: Sequence[int]) -> tuple[int, ...]:
    """Read every position.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer.
    """
    found = line.ask(ids, "present_position")
    _raise_missing(line, [servo_id for servo_id in ids if servo_id not in found])
    return tuple(found[servo_id] for servo_id in ids)


def insist(line: Line, ids: Sequence[int], name: str, values: Sequence[int]) -> None:
    """Write a register and read it back until every servo has its value.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer or does not take it.
    """
    left = dict(zip(ids, values, strict=True))
    for _ in range(TRIES):
        line.write_all(tuple(left), name, left.values())
        found = line.ask(tuple(left), name)
        left = {servo_id: v for servo_id, v in left.items() if found.get(servo_id) != v}
        if not left:
            return
    _raise_missing(line, [servo_id for servo_id in left if servo_id not in found])
    refused = ", ".join(f"{line.who(servo_id)}: {value}" for servo_id, value in left.items())
    raise ServoMissing(
        f"{line.port.port_name}: {name} is not taken ({refused}): restart the servo power"
    )


def switch_on(line: Line, ids: Sequence[int], goals: Sequence[int]) -> None:
    """Set the goals, then the torque, and see that every position is still the same.

    Raises:
        drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
        drivers.errors.ServoFault: a servo has latched an error, or its position jumped.
    """
    insist(line, ids, "goal_position", goals)
    before = positions(line, ids)
    try:
        insist(line, ids, "torque_enable", [1] * len(ids))
    except ServoMissing:
        latched = find_latched(line, ids)
        if not latched:
            raise
        named = ", ".join(
            f"{line.who(servo_id)}: {' and '.join(name_errors(status))}"
            for servo_id, status in latched.items()
        )
        raise ServoFault(f"{named}: let it cool, free it, then restart the servo power") from None
    for servo_id, was, now in zip(ids, before, positions(line, ids), strict=True):
        if abs(now - was) > JUMP_STEPS:
            raise ServoFault(
                f"{line.who(servo_id)}: position jumped from {was} to {now} as the torque came on: "
                "set its Homing Offset to 0"
            )


class Released(NamedTuple):
    """Servos that still report torque, and those that report nothing."""

    holding: tuple[int, ...]
    mute: tuple[int, ...]


def switch_off(line: Line, ids: Sequence[int]) -> Released:
    """Take the torque away, watchdog first, and see that it is gone."""
    left = tuple(ids)
    found: dict[int, int] = {}
    for _ in range(TRIES):
        # Twice: no servo confirms a group write, and this one matters most.
        for name in ("bus_watchdog", "torque_enable", "torque_enable"):
            line.write_all(left, name, [0] * len(left))
        found = line.ask(left, "torque_enable")
        left = tuple(servo_id for servo_id in left if found.get(servo_id, 1))
        if not left:
            break
    holding = tuple(servo_id for servo_id in left if servo_id in found)
    return Released(holding, tuple(servo_id for servo_id in left if servo_id not in found))


def find_latched(line: Line, ids: Sequence[int]) -> dict[int, int]:
    """Give Hardware Error Status of the servos that answer and have latched any."""
    found = line.ask(ids, "hardware_error_status")
    return {servo_id: status for servo_id, status in found.items() if status}


def heal_tripped(
    line: Line, ids: Sequence[int], watchdog: int, clip: Callable[[int, int], int]
) -> tuple[int, ...]:
    """Give servos whose bus watchdog has tripped their present position as goal and arm it anew.

    A tripped servo stands still and refuses goals. ``clip(id, steps)`` keeps a goal inside
    the limits. Gives the servos that were healed.
    """
    state = line.ask(ids, "bus_watchdog")
    tripped = [servo_id for servo_id, value in state.items() if value == TRIPPED]
    if not tripped:
        return ()
    found = line.ask(tripped, "present_position")
    healed = tuple(found)
    if healed:
        line.write_all(healed, "bus_watchdog", [0] * len(healed))
        line.write_all(healed, "goal_position", [clip(i, found[i]) for i in healed])
        line.write_all(healed, "bus_watchdog", [watchdog] * len(healed))
    return healed


def _raise_missing(line: Line, missing: Sequence[int]) -> None:
    if missing:
        named = ", ".join(line.who(servo_id) for servo_id in missing)
        raise ServoMissing(f"{line.port.port_name}: no answer from {named}: check its cable")
