"""Servo buses over a noisy emulated line: what they give as fresh, against the truth."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import pi, sin

from feedback_rows import Row, rows

from gazerig.drivers.bus.timing import BusTiming
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.errors import DriverError
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Bus, Pca9685Params
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import (
    DynamixelLine,
    Emulated,
    FeetechLine,
    MaestroLine,
    Pca9685Line,
    build,
)
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

TICK_S = 0.005
TIMING = BusTiming(stagger_s=0.0)
IDS = (1, 2, 3, 4, 5, 6)
KINDS = ("dynamixel", "dynamixel direct", "feetech", "maestro", "maestro crc", "pca9685")
BOARDS = ("maestro", "pca9685")
RANGES = {"dynamixel": (1000, 3000), "feetech": (1000, 3000), **dict.fromkeys(BOARDS, (4400, 7600))}
SPEED_STEPS_S = {"dynamixel": 4000.0, "feetech": 3000.0, **dict.fromkeys(BOARDS, 12_000.0)}
"""Armed in the servos or in the board, or kept by the driver."""

WRONG_STEPS = 6
"""A value given as fresh is wrong from so far off on: half a degree from where the joint was
while it was asked."""

OUTSIDE_STEPS = 30
"""A joint swings so far beyond its range by its own inertia where its servo stops it."""


@dataclass
class Outcome:
    """Result of a run.

    damaged: answers of servos, or of the board, that were spoilt or stayed out
    fresh: values given as measured; wrong: those that were not true; worst: by how many steps
    outside: ticks in which a joint was outside its range; farthest: by how many steps
    ended: a reason for which a run would have ended, "" without one
    recover_s: from the end of the noise to all servos fresh, under torque and near their goals
    fastest: largest speed of a joint as a multiple of what was armed
    """

    kind: str
    rate: float
    cycles: int = 0
    damaged: int = 0
    fresh: int = 0
    wrong: int = 0
    worst: float = 0.0
    outside: int = 0
    farthest: float = 0.0
    ended: str = ""
    recover_s: float | None = None
    fastest: float = 0.0
    said: list[str] = field(default_factory=list)
    errors: dict[str, int] = field(default_factory=dict)


class Noisy:
    """Six servos of one kind, the truth about them, and a line that faults strike."""

    def __init__(self, kind: str, seed: int = 1) -> None:
        self.kind = kind
        self._make = kind.split()[0]
        self.low, self.high = RANGES[self._make]
        self.now = 10.0
        self.device: Device = build(self._emulated(kind), lambda: self.now, seed)
        if kind == "maestro crc":
            self.device.choose_behaviour("crc", "on")
        self._seen: list[tuple[float, ...]] = []
        self._writes, self._strike = 0, None  # type: tuple[int, tuple[int, str] | None]
        self.port = InProcessPort(self.device, self._tap, "noisy line", self._sleep_until)
        self.bus = self._bus(kind)
        self._command: list[float] = []
        self._since, self._since_s = self.truth(), self.now
        self._runs = False

    def _sleep_until(self, t_s: float) -> None:
        self.now = max(self.now, t_s)

    def _tap(self, data: bytes) -> None:
        """Record the joints' positions at each request: an answer contains one of these."""
        self._seen.append(self.truth())
        self._writes += 1
        if self._strike is not None and self._writes == self._strike[0]:
            self.device.faults.command(self._strike[1])

    def strike(self, packet: int, fault: str) -> None:
        """Let a fault begin with the ``packet``-th packet from now on."""
        self._writes, self._strike = 0, (packet, fault)

    @property
    def struck(self) -> bool:
        """Return whether the fault of ``strike`` has begun."""
        return self._strike is not None and self._writes >= self._strike[0]

    def _emulated(self, kind: str) -> Emulated:
        middle = (self.low + self.high) // 2
        if self._make == "maestro":
            # The channels' own ranges are set as gazerig setup requires.
            specs = [HobbySpec(i, middle, min_steps=self.low, max_steps=self.high) for i in IDS]
            return MaestroLine(12, servos=tuple(specs))
        if self._make == "pca9685":
            return Pca9685Line(servos=tuple(HobbySpec(i, middle) for i in IDS))
        model = "sts3215" if self._make == "feetech" else "xl330-m077"
        # Servos without a common indirect block, one of which has no fast sync read.
        old = IDS[:1] if kind.endswith("direct") else ()
        servos = tuple(ServoSpec(i, model, middle, 45 if i in old else 53) for i in IDS)
        return FeetechLine(servos) if self._make == "feetech" else DynamixelLine(servos)

    def _bus(self, kind: str) -> ServoBus:
        model = {"dynamixel": "xl330-m077", "feetech": "sts3215"}.get(self._make, "hobby")
        rest = (self.low + self.high) // 2 if self._make in BOARDS else None
        speed = SPEED_STEPS_S[self._make]
        own = 22_000.0 if self._make in BOARDS else None
        setups = [
            ServoConfig(
                i,
                model,
                self.low,
                self.high,
                speed,
                f"joint_{i}",
                rest_steps=rest,
                own_speed_steps_s=own,
            )  # fmt: skip
            for i in IDS
        ]
        if self._make == "maestro":
            with_crc = MaestroParams(crc=kind.endswith("crc"))
            return MaestroBus(self.port, setups, with_crc, TIMING)
        if self._make == "pca9685":
            return Pca9685Bus(self.port, setups, Pca9685Params(), TIMING)
        family = FEETECH if self._make == "feetech" else DYNAMIXEL
        return SmartServoBus(family, self.port, setups)

    def truth(self) -> tuple[float, ...]:
        """Return the true positions of the joints."""
        places = self.device.positions_steps()
        if self._make in BOARDS:
            return tuple(places[i] for i in IDS)
        return places[: len(IDS)]  # without whoever has joined them

    def goals(self, t_s: float) -> list[int]:
        """Return goals that swing slower than the limits and reach the ends of the range."""
        half = 0.5 * (self.high - self.low)
        return [
            round(self.low + half * (1.0 + sin(2.0 * pi * 0.4 * t_s + 0.7 * i)))
            for i in range(len(IDS))
        ]

    def _led(self, readings: Sequence[Row | None], goals: Sequence[int]) -> list[int]:
        """Return goals like a guard's: from a recovered servo's position, no faster than armed."""
        most = SPEED_STEPS_S[self._make] * TICK_S
        for k, reading in enumerate(readings):
            if reading is not None and reading.rearmed:
                self._command[k] = min(max(reading.position_steps, self.low), self.high)
            elif reading is not None:
                self._command[k] += min(max(goals[k] - self._command[k], -most), most)
        return [round(command) for command in self._command]

    def enable_torque(self) -> None:
        """Switch torque on, and plan from there."""
        self._command = [float(goal) for goal in self.bus.enable_torque()]

    def start(self) -> None:
        """Open the bus, switch torque on and move all joints to their first goals."""
        self.bus.open()
        self.enable_torque()
        self.bus.events()
        for _ in range(200):
            self._tick(None)
        assert self._runs, f"{self.kind} does not run before the fault"

    def run(self, fault: str, rate: float, cycles: int, timeout_s: float = 20.0) -> Outcome:
        """Tick with a fault of the line, then without it until all is well again."""
        outcome = Outcome(self.kind, rate)
        self.device.faults.command(fault)
        try:
            for _ in range(cycles):
                self._tick(outcome)
                outcome.cycles += 1
                if outcome.ended:
                    break
        except DriverError as error:
            outcome.ended = str(error)
        before = dict(self.bus.health().errors)
        outcome.errors = before
        self.device.faults.command("clear")
        outcome.recover_s = self._recover(timeout_s)
        return outcome

    def _tick(self, outcome: Outcome | None) -> None:
        began = self.now
        self._seen.clear()
        readings = rows(self.bus.read(self.now))
        if outcome is not None:
            self._judge(outcome, readings)
        self.bus.write(self._led(readings, self.goals(self.now)))
        self.now = max(self.now, began + TICK_S)
        if outcome is not None:
            outcome.said += self.bus.events()
        if self.now - self._since_s >= 2.0 * TICK_S - 1e-9:  # in steps of which boards count
            truth = self.truth()
            ways = [abs(b - a) for a, b in zip(self._since, truth, strict=True)]
            way = max(ways)
            on = all(one is not None and one.torque and not one.fault for one in readings)
            self._runs = on and sum(ways) > 0.0
            if outcome is not None:
                speed = way / (self.now - self._since_s) / SPEED_STEPS_S[self._make]
                outcome.fastest = max(outcome.fastest, speed)
            self._since, self._since_s = truth, self.now

    def _judge(self, outcome: Outcome, readings: Sequence[Row | None]) -> None:
        for k, (reading, place) in enumerate(zip(readings, self.truth(), strict=True)):
            beyond = max(self.low - place, place - self.high)
            outcome.farthest = max(outcome.farthest, beyond)
            outcome.outside += beyond > OUTSIDE_STEPS
            if reading is None:
                outcome.damaged += 1
                continue
            if reading.fault and not outcome.ended:
                outcome.ended = reading.fault
            if not reading.measured:
                continue
            outcome.fresh += 1
            places = [seen[k] for seen in self._seen]
            at = reading.position_steps
            off = max(min(places) - at, at - max(places))
            outcome.worst = max(outcome.worst, off)
            outcome.wrong += off > WRONG_STEPS

    def _recover(self, timeout_s: float) -> float | None:
        """Tick until every servo is fresh, near its goal and powered."""
        began = self.now
        while self.now - began < timeout_s:
            tick = self.now
            try:
                readings = rows(self.bus.read(self.now))
                self.bus.write(self._led(readings, self.goals(began)))
            except DriverError:
                return None
            self.now = max(self.now, tick + TICK_S)
            goals, truth = self.goals(began), self.truth()
            near = all(abs(g - p) < 60 for g, p in zip(goals, truth, strict=True))
            if near and all(r is not None and r.torque and not r.fault for r in readings):
                return self.now - began
        return None
