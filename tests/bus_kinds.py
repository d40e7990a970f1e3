"""Every kind of servo bus over every twin, with the same few servos, behind the same handles."""

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from servo_rows import Row, rows

from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.feetech.params import FeetechParams
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.maestro.bus import MaestroBus, MaestroParams
from gazerig.drivers.maestro.commands import MaestroCodec
from gazerig.drivers.multi_bus import BusShare, MultiBus
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.bus import Pca9685Bus, Pca9685Params
from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.servo_bus.params import BusParams
from gazerig.drivers.servo_families import FAMILY_OF
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
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.smart_servo.physics import ServoSpec

TICK_S = 0.01
NAMES = ("eye", "jaw", "neck", "lid", "brow", "ear")
PLACES: dict[str, dict[str, tuple[int, ...]]] = {
    "dynamixel": {"dynamixel": (0, 1, 2, 3)},
    "feetech": {"feetech": (0, 1, 2, 3)},
    "scs": {"scs": (0, 1, 2, 3)},
    "maestro": {"maestro": (0, 1, 2, 3)},
    "pca9685": {"pca9685": (0, 1, 2, 3)},
    # Neighbours are on different buses, so that a mistaken place shows.
    "mixed": {"dynamixel": (0, 3), "feetech": (1, 4), "maestro": (2, 5)},
}
"""Kind -> the buses that it is made of -> the places of their servos in the whole."""
KINDS = tuple(PLACES)
IDS = (3, 1, 11, 7)
SHARES = (0.4, 0.5, 0.65, 0.55)
"""Where servos stand at first, as a share of their range."""
SPEED_STEPS_S = {
    "dynamixel": 4000.0,
    "feetech": 3000.0,
    "scs": 1500.0,
    "maestro": 12_000.0,
    "pca9685": 12_000.0,
}
RANGES = {
    "dynamixel": (1000, 3000),
    "feetech": (1000, 3000),
    "scs": (200, 900),
    "maestro": (4400, 7600),
    "pca9685": (4400, 7600),
}
MODELS = {
    "dynamixel": "xl330-m077",
    "feetech": "sts3215",
    "scs": "scs0009",
    "maestro": "hobby",
    "pca9685": "hobby",
}
BOARDS = ("maestro", "pca9685")
"""Kinds of which nobody measures a servo, and whose board answers for all."""
GRAIN_STEPS = {"pca9685": 20}
"""4096 counts a period are 4.9 us each at 50 Hz."""
NEAR_SHARE = 0.012
"""Friction and dead bands leave a servo so far from its goal at most, in shares of its range."""


class Wires(NamedTuple):
    """What is at the other end of the ports: a clock, a way to wait, and faults as commands."""

    ports: Mapping[str, BusPort]
    now_s: Callable[[], float]
    wait: Callable[[float], None]
    command: Callable[[str, str], str]


class Twin:
    """Servos of one kind of bus, or of all mixed, and what a test wants to do with them.

    Places, goals and truths are shares of each servo's range, 0..1 within its limits.
    """

    def __init__(self, kind: str, wires: Wires, patient: bool) -> None:
        self.kind, self.wires, self._patient = kind, wires, patient
        self.buses = PLACES[kind]
        self.count = sum(map(len, self.buses.values()))
        found = {p: s for name in self.buses for p, s in _setups(kind, name).items()}
        self.setups = tuple(found[place] for place in range(self.count))
        self.on = {p: name for name, places in self.buses.items() for p in places}
        self.now_s, self.wait = wires.now_s, wires.wait

    def bus(self, setups: Sequence[ServoConfig] | None = None, give_up_s: float = 60.0) -> ServoBus:
        """Make the bus."""
        setups = setups or self.setups
        shares = [
            BusShare(name, self._one(name, [setups[p] for p in places], give_up_s), places)
            for name, places in self.buses.items()
        ]
        return MultiBus(shares) if len(shares) > 1 else shares[0].bus

    def _one(self, name: str, setups: Sequence[ServoConfig], give_up_s: float) -> ServoBus:
        port = self.wires.ports[name]
        # A shared machine may stall a process for longer than real servos ever wait.
        patience: dict[str, Any] = {"reply_timeout_ms": 200.0} if self._patient else {}
        quick: dict[str, Any] = {"stagger_ms": 0.0, "give_up_s": give_up_s}
        if name == "maestro":
            return MaestroBus(port, setups, MaestroParams(**patience, **quick))
        if name == "pca9685":
            return Pca9685Bus(port, setups, Pca9685Params(**patience, **quick))
        if self._patient:
            patience["prompt_timeout_ms"] = 200.0
        params: BusParams = DynamixelParams(**patience, watchdog_ms=0, give_up_s=give_up_s)
        if name != "dynamixel":
            params = FeetechParams(**patience, give_up_s=give_up_s)
        return SmartServoBus(FAMILY_OF[MODELS[name]], port, setups, params)

    # --- shares and steps

    def steps(self, shares: Sequence[float]) -> list[int]:
        """Return steps of shares."""
        pairs = zip(self.setups, shares, strict=True)
        return [round(s.min_steps + x * (s.max_steps - s.min_steps)) for s, x in pairs]

    def shares(self, steps: Sequence[float | None]) -> list[float]:
        """Return shares of steps; far outside where there is none."""
        return [
            -9.0 if at is None else (at - s.min_steps) / (s.max_steps - s.min_steps)
            for s, at in zip(self.setups, steps, strict=True)
        ]

    def seen(self, readings: Sequence[Row | None]) -> list[float]:
        """Return the shares that readings tell."""
        return self.shares([None if r is None else r.position_steps for r in readings])

    # --- the servos themselves, past the driver

    def command(self, text: str, name: str = "") -> None:
        """Carry out a fault on one bus, or on all."""
        for one in [name] if name else self.buses:
            self.wires.command(text, one)

    def strike(self, verb: str, place: int) -> None:
        """Let something befall one servo; on a Maestro what befalls the board befalls all."""
        name = self.on[place]
        board = name in BOARDS and verb == "brown-out"
        self.command(verb if board else f"{verb} {self.setups[place].id}", name)

    def reports(self) -> list[dict[str, Any]]:
        """Return what servos truly are, in the order of the whole."""
        by_bus = {}
        for name in self.buses:
            servos = json.loads(self.wires.command("status", name))["servos"]
            by_bus[name] = {one["id"]: one for one in servos}
        return [by_bus[self.on[p]][self.setups[p].id] for p in range(self.count)]

    def truth(self) -> list[float]:
        """Return where servos truly are."""
        return self.shares([one.get("place", one.get("position")) for one in self.reports()])

    def goals(self) -> list[int | None]:
        """Return the goals that servos truly have, in steps; None where there is none."""
        found = [one.get("target", one.get("goal")) for one in self.reports()]
        return [goal or None for goal in found]

    def holding(self) -> list[bool]:
        """Return which servos truly hold their place."""
        return [bool(one.get("target", one.get("torque"))) for one in self.reports()]

    def pulses_on(self) -> None:
        """Let boards give pulses already, where their servos stand; others know their place."""
        if "pca9685" in self.buses:
            self._pca9685_pulses_on()
        if "maestro" not in self.buses:
            return
        port = self.wires.ports["maestro"]
        assert port.setBaudRate(115_200)
        targets = self.steps([SHARES[p % 4] for p in range(self.count)])
        speech = MaestroCodec("compact", 12, False, 12)
        for place in self.buses["maestro"]:
            port.write(speech.target(self.setups[place].id, targets[place]))
        self.wait(0.3)
        port.closePort()

    def _pca9685_pulses_on(self) -> None:
        port = self.wires.ports["pca9685"]
        board = Pca9685Board(port, Pca9685Params())
        assert port.setBaudRate(115_200)
        targets = self.steps([SHARES[p % 4] for p in range(self.count)])
        channels = [Channel(self.setups[place]) for place in self.buses["pca9685"]]
        for place, channel in zip(self.buses["pca9685"], channels, strict=True):
            channel.start(targets[place], self.now_s())
        assert board.send_limits(channels, confirmed=True)
        board.send_goals(channels)
        self.wait(0.3)
        port.closePort()

    # --- ticks

    def run(
        self, bus: ServoBus, seconds: float, goals: Sequence[float] | None = None
    ) -> tuple[Row | None, ...]:
        """Tick every 10 ms, with goals in shares; gives the last readings."""
        steps = None if goals is None else self.steps(goals)
        end_s = self.now_s() + seconds - 1e-9
        while True:
            readings = rows(bus.read(self.now_s()))
            if steps is not None:
                bus.write(steps)
            if self.now_s() >= end_s:
                return readings
            self.wait(TICK_S)

    def until(
        self,
        bus: ServoBus,
        done: Callable[[tuple[Row | None, ...]], bool],
        goals: Sequence[float] | None = None,
        patience_s: float = 8.0,
    ) -> tuple[Row | None, ...]:
        """Tick until something is so; gives the readings then."""
        end_s = self.now_s() + patience_s
        while self.now_s() < end_s:
            readings = self.run(bus, 0.0, goals)
            if done(readings):
                return readings
            self.wait(TICK_S)
        raise AssertionError(f"not in {patience_s} s: {readings}, {bus.faults()}, {bus.events()}")

    def near(self, shares: Sequence[float], goals: Sequence[float]) -> bool:
        """Return whether all are where they should be."""
        return all(abs(x - goal) <= NEAR_SHARE for x, goal in zip(shares, goals, strict=True))


def _setups(kind: str, name: str) -> dict[int, ServoConfig]:
    """Return the setups of one bus by their place in the whole."""
    model = MODELS[name]
    low, high = RANGES[name]
    rest = (low + high) // 2 if name in BOARDS else None
    return {
        place: ServoConfig(
            servo_id, model, low, high, SPEED_STEPS_S[name], NAMES[place], rest_steps=rest
        )
        for place, servo_id in zip(PLACES[kind][name], IDS, strict=False)
    }


def line(kind: str, name: str) -> Emulated:
    """Return what is emulated on one bus of a kind."""
    low, high = RANGES[name]
    starts = {
        s.id: low + SHARES[place % 4] * (high - low) for place, s in _setups(kind, name).items()
    }
    if name == "pca9685":
        return Pca9685Line(servos=tuple(HobbySpec(c, x) for c, x in starts.items()))
    if name == "maestro":
        # The board's own ranges are as wide as such servos go.
        hobby = [HobbySpec(c, x, min_steps=2000, max_steps=10_000) for c, x in starts.items()]
        return MaestroLine(12, servos=tuple(hobby))
    specs = tuple(ServoSpec(i, MODELS[name], round(x)) for i, x in starts.items())
    return DynamixelLine(specs) if name == "dynamixel" else FeetechLine(specs)


class InProcess(NamedTuple):
    """Wires in this process, with the devices behind them and all that was sent to them."""

    wires: Wires
    devices: Mapping[str, Device]
    sent: list[bytes]


def in_process(kind: str) -> InProcess:
    """Make a kind's wires in this process, on a clock that waiting moves."""
    now = [50.0]

    def sleep_until(t_s: float) -> None:
        now[0] = max(now[0], t_s)

    def wait(seconds: float) -> None:
        now[0] += seconds

    sent: list[bytes] = []
    devices = {name: build(line(kind, name), lambda: now[0]) for name in PLACES[kind]}
    ports = {
        name: InProcessPort(device, sent.append, f"emulated {name}", sleep_until)
        for name, device in devices.items()
    }

    def command(text: str, name: str) -> str:
        return devices[name].faults.command(text)

    return InProcess(Wires(ports, lambda: now[0], wait, command), devices, sent)


@contextmanager
def twin_of(kind: str, place: str) -> Iterator[Twin]:
    """Return a kind's servos ``in-process`` or behind a ``pty``."""
    if place == "in-process":
        yield Twin(kind, in_process(kind).wires, patient=False)
        return
    with PtyBuses() as server:
        paths = server.start({name: line(kind, name) for name in PLACES[kind]})
        ports = {name: BlockingPort(path) for name, path in paths.items()}
        wires = Wires(ports, time.monotonic, time.sleep, server.command)
        try:
            yield Twin(kind, wires, patient=True)
        finally:
            for port in ports.values():
                port.closePort()
