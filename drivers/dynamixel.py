"""Dynamixel X servos on one serial bus (Protocol 2.0): one read and one write a tick."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil

from drivers.dynamixel_care import Care
from drivers.dynamixel_group import STARTS, Answer, FastGroup, Group, PlainGroup, silent_ones
from drivers.dynamixel_line import Line
from drivers.dynamixel_packets import ALERT, ERROR_NUMBER, SyncWrite
from drivers.dynamixel_port import BusPort
from drivers.dynamixel_registers import Registers
from drivers.dynamixel_roll import Roll
from drivers.dynamixel_setup import find, prepare
from drivers.dynamixel_table import (
    FAST_READ_SINCE,
    MODELS,
    REGISTERS,
    VELOCITY_UNIT_STEPS_S,
    WATCHDOG_UNIT_S,
)
from drivers.dynamixel_torque import insist, positions, switch_off, switch_on
from drivers.errors import BusLost, PortError, ServoFault, ServoMissing
from drivers.types import BusHealth, ServoReading, ServoSetup


@dataclass(frozen=True, slots=True)
class DynamixelParams:
    """How to speak with the servos."""

    baud: int = field(
        default=1_000_000,
        metadata={
            "choices": (57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000),
            "unit": "bit/s",
            "says": "Speed of the bus; the servos must be set to the same.",
        },
    )
    reply_timeout_ms: float = field(
        default=20.0,
        metadata={
            "low": 1.0,
            "high": 200.0,
            "unit": "ms",
            "says": "Patience for an answer beyond the time its bytes take on the wire.",
        },
    )
    watchdog_ms: int = field(
        default=200,
        metadata={
            "low": 0,
            "high": 2540,
            "unit": "ms",
            "says": "Servos stop by themselves after so much silence, in steps of 20; 0: never.",
        },
    )
    fast_sync_read: bool = field(
        default=True,
        metadata={"unit": "", "says": "Read all servos in one packet where their firmware can."},
    )

    def __post_init__(self) -> None:
        """Refuse a watchdog shorter than its smallest step."""
        if 0 < self.watchdog_ms < 20:
            raise ValueError(f"watchdog_ms {self.watchdog_ms} is too short: 0 or 20..2540")


class DynamixelBus:
    """A chain of Dynamixel servos in position mode; implements drivers.types.ServoBus.

    Args:
        port: drivers.dynamixel_port.BlockingPort, or an emulated port with its methods.
        setups: the servos, in the order of every sequence given and taken.
        params: how to speak with them.
    """

    def __init__(
        self, port: BusPort, setups: Sequence[ServoSetup], params: DynamixelParams
    ) -> None:
        self._port = port
        self._setups = tuple(setups)
        self._params = params
        self._ids = tuple(setup.id for setup in setups)
        self._slot = {servo_id: i for i, servo_id in enumerate(self._ids)}
        self._limits = tuple((setup.min_steps, setup.max_steps) for setup in setups)
        self._units_ma = tuple(MODELS[setup.model].current_unit_ma for setup in setups)
        goal = REGISTERS["goal_position"]
        self._goals = SyncWrite(self._ids, goal.address, goal.size)
        self._watchdog = ceil(params.watchdog_ms / 1000.0 / WATCHDOG_UNIT_S)
        self._line = Line(port, params.reply_timeout_ms / 1000.0, params.baud)
        self._opened = False
        self._forget()

    def _forget(self) -> None:
        """Start with a clean sheet, as after opening."""
        self._fast = False
        self._roll = Roll(self._ids)
        self._groups: dict[tuple[tuple[int, ...], int], Group] = {}
        self._span = 0
        self._care = Care(self._line, self._setups, self._watchdog)

    # --- the bus as others see it

    def open(self) -> None:
        """Open the port, find every servo, check and prepare it; torque stays off.

        Raises:
            drivers.errors.PortError: the port cannot be opened.
            drivers.errors.ServoMissing: servos are absent, of another model or refuse.
        """
        where, baud = self._port.port_name, self._params.baud
        if not self._port.setBaudRate(baud):
            raise PortError(f"{where} cannot run at {baud} bit/s: choose 57600 or 1000000")
        self._forget()
        registers = Registers(self._port)
        try:
            firmware = find(registers, self._setups, where)
            prepare(registers, self._setups, where)
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._opened = True
        self._fast = self._params.fast_sync_read and all(
            firmware[setup.id] >= FAST_READ_SINCE[MODELS[setup.model].family]
            for setup in self._setups
        )
        for servo_id in registers.alerts:
            self._care.alert(servo_id)
        self._care.name_alerts()

    def read(self, now_s: float) -> tuple[ServoReading | None, ...]:
        """Read all servos in one exchange; None where no fresh answer came.

        A servo that keeps silent is left out of the exchange and asked alone now and
        then, so whatever is wrong, a read takes a bounded time.

        Raises:
            drivers.errors.BusLost: the port is gone, or no servo has answered for 0.5 s.
        """
        if self._line.starved:
            self._care.heal()
        group, due = self._roll.group, self._roll.due(now_s)
        readings: list[ServoReading | None] = [None] * len(self._ids)
        heard = self._read_group(group, readings, now_s) if group else 0
        if due is not None:
            heard += self._read_group((due,), readings, now_s)
        self._care.tend(readings, heard, self._roll.group, now_s)
        return tuple(readings)

    def engage(self) -> tuple[int, ...]:
        """Set every goal to the present position (clipped to its limits), then torque on.

        A joint outside its limits is brought inside at 30 deg/s. Returns the goals that
        are now in force, in steps.

        Raises:
            drivers.errors.BusLost: the port is gone.
            drivers.errors.ServoMissing: a servo does not answer or does not take its goal.
            drivers.errors.ServoFault: a servo has latched an error or lost its zero.
        """
        line, ids = self._line, self._ids
        present = positions(line, ids)
        goals = self._clip(present)
        outside = {i for i, p, g in zip(ids, present, goals, strict=True) if p != g}
        try:
            insist(line, ids, "bus_watchdog", [0] * len(ids))
            insist(line, ids, "profile_velocity", self._care.entry_speeds(outside))
            switch_on(line, ids, goals)
            insist(line, ids, "bus_watchdog", [self._watchdog] * len(ids))
        except (ServoMissing, ServoFault):
            self.release()
            raise
        self._care.take_on(outside)
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo in one packet; goals are clipped to the limits.

        Sends nothing while the torque is off.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        if not self._care.engaged:
            return
        if self._line.starved:
            self._care.heal()
        self._line.send(self._goals.packet(self._clip(goals_steps)))

    def faults(self) -> tuple[str, ...]:
        """Name every latched servo fault found so far, e.g. "servo 7: overload"."""
        return tuple(f"servo {i}: {fault}" for i, fault in sorted(self._care.faults.items()))

    def events(self) -> tuple[str, ...]:
        """Say what has happened since the last call."""
        return ()

    def release(self) -> None:
        """Torque off on every servo; never raises for a servo that does not answer.

        Raises:
            drivers.errors.BusLost: the port is gone; armed watchdogs stop the servos.
        """
        self._care.let_go()
        if self._opened:
            self._line.errors["refused"] += len(switch_off(self._line, self._ids))

    def health(self) -> BusHealth:
        """Give byte and error counts of the exchanges after setup."""
        errors = {kind: count for kind, count in self._line.errors.items() if count}
        return BusHealth(self._line.tx_bytes, self._line.rx_bytes, errors)

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self._opened = False
        self._care.let_go()
        self._port.closePort()

    # --- reading

    def _group(self, ids: tuple[int, ...]) -> Group:
        """Give the prepared exchange for some servos."""
        start = STARTS[self._span]
        if (ids, start) not in self._groups:
            kind = FastGroup if self._fast else PlainGroup
            self._groups[ids, start] = kind(ids, start)
        return self._groups[ids, start]

    def _read_group(
        self, ids: tuple[int, ...], readings: list[ServoReading | None], now_s: float
    ) -> int:
        """Read some servos into ``readings``; gives how many answered."""
        group = self._group(ids)
        raw, deadline_s = self._line.exchange(group.request, group.reply_length)
        at_s = self._port.now_s()
        whole = group.whole(raw)
        if whole is None:
            raw = self._line.complete(raw, group.missing, deadline_s)
            return self._save(group, raw, readings, now_s)
        if any(whole.errors) or self._roll.troubled:
            for servo_id, *answer in zip(ids, *whole, strict=True):
                self._take(servo_id, Answer(*answer), readings, at_s)
            return len(ids)
        units, slot = self._units_ma, self._slot
        for servo_id, _, current, velocity, position in zip(ids, *whole, strict=True):
            i = slot[servo_id]
            speed = velocity * VELOCITY_UNIT_STEPS_S
            readings[i] = ServoReading(position, speed, current * units[i], at_s, False)
        return len(ids)

    def _save(
        self, group: Group, raw: bytes, readings: list[ServoReading | None], now_s: float
    ) -> int:
        """Save what is right of an answer that is not; gives how many servos answered."""
        at_s = self._port.now_s()
        answers, damaged = group.pieces(raw)
        for servo_id, answer in answers.items():
            self._take(servo_id, answer, readings, at_s)
        if len(answers) == len(group.ids):
            return len(answers)
        for servo_id in damaged:
            self._line.errors["corrupt"] += 1
            self._roll.damaged(servo_id, now_s)
        for servo_id in silent_ones(group.ids, answers.keys() | damaged):
            self._line.errors["timeout"] += 1
            self._roll.silent(servo_id, now_s)
        # What still comes must neither be taken for the next answer nor look like one.
        self._port.drain()
        self._span = (self._span + 1) % len(STARTS)
        return len(answers)

    def _take(
        self, servo_id: int, answer: Answer, readings: list[ServoReading | None], at_s: float
    ) -> None:
        """Take one servo's answer with its error byte; welcome one that had been out."""
        if self._roll.answered(servo_id) and self._care.engaged:
            self._care.check(servo_id)
        alert = bool(answer.error & ALERT)
        if alert:
            self._care.alert(servo_id)
        if answer.error & ERROR_NUMBER:
            self._line.errors["refused"] += 1
            return
        i = self._slot[servo_id]
        speed = answer.velocity * VELOCITY_UNIT_STEPS_S
        current = answer.current * self._units_ma[i]
        readings[i] = ServoReading(answer.position, speed, current, at_s, alert)

    def _clip(self, steps: Sequence[int]) -> tuple[int, ...]:
        """Keep goals inside the limits."""
        return tuple(
            [
                low if goal < low else high if goal > high else goal
                for goal, (low, high) in zip(steps, self._limits, strict=True)
            ]
        )
