"""A bench for servo buses: emulated servos of one bus or several, and what a test does with them.

What a kind of bus is and how its devices behave is data (``BusUnderTest``), so that the suites
run unchanged on buses of other packages.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from gazerig.drivers.bus.multi_bus import BusShare, MultiBus
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.testing.rows import Row, rows

TICK_S = 0.01
NAMES = ("eye", "jaw", "neck", "lid", "brow", "ear")
IDS = (3, 1, 11, 7)
PLACES = (0, 1, 2, 3)
SHARES = (0.4, 0.5, 0.65, 0.55)
"""Where servos stand at first, as a share of their range."""
AWAY = (0.2, 0.8, 0.3, 0.7, 0.25, 0.75)
NEAR_SHARE = 0.012
"""Friction and dead bands leave a servo so far from its goal at most, in shares of its range."""


class Absence(NamedTuple):
    """How a board is made to be absent and present again, and what its bus says (a pattern)."""

    begin: str
    end: str
    told: str


class Fault(NamedTuple):
    """A fault that a servo or board reports itself.

    command: begins it; ``{id}`` is the servo's; ``times``: so often, a third of a second apart
    cause: what the bus calls it, behind the servo's or board's name
    board: how messages name a board that has it; "": it is one servo's
    """

    command: str
    cause: str
    times: int = 1
    board: str = ""


@dataclass(frozen=True)
class BusUnderTest:
    """One kind of bus and its emulated devices.

    Attributes:
        name: of the kind.
        model: of its servos.
        low, high: their range in these tests, steps.
        speed_steps_s: their speed limit; the servos must be able to go as fast.
        make: the bus, of a port, configurations, whether the machine may stall for long (as with
            a pseudo-terminal), and after how many seconds without any answer it gives up.
        device: the emulated device, of the steps at which servos stand by their ids, and a clock.
            It understands the commands of ``gazerig.sim_mock.faults``: ``status``, ``unplug``,
            ``plug``, ``deny``, ``lose``, ``delay``, ``corrupt``, ``clear`` and ``brown-out``.
        board: servos are channels of a board, which do not tell where they are; what befalls the
            board befalls all.
        grain_steps: a goal is that far off at most where the device counts in coarser steps.
        fault: a fault that it reports; None: it reports none.
        absence: of a board; None: a servo with another id stands for an absent one.
        pulses_on: makes a board hold its servos already, of the bench and the kind's name.
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
    """What is at the other end of the ports: a clock, a way to wait, and faults as commands."""

    ports: Mapping[str, BusPort]
    now_s: Callable[[], float]
    wait: Callable[[float], None]
    command: Callable[[str, str], str]


class BusBench:
    """Servos of one kind of bus, or of several mixed, and what a test does with them.

    Places, goals and truths are shares of each servo's range, 0..1 within its limits.

    Args:
        kinds: by name.
        places: of the servos of each kind in the whole.
        wires: what is at the other end.
        patient: the machine may stall for long.
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
        """Make the bus."""
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

    def smart(self) -> list[int]:
        """Return the places of servos that answer for themselves."""
        return [place for place in self.on if not self.is_board(place)]

    def starts(self) -> list[float]:
        """Return where servos stand at first."""
        return [SHARES[place % 4] for place in range(self.count)]

    def away(self) -> tuple[float, ...]:
        """Return goals elsewhere."""
        return AWAY[: self.count]

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
        board = self.kinds[name].board and verb == "brown-out"
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
        for name in self.buses:
            give = self.kinds[name].pulses_on
            if give is not None:
                give(self, name)

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
        timeout_s: float = 8.0,
    ) -> tuple[Row | None, ...]:
        """Tick until something is so; gives the readings then."""
        end_s = self.now_s() + timeout_s
        while self.now_s() < end_s:
            readings = self.run(bus, 0.0, goals)
            if done(readings):
                return readings
            self.wait(TICK_S)
        raise AssertionError(f"not in {timeout_s} s: {readings}, {bus.faults()}, {bus.events()}")

    def near(self, shares: Sequence[float], goals: Sequence[float]) -> bool:
        """Return whether all are where they should be."""
        return all(abs(x - goal) <= NEAR_SHARE for x, goal in zip(shares, goals, strict=True))


def setups_of(kind: BusUnderTest, places: Sequence[int]) -> dict[int, ServoConfig]:
    """Return the configurations of one bus by their place in the whole."""
    rest = (kind.low + kind.high) // 2 if kind.board else None
    return {
        place: ServoConfig(
            servo_id, kind.model, kind.low, kind.high, kind.speed_steps_s, NAMES[place],
            rest_steps=rest,
        )
        for place, servo_id in zip(places, IDS, strict=False)
    }  # fmt: skip


def starts_of(kind: BusUnderTest, places: Sequence[int]) -> dict[int, float]:
    """Return where the servos of one bus stand at first, in steps, by their ids."""
    setups = setups_of(kind, places)
    return {s.id: kind.low + SHARES[p % 4] * (kind.high - kind.low) for p, s in setups.items()}


class InProcess(NamedTuple):
    """A bench in this process, with the devices behind it and all that was sent to them."""

    bench: BusBench
    devices: Mapping[str, Device]
    sent: list[bytes]


def in_process(
    kinds: Mapping[str, BusUnderTest], places: Mapping[str, tuple[int, ...]]
) -> InProcess:
    """Return a bench in this process, on a clock that waiting moves."""
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
    return InProcess(BusBench(kinds, places, wires, patient=False), devices, sent)


def holding(bench: BusBench) -> Iterator[ServoBus]:
    """Yield a bus that holds every servo where it stands; it is released after."""
    bench.pulses_on()
    bus = bench.bus()
    bus.open()
    bus.enable_torque()
    bus.events()
    yield bus
    bus.disable_torque()
    bus.close()
