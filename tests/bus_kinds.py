"""Every kind of servo bus of ours, with the same few servos."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

from gazerig.drivers.bus.servo_families import FAMILY_OF
from gazerig.drivers.bus.timing import TIMING, BusTiming
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.maestro.commands import MaestroCodec
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Bus, Pca9685Params
from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.servo_bus.family import Family
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
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.testing.bus_suite import START, BusBench, BusUnderTest, create_bench

PATIENT_S = 0.2


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
    return MaestroBus(port, setups, MaestroParams(), _timing(False, give_up_s))


def _pca9685(port: BusPort, setups: Sequence[ServoConfig], give_up_s: float) -> ServoBus:
    return Pca9685Bus(port, setups, Pca9685Params(), _timing(False, give_up_s))


def _maestro_pulses_on(bench: BusBench) -> None:
    assert bench.port.setBaudRate(115_200)
    codec = MaestroCodec()
    for setup, target in zip(bench.setups, bench.steps(START), strict=True):
        bench.port.write(codec.target(setup.id, target))
    bench.wait(0.3)
    bench.port.closePort()


def _pca9685_pulses_on(bench: BusBench) -> None:
    board = Pca9685Board(bench.port, Pca9685Params())
    assert bench.port.setBaudRate(115_200)
    channels = [Channel(setup) for setup in bench.setups]
    for channel, target in zip(channels, bench.steps(START), strict=True):
        channel.start(target, bench.now_s())
    assert board.send_limits(channels, confirmed=True)
    board.send_goals(channels)
    bench.wait(0.3)
    bench.port.closePort()


def _line(name: str, starts: Mapping[int, float]) -> Emulated:
    if name == "pca9685":
        return Pca9685Line(servos=tuple(HobbySpec(c, x) for c, x in starts.items()))
    if name == "maestro":
        # The board's own ranges are as wide as such servos go.
        hobby = [HobbySpec(c, x, min_steps=2000, max_steps=10_000) for c, x in starts.items()]
        return MaestroLine(12, servos=tuple(hobby))
    specs = tuple(ServoSpec(i, _SMART[name][0], round(x)) for i, x in starts.items())
    return DynamixelLine(specs) if name == "dynamixel" else FeetechLine(specs)


def _device(name: str) -> Callable[[Mapping[int, float], Callable[[], float]], Device]:
    return lambda starts, now_s: build(_line(name, starts), now_s)


def _kind(name: str, patient: bool = False) -> BusUnderTest:
    device = _device(name)
    if name in _SMART:
        model, low, high, speed = _SMART[name]
        return BusUnderTest(model, low, high, speed, _smart(model, patient), device)
    make, pulses_on = _BOARDS[name]
    return BusUnderTest("hobby", 4400, 7600, 12_000.0, make, device, True, pulses_on)


_SMART = {
    "dynamixel": ("xl330-m077", 1000, 3000, 4000.0),
    "feetech": ("sts3215", 1000, 3000, 3000.0),
    "scs": ("scs0009", 200, 900, 1500.0),
}
"""Model, range and speed of smart servos."""
_BOARDS = {"maestro": (_maestro, _maestro_pulses_on), "pca9685": (_pca9685, _pca9685_pulses_on)}
KINDS = (*_SMART, *_BOARDS)


def in_process(name: str) -> BusBench:
    """Make a kind's bench in this process, on a clock that waiting moves."""
    return create_bench(_kind(name))


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
