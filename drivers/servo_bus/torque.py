"""Switching torque on and off without unrequested motion.

Some firmware follows the last goal as soon as torque is switched on, some switches torque on with a
goal, and some wraps the position by a turn at that moment. So the first goal is the present
position, with its speed if a goal includes one. It is read back before torque is switched on, and
positions are read again before and afterwards.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from math import ceil
from typing import TYPE_CHECKING

from gazerig.drivers.bus.goal_limits import entry_speed_steps_s
from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import ServoFault, ServoMissing
from gazerig.drivers.event_log import register_label
from gazerig.drivers.serial.port import BusPort, open_port
from gazerig.drivers.servo_bus.family import Family, GoalWrite
from gazerig.drivers.servo_bus.transaction import Transactions

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

TRIES = 3

JUMP_TURN = 0.25
"""Share of a turn that no hand moves a joint while torque is switched on: it has wrapped."""

FAR_SIDE = (
    "beyond its encoder's zero, and would move into its range in the wrong direction: turn it into "
    "that range by hand, then restart its power"
)

STILL_STEPS = 16
"""Distance that a joint without torque, held by a hand, may move between two reads."""

WATCHDOG_S = 0.2
"""Silence after which servos with a watchdog stop by themselves."""


def enable(
    line: Transactions, setups: Mapping[int, "ServoConfig"], ids: Sequence[int]
) -> tuple[tuple[int, ...], dict[int, float]]:
    """Set goals to the present positions, clipped to the limits, then switch torque on.

    Servos outside their limits move inside slowly.

    Args:
        line: Exchanges on the bus.
        setups: All servos by id.
        ids: Servos that get torque.

    Returns:
        The goals in steps, and by id the times that servos outside need, seconds.

    Raises:
        ServoMissing: a servo does not answer or rejects its goal.
        ServoFault: a servo refuses its torque, or would move in the wrong direction.
    """
    family = line.family
    unit_s = family.watchdog_unit_s  # 0 for a family without a watchdog
    watchdog = ceil(WATCHDOG_S / unit_s) if unit_s else 0
    if not ids:
        return (), {}
    if watchdog:
        write_verified(line, "bus_watchdog", dict.fromkeys(ids, 0))
    present = read_positions(line, ids)
    goals, outside = dict[int, int](), dict[int, float]()
    for servo_id, steps in present.items():
        setup, turn = setups[servo_id], family.steps_per_turn
        goals[servo_id] = min(max(steps, setup.min_steps), setup.max_steps)
        away = abs(goals[servo_id] - steps)
        # The servo itself would not take a shorter way across its encoder's zero.
        if family.single_turn and 2 * away > turn - (setup.max_steps - setup.min_steps):
            raise ServoFault(f"{line.label(servo_id)} is at {steps}, {FAR_SIDE}")
        if away:
            outside[servo_id] = away / entry_speed_steps_s(setup, turn)
    own = [setups[servo_id] for servo_id in ids]
    speeds = goal_speeds(family, own, outside)
    accelerations = [family.acceleration_units(setup.max_accel_steps_s2) for setup in own]
    armed = accelerations if family.goal_speed else speeds
    write_verified(line, family.arming_register, dict(zip(ids, armed, strict=True)))
    _switch_on(line, present, goals, dict(zip(ids, speeds, strict=True)))
    if watchdog:
        write_verified(line, "bus_watchdog", dict.fromkeys(ids, watchdog))
    return tuple(goals.values()), outside


def goal_speeds(
    family: Family, setups: Sequence["ServoConfig"], outside: Collection[int]
) -> list[int]:
    """Return speed limits in register units, slow for servos outside their limits, by id."""
    turn = family.steps_per_turn
    return [
        family.speed_units(
            entry_speed_steps_s(one, turn) if one.id in outside else one.max_speed_steps_s
        )
        for one in setups
    ]


def read_positions(line: Transactions, ids: Sequence[int]) -> dict[int, int]:
    """Read every position, in the servos' own count; return them by id.

    Raises:
        ServoMissing: a servo does not answer.
    """
    found = line.ask(ids, "present_position")
    raise_missing(line, [servo_id for servo_id in ids if servo_id not in found])
    return {servo_id: found[servo_id] for servo_id in ids}


def write_verified(
    line: Transactions,
    name: str,
    wanted: Mapping[int, int],
    send: Callable[[Sequence[int]], None] | None = None,
    resting: Mapping[int, int] | None = None,
) -> None:
    """Write a register and read it back until every servo has its value.

    Args:
        line: Exchanges on the bus.
        name: The register.
        wanted: Values by id.
        send: Sends the values to some servos; None: by a write of the register.
        resting: Positions of servos without torque: their goals may follow their shafts, which
            cannot cause a jump.

    Raises:
        ServoMissing: a servo does not answer or rejects it.
    """
    left, found = dict(wanted), dict[int, int]()
    for _ in range(TRIES):
        if send:
            send(tuple(left))
        else:
            line.write_all(tuple(left), name, left.values())
        found = line.ask(tuple(left), name)
        for servo_id, value in found.items():
            rests = resting is not None and abs(value - resting[servo_id]) <= STILL_STEPS
            if rests or value == left[servo_id]:
                del left[servo_id]
        if not left:
            return
    raise_missing(line, [servo_id for servo_id in left if servo_id not in found])
    refused = "; ".join(
        f"{line.label(servo_id)} does not accept {register_label(name)} {value}"
        for servo_id, value in left.items()
    )
    raise ServoMissing(
        f"{line.port.port_name}: {refused}: restart its power or correct the rig file"
    )


def _switch_on(
    line: Transactions,
    present: Mapping[int, int],
    goals: Mapping[int, int],
    speeds: Mapping[int, int],
) -> None:
    """Set the goals with their speeds, then switch torque on; no position may change by that."""
    family, ids = line.family, tuple(goals)

    def send(left: Sequence[int]) -> None:
        builder = GoalWrite(family, left)
        line.send(builder.packet([goals[i] for i in left], [speeds[i] for i in left]))

    write_verified(line, "goal_position", goals, send, present if family.goal_speed else None)
    before = read_positions(line, ids)
    # Damaged bytes may pass a checksum of one byte: a goal from them would be a jump.
    moved = [line.label(i) for i in ids if abs(before[i] - present[i]) > STILL_STEPS]
    if moved:
        named = ", ".join(moved)
        raise ServoMissing(f"{line.port.port_name}: {named} does not rest: hold it still")
    try:
        write_verified(line, "torque_enable", dict.fromkeys(ids, 1))
    except ServoMissing:
        named = ", ".join(
            f"{line.label(i)}: {' and '.join(family.name_errors(bits))}"
            for i, bits in line.ask(ids, family.error_register).items()
            if bits
        )
        if not named:
            raise
        remedy = "let it cool, free it, check its supply, then restart its power"
        raise ServoFault(f"{named}: {remedy}") from None
    for servo_id, now in read_positions(line, ids).items():
        if abs(now - before[servo_id]) > JUMP_TURN * family.steps_per_turn:
            raise ServoFault(
                f"{line.label(servo_id)}: position jumped from {before[servo_id]} to {now} when "
                f"torque was switched on: set its Homing Offset to 0 and restart its power"
            )
    if family.goal_speed:
        write_verified(line, "goal_position", goals, send)


def switch_off(line: Transactions, ids: Sequence[int]) -> ReleaseResult:
    """Switch the watchdog, then torque off, and verify that torque is off."""
    left = tuple(ids)
    found: dict[int, int] = {}
    watchdog = ("bus_watchdog",) if line.family.watchdog_unit_s else ()
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
    open_port(port, baud)
    released = switch_off(Transactions(port, family, baud), ids)
    return (*released.holding_ids, *released.unconfirmed_ids)


def raise_missing(line: Transactions, missing: Sequence[int]) -> None:
    """Raise ``ServoMissing`` if any servo has not answered."""
    if missing:
        named = ", ".join(line.label(servo_id) for servo_id in missing)
        fault = f"{line.port.port_name}: no answer from {named}"
        raise ServoMissing(
            line.lateness.blame(fault, "check its cable and power", line.port.now_s())
        )
