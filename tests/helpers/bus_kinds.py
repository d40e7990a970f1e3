"""Every kind of servo bus of ours, with the same four servos; the only place that makes buses."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from math import inf, sin

import pytest

from gazerig.drivers.bus.servo_models import FAMILY_OF
from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.serial.port import TIMING, BlockingPort, BusPort, BusTiming
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.types import Feedback, ServoBus, ServoConfig
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
from gazerig.testing.bus_suite import START, BusBench, BusUnderTest

PATIENT_S = 0.2
TICK_S = 0.01
PULSE_S = 0.02


def _timing(patient: bool, give_up_s: float) -> BusTiming:
    # A shared machine may stall a process for longer than real servos ever wait.
    wait_s = PATIENT_S if patient else TIMING.reply_timeout_s
    return BusTiming(wait_s, give_up_s, stagger_s=0.0)


def patient_family(family: Family) -> Family:
    """Return a family whose servos neither answer at once nor stop when the host stalls."""
    return replace(family, prompt_timeout_s=PATIENT_S, watchdog_unit_s=None)


def _smart(
    model: str, patient: bool
) -> Callable[[BusPort, Sequence[ServoConfig], float], ServoBus]:
    def make(port: BusPort, setups: Sequence[ServoConfig], give_up_s: float) -> ServoBus:
        family = patient_family(FAMILY_OF[model]) if patient else FAMILY_OF[model]
        return SmartServoBus(family, port, setups, timing=_timing(patient, give_up_s))

    return make


def _maestro(port: BusPort, setups: Sequence[ServoConfig], give_up_s: float) -> ServoBus:
    return HobbyBoardBus(MaestroBoard(port, MaestroParams(), _timing(False, give_up_s)), setups)


def _pca9685(port: BusPort, setups: Sequence[ServoConfig], give_up_s: float) -> ServoBus:
    return HobbyBoardBus(Pca9685Board(port, Pca9685Params(), _timing(False, give_up_s)), setups)


def _pulses_on(bench: BusBench) -> None:
    """Have a board hold its servos where they are, as a run before has left it."""
    starts = zip(bench.setups, bench.steps(START), strict=True)
    bus = bench.bus([setup._replace(rest_steps=steps) for setup, steps in starts])
    bus.open()
    bus.enable_torque()
    bench.wait(0.3)
    bus.close()


def _line(name: str, starts: Mapping[int, float], odd: Mapping[int, int] | None = None) -> Emulated:
    if name == "pca9685":
        return Pca9685Line(servos=tuple(HobbySpec(c, x) for c, x in starts.items()))
    if name == "maestro":
        # The board's own ranges are as wide as such servos go.
        hobby = [HobbySpec(c, x, min_steps=2000, max_steps=10_000) for c, x in starts.items()]
        return MaestroLine(12, servos=tuple(hobby))
    firmware = OLD_FIRMWARE if name == "old dynamixel" else ServoSpec(1, "").firmware
    model = _SMART[name][0]
    versions = {**dict.fromkeys(starts, firmware), **(odd or {})}
    specs = tuple(ServoSpec(i, model, round(x), versions[i]) for i, x in starts.items())
    return FeetechLine(specs) if name in FEETECH else DynamixelLine(specs)


def _device(name: str) -> Callable[[Mapping[int, float], Callable[[], float]], Device]:
    return lambda starts, now_s: build(_line(name, starts), now_s)


def _kind(name: str, patient: bool = False) -> BusUnderTest:
    device = _device(name)
    if name in _SMART:
        model, low, high, speed = _SMART[name]
        return BusUnderTest(model, low, high, speed, _smart(model, patient), device)
    return BusUnderTest("hobby", 4400, 7600, 12_000.0, _BOARDS[name], device, True, _pulses_on)


OLD_FIRMWARE = 45
"""Without fast sync reads."""
_SMART = {
    "dynamixel": ("xl330-m077", 1000, 3000, 4000.0),
    "old dynamixel": ("xl330-m077", 1000, 3000, 4000.0),
    "feetech": ("sts3215", 1000, 3000, 3000.0),
    "scs": ("scs0009", 200, 900, 1500.0),
}
"""Model, range and speed of smart servos."""
_BOARDS = {"maestro": _maestro, "pca9685": _pca9685}
SMART, FEETECH, BOARDS = tuple(_SMART), ("feetech", "scs"), tuple(_BOARDS)
KINDS = (*SMART, *BOARDS)


POTENTIOMETER = 1023
"""Last step that an SCS servo measures."""


class WrongValueError(AssertionError):
    """A fresh position that the servo did not have during the read."""


@dataclass(frozen=True)
class Bench(BusBench):
    """The servos of a kind in this process, on a clock that waiting moves, and their truth.

    seen: true positions at each request of a read: a right answer has one of these
    plan: goals that move to and fro without a jump
    """

    name: str
    device: Device
    seen: list[list[float]]
    plan: list[float]

    def places(self) -> list[float]:
        """Return the true positions, as ``true_steps`` but quicker."""
        places = self.device.positions_steps()
        return [places[s.id if self.kind.board else i] for i, s in enumerate(self.setups)]

    def tick(self, bus: ServoBus, goals: Sequence[int] = (), follows: bool = True) -> Feedback:
        """Read and write once, servos in motion; every fresh value must be true in its read.

        follows: whether servos follow their pulses; without feedback a position is an estimate
        """
        self.seen[:] = [self.places()]
        began_s = self.now_s()
        feedback = bus.read(began_s)
        self.seen.append(self.places())
        board_room = 0.2 if follows else inf
        room = (board_room if self.kind.board else 0.003) * (self.kind.high - self.kind.low)
        for i, places in enumerate(zip(*self.seen, strict=True)):
            true = (
                [min(max(at, 0), POTENTIOMETER) for at in places] if self.name == "scs" else places
            )
            at = feedback.position_steps[i]
            if i not in feedback.missing and not min(true) - room <= at <= max(true) + room:
                raise WrongValueError(f"{began_s:.3f} s: servo {i} at {at}, truly {true}")
        bus.write(goals or self._planned(feedback))
        self.wait(TICK_S)
        return feedback

    def _planned(self, feedback: Feedback) -> list[int]:
        """Return goals that follow a sine below the speed limit, from where servos are rearmed."""
        kind = self.kind
        most = 0.8 * kind.speed_steps_s * TICK_S
        sweep = self.steps([0.5 + 0.3 * sin(3.5 * self.now_s() + i) for i in range(len(START))])
        for i, goal in enumerate(sweep):
            if feedback.rearmed[i]:
                self.plan[i] = min(max(feedback.position_steps[i], kind.low), kind.high)
            else:
                self.plan[i] += min(max(goal - self.plan[i], -most), most)
        return [round(goal) for goal in self.plan]

    def ticks(self, bus: ServoBus, seconds: float) -> list[Feedback]:
        """Tick for a while."""
        return [self.tick(bus) for _ in range(round(seconds / TICK_S))]

    def recovered(self, bus: ServoBus) -> Feedback:
        """Tick until all servos answer under torque again."""
        for _ in range(300):
            feedback = self.tick(bus)
            if not feedback.missing and all(feedback.torque):
                return feedback
        raise AssertionError(f"not in 3 s: {feedback}, {bus.faults()}, {bus.events()}")


def in_process(
    name: str, wire_time: bool = False, firmware: Mapping[int, int] | None = None
) -> Bench:
    """Make a kind's bench in this process.

    wire_time: bytes take their time at 1 Mbit/s; firmware: that of single smart servos, by id
    """
    kind, now = _kind(name), [50.0]

    def sleep_until(t_s: float) -> None:
        now[0] = max(now[0], t_s)

    device = build(_line(name, kind.starts_steps, firmware), lambda: now[0])

    def note(data: bytes) -> None:
        bench.seen.append(bench.places())

    port = InProcessPort(device, note, "the port under test", sleep_until, wire_time)
    wait: Callable[[float], None] = lambda s: sleep_until(now[0] + s)  # noqa: E731
    bench = Bench(kind, port, lambda: now[0], wait, device.faults.command, name, device, [], [])
    bench.plan[:] = bench.steps(START)
    return bench


LINE_FAULTS = ("lose {i}", "lose all", "delay {i} 8", "delay all 15", "truncate {i} 5",
               "corrupt {i}", "corrupt all", "unplug")  # fmt: skip
SERVO_FAULTS = ("brown-out {i}", "echo", "static 2", "overload {i}", "collide {i}", "stick {i}")
BOARD_FAULTS = ("brown-out", "lose-writes 5", "stick {i}")
END_OF = {"unplug": "plug", "stick {i}": "free {i}"}
"""Ends of faults that ``clear`` does not end."""


def faults_of(name: str) -> tuple[str, ...]:
    """Return the faults of a kind's line and of its servos; ``{i}`` is one of them."""
    return (*LINE_FAULTS, *(BOARD_FAULTS if name in BOARDS else SERVO_FAULTS))


class Struck:
    """A bus in motion, struck by faults; each tick checks goals, speeds and ranges.

    longest_s: the longest read; fallen: servos without torque, which nothing brakes, until they
        are inside their range again
    """

    def __init__(self, bench: Bench, victim: int) -> None:
        self.bench, self.victim = bench, victim
        self.bus = bench.hold()
        self.longest_s, self.count = 0.0, 0
        self.fallen: set[int] = set()
        bench.ticks(self.bus, 0.5)
        self.bus.events()
        self.before_s, self.before = bench.now_s(), bench.places()

    def tick(self, own_speed: bool) -> bool:
        """Tick and check the rules; return whether all servos follow their goals.

        own_speed: nothing restrains servos that were jammed, without supply or hit by noise
        """
        bench, kind, began_s = self.bench, self.bench.kind, self.bench.now_s()
        feedback = bench.tick(self.bus, follows=not own_speed)
        self.longest_s = max(self.longest_s, bench.now_s() - began_s - TICK_S)
        places, span = bench.seen[0], kind.high - kind.low
        # A hobby servo hears of its goal with each pulse.
        passed_s = max(began_s - self.before_s, PULSE_S if kind.board else 0.0)
        most = 1.3 * kind.speed_steps_s * passed_s + 0.01 * span
        outside = [not kind.low - 0.03 * span <= now <= kind.high + 0.03 * span for now in places]
        for i, (was, now) in enumerate(zip(self.before, places, strict=True)):
            assert own_speed or abs(now - was) <= most, f"servo {i}: {was} -> {now}"
        self.before_s, self.before, self.count = began_s, places, self.count + 1
        if self.count % 5 == 0 or any(outside):
            holding = bench.holding()
            for i, goal in enumerate(bench.true_goals_steps()):
                weak = own_speed and bench.name in FEETECH  # noise passes a check of one byte
                assert goal is None or weak or kind.low <= goal <= kind.high, f"{i} has goal {goal}"
                if not holding[i]:
                    self.fallen.add(i)
                elif not outside[i]:
                    self.fallen.discard(i)
                assert not outside[i] or i in self.fallen, f"servo {i} at {places[i]}"
        return (
            not feedback.missing
            and all(feedback.torque)
            and all(abs(a - b) < 0.1 * span for a, b in zip(places, bench.plan, strict=True))
        )

    def strike(self, faults: Sequence[str], seconds: float) -> bool:
        """Let faults last for a while; return whether all came back, or else check its name."""
        setup = self.bench.setups[self.victim]
        own_speed = any(word in text for text in faults for word in ("stick", "static"))
        for text in faults:
            self.bench.command(text.format(i=setup.id))
        for _ in range(round(seconds / TICK_S)):
            self.tick(own_speed)
        for text in (*(END_OF[text] for text in faults if text in END_OF), "clear"):
            self.bench.command(text.format(i=setup.id))
        well = 0
        for _ in range(800):
            well = well + 1 if self.tick(own_speed) else 0
            if well >= 10:
                return True
        lines = (*self.bus.events(), *self.bus.faults())
        assert any(f"{setup.name} (" in line for line in lines), lines
        return False


@contextmanager
def behind_a_terminal(name: str) -> Iterator[BusBench]:
    """Yield smart servos that another process emulates, and that may answer late."""
    kind = _kind(name, patient=True)
    with PtyBuses() as server:
        path = server.start({name: _line(name, kind.starts_steps)})[name]
        port = BlockingPort(path)
        try:
            command = partial(server.command, bus=name)
            yield BusBench(kind, port, time.monotonic, time.sleep, command)
        finally:
            port.closePort()


def every_kind(*without: str) -> pytest.MarkDecorator:
    """Run a test with the name of every kind, except of those without this promise."""
    return pytest.mark.parametrize("name", [name for name in KINDS if name not in without])
