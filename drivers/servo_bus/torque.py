"""Switching torque on and off without unrequested motion.

Some firmware follows the last goal as soon as torque is switched on, some switches torque on with a
goal, and some wraps the position by a turn at that moment. So the first goal is the present
position, with its speed if a goal includes one. It is read back before torque is switched on, and
positions are read again afterwards.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeVar

from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import PortError, ServoFault, ServoMissing
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.transaction import Transactions

TRIES = 3
TRIPPED = 255
"""Value of Bus Watchdog after it has stopped the servo."""

JUMP_TURN = 0.25
"""Share of a turn that no hand moves a joint while torque is switched on: it has wrapped."""

STILL_STEPS = 16
"""Distance that a joint without torque, held by a hand, may move between two reads."""

LEAST_S, MOST_S = 0.005, 0.02
"""Time-outs of an answer beyond its time on the wire, when torque is released on a raw port."""

Value = TypeVar("Value")


def read_positions(line: Transactions, ids: Sequence[int]) -> tuple[int, ...]:
    """Read every position, in the servos' own count.

    They become the first goals: with a weak checksum, two answers must agree.

    Raises:
        ServoMissing: a servo does not answer, or its answers disagree.
    """
    found = line.ask(ids, "present_position")
    if line.family.weak_check:
        again = line.ask(tuple(found), "present_position")
        found = {i: now for i, now in again.items() if abs(now - found[i]) <= STILL_STEPS}
    _raise_missing(line, [servo_id for servo_id in ids if servo_id not in found])
    return tuple(found[servo_id] for servo_id in ids)


def write_verified(
    line: Transactions, ids: Sequence[int], name: str, values: Sequence[int]
) -> None:
    """Write a register and read it back until every servo has its value.

    Raises:
        ServoMissing: a servo does not answer or rejects it.
    """
    _send_until(
        line,
        dict(zip(ids, values, strict=True)),
        lambda left: line.write_all(tuple(left), name, left.values()),
        lambda left: line.ask(left, name),
        name,
    )


def _send_goals(line: Transactions, wanted: Mapping[int, tuple[int, int]]) -> None:
    goals = [goal for goal, _ in wanted.values()]
    speeds = [speed for _, speed in wanted.values()]
    line.send(line.family.create_goal_packets(tuple(wanted)).packet(goals, speeds))


def _ask_goals(
    line: Transactions, present: Mapping[int, tuple[int, int]], ids: Sequence[int]
) -> dict[int, tuple[int, int]]:
    """Read goals and goal speeds; a goal that only followed the shaft counts as the wanted one.

    present: position and wanted goal of servos without torque
    """
    goal, speed = (line.family.registers[name] for name in ("goal_position", "goal_speed"))
    span = speed.address + speed.size - goal.address
    found = {}
    for i, data in line.ask_bytes(ids, goal.address, span).items():
        steps = goal.decode(data[: goal.size])
        place, wanted = present.get(i, (steps, steps))
        # The goal of a servo without torque may follow its shaft, which cannot cause a jump.
        near = abs(steps - place) <= STILL_STEPS
        found[i] = wanted if near else steps, speed.decode(data[-speed.size :])
    return found


def _send_until(
    line: Transactions,
    wanted: Mapping[int, Value],
    send: Callable[[Mapping[int, Value]], None],
    ask: Callable[[Sequence[int]], Mapping[int, Value]],
    name: str,
) -> None:
    """Send and read until every servo has its wanted value."""
    left: dict[int, Value] = dict(wanted)
    found: Mapping[int, Value] = {}
    for _ in range(TRIES):
        send(left)
        found = ask(tuple(left))
        left = {servo_id: v for servo_id, v in left.items() if found.get(servo_id) != v}
        if not left:
            return
    _raise_missing(line, [servo_id for servo_id in left if servo_id not in found])
    refused = ", ".join(f"{line.label(servo_id)}: {value}" for servo_id, value in left.items())
    raise ServoMissing(
        f"{line.port.port_name}: {name} is not accepted ({refused}): restart the servo power"
    )


def switch_on(
    line: Transactions, ids: Sequence[int], goals: Sequence[int], speeds: Sequence[int]
) -> None:
    """Set the goals, then switch torque on, and check that no position has changed.

    Raises:
        ServoMissing: a servo does not answer or rejects its goal.
        ServoFault: a servo refuses its torque, or its position jumped.
    """
    family = line.family
    wanted = dict(zip(ids, zip(goals, speeds, strict=True), strict=True))
    send = partial(_send_goals, line)
    if family.goal_speed:
        before = read_positions(line, ids)
        places = dict(zip(ids, zip(before, goals, strict=True), strict=True))
        _send_until(line, wanted, send, partial(_ask_goals, line, places), "goal_position")
    else:
        write_verified(line, ids, "goal_position", goals)
        before = read_positions(line, ids)
    try:
        write_verified(line, ids, "torque_enable", [1] * len(ids))
    except ServoMissing:
        ailing = find_faults(line, ids)
        if not ailing:
            raise
        named = ", ".join(
            f"{line.label(i)}: {' and '.join(family.name_errors(bits))}"
            for i, bits in ailing.items()
        )
        raise ServoFault(f"{named}: let it cool, free it, {family.fault_cure}") from None
    for servo_id, was, now in zip(ids, before, read_positions(line, ids), strict=True):
        if abs(now - was) > JUMP_TURN * family.steps_per_turn:
            raise ServoFault(
                f"{line.label(servo_id)}: position jumped from {was} to {now} when torque was switched on: "
                f"{family.jump_cure}"
            )
    if family.goal_speed:
        _send_until(line, wanted, send, partial(_ask_goals, line, {}), "goal_position")


def switch_off(line: Transactions, ids: Sequence[int]) -> ReleaseResult:
    """Switch the watchdog, then torque off, and verify that torque is off."""
    left = tuple(ids)
    found: dict[int, int] = {}
    watchdog = () if line.family.watchdog_unit_s is None else ("bus_watchdog",)
    for _ in range(TRIES):
        # Twice, as no servo confirms a group write, and this one matters most.
        for name in (*watchdog, "torque_enable", "torque_enable"):
            line.write_all(left, name, [0] * len(left))
        found = line.ask(left, "torque_enable")
        left = tuple(servo_id for servo_id in left if found.get(servo_id, 1))
        if not left:
            break
    holding = tuple(servo_id for servo_id in left if servo_id in found)
    return ReleaseResult(holding, tuple(servo_id for servo_id in left if servo_id not in found))


def disable_torque(port: BusPort, family: Family, baud: int, ids: Sequence[int]) -> tuple[int, ...]:
    """Open a port and switch torque off; return the ids that did not confirm it.

    Args:
        port: Closed or open port; it stays open.
        family: Family of the servos.
        baud: Baud rate, bit/s.
        ids: Ids of the servos.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    if not port.setBaudRate(baud):
        raise PortError(
            f"{port.port_name} cannot run at {baud} bit/s: choose {family.recommended_bauds}"
        )
    released = switch_off(Transactions(port, family, LEAST_S, MOST_S, baud), ids)
    return (*released.holding_ids, *released.unconfirmed_ids)


def find_faults(line: Transactions, ids: Sequence[int]) -> dict[int, int]:
    """Return the error bits of the answering servos that have any, by id."""
    found = line.ask(ids, line.family.error_register)
    return {servo_id: bits for servo_id, bits in found.items() if bits}


def rearm_tripped(
    line: Transactions, ids: Sequence[int], watchdog: int, clip: Callable[[int, int], int]
) -> tuple[int, ...]:
    """Rearm tripped bus watchdogs; the servos' goals become their present positions.

    A tripped servo does not move and refuses goals. ``clip(id, steps)`` keeps a goal inside the
    limits.

    Returns:
        The ids of the rearmed servos.
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


def _raise_missing(line: Transactions, missing: Sequence[int]) -> None:
    if missing:
        named = ", ".join(line.label(servo_id) for servo_id in missing)
        fault = f"{line.port.port_name}: no answer from {named}"
        raise ServoMissing(line.lateness.blame(fault, "check its cable", line.port.now_s()))
