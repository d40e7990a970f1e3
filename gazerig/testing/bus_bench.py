"""Test bench for servo buses: the emulated servos of one or several buses.

The kind of bus and the behaviour of its devices are data (``BusUnderTest``), so that the suites
run unchanged on buses of other packages.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

from gazerig.drivers.bus.multi_bus import BusShare, MultiBus
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import Feedback, ServoBus, ServoConfig
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.in_process_port import InProcessPort

T = TypeVar("T")


class Row(NamedTuple):
    """One servo's part of a ``Feedback``; the fields are its columns."""

    position_steps: float
    velocity_steps_s: float
    load: float
    at_s: float
    temperature_c: float | None
    voltage_v: float | None
    torque: bool
    fault: str
    measured: bool
    rearmed: bool


def rows(feedback: Feedback) -> tuple[Row | None, ...]:
    """Return one row per servo, None for a servo without a fresh answer."""
    every = zip(*feedback[:-1], strict=True)
    return tuple([None if i in feedback.missing else Row(*row) for i, row in enumerate(every)])


def feedback_of(given: list[Row | None]) -> Feedback:
    """Return the feedback that consists of these rows."""
    none = Feedback.create_missing(1)
    columns: Any = (column[0] for column in none[:-1])
    blank = Row(*columns)
    every: Any = zip(*[blank if row is None else row for row in given], strict=True)
    missing = tuple(i for i, row in enumerate(given) if row is None)
    return Feedback(*(*every, missing))


def are_healthy(readings: Sequence[Row | None]) -> bool:
    """Return whether all servos have answered with their torque on."""
    return all(row is not None and row.torque for row in readings)


def present(thing: T | None) -> T:
    """Return the argument; fail if it is None."""
    assert thing is not None
    return thing


TICK_S = 0.01
NAMES = ("eye", "jaw", "neck", "lid", "brow", "ear")
IDS = (3, 1, 11, 7)
PLACES = (0, 1, 2, 3)
SHARES = (0.4, 0.5, 0.65, 0.55)
"""Initial positions of the servos, as shares of their range."""
AWAY = (0.2, 0.8, 0.3, 0.7, 0.25, 0.75)
NEAR_SHARE = 0.012
"""Largest distance from the goal due to friction and dead bands, as a share of the range."""


class Absence(NamedTuple):
    """Commands that make a board absent and present again, and the bus's message (a pattern)."""

    begin: str
    end: str
    message_pattern: str


class Fault(NamedTuple):
    """A fault that a servo or board reports itself.

    command: starts it; ``{id}`` is replaced by the servo's id
    times: number of calls of the command, a third of a second apart
    cause_text: the text of the bus for it, after the servo's or board's name
    board: name in messages of a board with the fault; "": the fault is one servo's
    """

    command: str
    cause_text: str
    times: int = 1
    board: str = ""


@dataclass(frozen=True)
class BusUnderTest:
    """One kind of bus and its emulated devices.

    Attributes:
        name: name of the kind.
        model: model of its servos.
        low, high: their range in these tests, steps.
        speed_steps_s: their speed limit; the servos must be able to reach it.
        make: creates the bus from a port, configurations, whether the machine may stall for a long
            time (as with a pseudo-terminal), and the seconds without any answer after which it
            gives up.
        device: creates the emulated device from the servos' initial steps by id, and a clock. It
            understands the commands of ``gazerig.sim_mock.faults``: ``status``, ``unplug``,
            ``plug``, ``deny``, ``lose``, ``delay``, ``corrupt``, ``clear`` and ``brown-out``.
        board: servos are channels of a board that does not measure their positions; faults affect
            the whole board.
        grain_steps: largest rounding of a goal by a device that counts in coarser steps.
        fault: a fault that it reports; None: it reports none.
        absence: absence of a board; None: a servo with another id replaces an absent one.
        pulses_on: makes a board hold its servos before the test; receives the bench and the kind's
            name.
    """

    name: str
    model: str
    low: int
    high: int
    speed_steps_s: float
    make: Callable[[BusPort, Sequence[ServoConfig], bool, float], ServoBus]
    device: Callable[[Mapping[int, float], Callable[[], float]], Device]
    board: bool = False
    grain_steps: int = 0
    fault: Fault | None = None
    absence: Absence | None = None
    pulses_on: "Callable[[BusBench, str], None] | None" = None


class Wires(NamedTuple):
    """The other end of the ports: a clock, a function that waits, and fault commands."""

    ports: Mapping[str, BusPort]
    now_s: Callable[[], float]
    wait: Callable[[float], None]
    command: Callable[[str, str], str]


class BusBench:
    """The servos of one kind of bus, or of several mixed, and actions of a test on them.

    Positions and goals are shares of each servo's range, 0..1 within its limits.

    Args:
        kinds: kinds by name.
        places: indices of each kind's servos among all servos.
        wires: the other end of the ports.
        patient: the machine may stall for a long time.
    """

    def __init__(
        self,
        kinds: Mapping[str, BusUnderTest],
        places: Mapping[str, tuple[int, ...]],
        wires: Wires,
        patient: bool,
    ) -> None:
        self.kinds, self.wires, self._patient = kinds, wires, patient
        self.buses = places
        self.count = sum(map(len, self.buses.values()))
        found = {p: s for n in places for p, s in setups_of(kinds[n], places[n]).items()}
        self.setups = tuple(found[place] for place in range(self.count))
        self.on = {p: name for name, places in self.buses.items() for p in places}
        self.now_s, self.wait = wires.now_s, wires.wait

    def bus(self, setups: Sequence[ServoConfig] | None = None, give_up_s: float = 60.0) -> ServoBus:
        """Create the bus."""
        setups = setups or self.setups
        shares = [
            BusShare(name, self._one(name, [setups[p] for p in places], give_up_s), places)
            for name, places in self.buses.items()
        ]
        return MultiBus(shares) if len(shares) > 1 else shares[0].bus

    def _one(self, name: str, setups: Sequence[ServoConfig], give_up_s: float) -> ServoBus:
        return self.kinds[name].make(self.wires.ports[name], setups, self._patient, give_up_s)

    def is_board(self, place: int) -> bool:
        """Return whether a servo is a channel of a board."""
        return self.kinds[self.on[place]].board

    def smart_indices(self) -> list[int]:
        """Return the indices of servos that answer for themselves."""
        return [place for place in self.on if not self.is_board(place)]

    def start_shares(self) -> list[float]:
        """Return the initial positions, as shares."""
        return [SHARES[place % 4] for place in range(self.count)]

    def away_shares(self) -> tuple[float, ...]:
        """Return goals away from the initial positions."""
        return AWAY[: self.count]

    # --- shares and steps

    def steps(self, shares: Sequence[float]) -> list[int]:
        """Convert shares of the ranges to steps."""
        pairs = zip(self.setups, shares, strict=True)
        return [round(s.min_steps + x * (s.max_steps - s.min_steps)) for s, x in pairs]

    def shares(self, steps: Sequence[float | None]) -> list[float]:
        """Convert steps to shares; a missing value becomes a share far outside."""
        return [
            -9.0 if at is None else (at - s.min_steps) / (s.max_steps - s.min_steps)
            for s, at in zip(self.setups, steps, strict=True)
        ]

    def measured_shares(self, readings: Sequence[Row | None]) -> list[float]:
        """Return the positions in readings, as shares."""
        return self.shares([None if r is None else r.position_steps for r in readings])

    # --- the servos themselves, without the driver

    def command(self, text: str, name: str = "") -> None:
        """Run a fault command on one bus, or on all."""
        for one in [name] if name else self.buses:
            self.wires.command(text, one)

    def apply_fault(self, verb: str, place: int) -> None:
        """Apply a fault to one servo; a brown-out of a board affects all its channels."""
        name = self.on[place]
        board = self.kinds[name].board and verb == "brown-out"
        self.command(verb if board else f"{verb} {self.setups[place].id}", name)

    def reports(self) -> list[dict[str, Any]]:
        """Return the true status of all servos, in order of their indices."""
        by_bus = {}
        for name in self.buses:
            servos = json.loads(self.wires.command("status", name))["servos"]
            by_bus[name] = {one["id"]: one for one in servos}
        return [by_bus[self.on[p]][self.setups[p].id] for p in range(self.count)]

    def true_shares(self) -> list[float]:
        """Return the true positions, as shares."""
        return self.shares([one.get("place", one.get("position")) for one in self.reports()])

    def true_goals_steps(self) -> list[int | None]:
        """Return the true goals in steps, None for a servo without a goal."""
        found = [one.get("target", one.get("goal")) for one in self.reports()]
        return [goal or None for goal in found]

    def holding(self) -> list[bool]:
        """Return which servos truly hold their position."""
        return [bool(one.get("target", one.get("torque"))) for one in self.reports()]

    def pulses_on(self) -> None:
        """Let boards send pulses at their servos' positions; other servos measure theirs."""
        for name in self.buses:
            give = self.kinds[name].pulses_on
            if give is not None:
                give(self, name)

    # --- ticks

    def run(
        self, bus: ServoBus, seconds: float, goals: Sequence[float] | None = None
    ) -> tuple[Row | None, ...]:
        """Tick every 10 ms, with goals in shares; return the last readings."""
        steps = None if goals is None else self.steps(goals)
        end_s = self.now_s() + seconds - 1e-9
        while True:
            readings = rows(bus.read(self.now_s()))
            if steps is not None:
                bus.write(steps)
            if self.now_s() >= end_s:
                return readings
            self.wait(TICK_S)

    def run_until(
        self,
        bus: ServoBus,
        done: Callable[[tuple[Row | None, ...]], bool],
        goals: Sequence[float] | None = None,
        timeout_s: float = 8.0,
    ) -> tuple[Row | None, ...]:
        """Tick until a condition is true; return the readings at that time."""
        end_s = self.now_s() + timeout_s
        while self.now_s() < end_s:
            readings = self.run(bus, 0.0, goals)
            if done(readings):
                return readings
            self.wait(TICK_S)
        raise AssertionError(f"not in {timeout_s} s: {readings}, {bus.faults()}, {bus.events()}")

    def are_near(self, shares: Sequence[float], goals: Sequence[float]) -> bool:
        """Return whether all servos are near their goals."""
        return all(abs(x - goal) <= NEAR_SHARE for x, goal in zip(shares, goals, strict=True))


def setups_of(kind: BusUnderTest, places: Sequence[int]) -> dict[int, ServoConfig]:
    """Return the configurations of the servos of one bus by their index among all servos."""
    rest = (kind.low + kind.high) // 2 if kind.board else None
    return {
        place: ServoConfig(
            servo_id, kind.model, kind.low, kind.high, kind.speed_steps_s, NAMES[place],
            rest_steps=rest,
        )
        for place, servo_id in zip(places, IDS, strict=False)
    }  # fmt: skip


def starts_of(kind: BusUnderTest, places: Sequence[int]) -> dict[int, float]:
    """Return the initial positions of the servos of one bus by id, in steps."""
    setups = setups_of(kind, places)
    return {s.id: kind.low + SHARES[p % 4] * (kind.high - kind.low) for p, s in setups.items()}


class InProcessBench(NamedTuple):
    """A bench in this process, with its devices and all bytes that were sent to them."""

    bench: BusBench
    devices: Mapping[str, Device]
    sent: list[bytes]


def create_in_process_bench(
    kinds: Mapping[str, BusUnderTest], places: Mapping[str, tuple[int, ...]]
) -> InProcessBench:
    """Return a bench in this process, on a clock that advances only by waiting."""
    now = [50.0]

    def sleep_until(t_s: float) -> None:
        now[0] = max(now[0], t_s)

    def wait(seconds: float) -> None:
        now[0] += seconds

    sent: list[bytes] = []
    devices = {
        name: kinds[name].device(starts_of(kinds[name], places[name]), lambda: now[0])
        for name in places
    }
    ports = {
        name: InProcessPort(device, sent.append, f"emulated {name}", sleep_until)
        for name, device in devices.items()
    }

    def command(text: str, name: str) -> str:
        return devices[name].faults.command(text)

    wires = Wires(ports, lambda: now[0], wait, command)
    return InProcessBench(BusBench(kinds, places, wires, patient=False), devices, sent)


def held_bus(bench: BusBench) -> Iterator[ServoBus]:
    """Yield a bus that holds every servo in its position; release it afterwards."""
    bench.pulses_on()
    bus = bench.bus()
    bus.open()
    bus.enable_torque()
    bus.events()
    yield bus
    bus.disable_torque()
    bus.close()
