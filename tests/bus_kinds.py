"""Every kind of servo bus of ours over every twin, with the same few servos."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from gazerig.drivers.bus.servo_families import FAMILY_OF
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.feetech.params import FeetechParams
from gazerig.drivers.hobby_board.channel import Channel
from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.maestro.commands import MaestroCodec
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Bus, Pca9685Params
from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.servo_bus.params import BusParams
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
from gazerig.testing.bus_bench import (
    SHARES,
    Absence,
    BusBench,
    BusUnderTest,
    Fault,
    InProcessBench,
    Wires,
    starts_of,
)
from gazerig.testing.bus_bench import create_in_process_bench as bench_in_process

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
TWINS = ("in-process", "pty")
ON_EITHER = [(kind, twin) for kind in KINDS for twin in TWINS]
"""Each kind over both; a servo that another process emulates may answer late."""


def _patience(patient: bool, give_up_s: float) -> dict[str, Any]:
    # A shared machine may stall a process for longer than real servos ever wait.
    return {"give_up_s": give_up_s, **({"reply_timeout_ms": 200.0} if patient else {})}


def _smart(model: str) -> Callable[[BusPort, Sequence[ServoConfig], bool, float], ServoBus]:
    def make(
        port: BusPort, setups: Sequence[ServoConfig], patient: bool, give_up_s: float
    ) -> ServoBus:
        timeouts = _patience(patient, give_up_s)
        if patient:
            timeouts["prompt_timeout_ms"] = 200.0
        family = FAMILY_OF[model]
        params: BusParams = (
            DynamixelParams(**timeouts, watchdog_ms=0)
            if family.name == "dynamixel"
            else FeetechParams(**timeouts)
        )
        return SmartServoBus(family, port, setups, params)

    return make


def _maestro(
    port: BusPort, setups: Sequence[ServoConfig], patient: bool, give_up_s: float
) -> ServoBus:
    return MaestroBus(port, setups, MaestroParams(**_patience(patient, give_up_s), stagger_ms=0.0))


def _pca9685(
    port: BusPort, setups: Sequence[ServoConfig], patient: bool, give_up_s: float
) -> ServoBus:
    return Pca9685Bus(port, setups, Pca9685Params(**_patience(patient, give_up_s), stagger_ms=0.0))


def _maestro_pulses_on(bench: BusBench, name: str) -> None:
    port = bench.wires.ports[name]
    assert port.setBaudRate(115_200)
    targets = bench.steps([SHARES[p % 4] for p in range(bench.count)])
    codec = MaestroCodec("compact", 12, False, 12)
    for place in bench.buses[name]:
        port.write(codec.target(bench.setups[place].id, targets[place]))
    bench.wait(0.3)
    port.closePort()


def _pca9685_pulses_on(bench: BusBench, name: str) -> None:
    port = bench.wires.ports[name]
    board = Pca9685Board(port, Pca9685Params())
    assert port.setBaudRate(115_200)
    targets = bench.steps([SHARES[p % 4] for p in range(bench.count)])
    channels = [Channel(bench.setups[place]) for place in bench.buses[name]]
    for place, channel in zip(bench.buses[name], channels, strict=True):
        channel.start(targets[place], bench.now_s())
    assert board.send_limits(channels, confirmed=True)
    board.send_goals(channels)
    bench.wait(0.3)
    port.closePort()


def _line(name: str, starts: Mapping[int, float]) -> Emulated:
    if name == "pca9685":
        return Pca9685Line(servos=tuple(HobbySpec(c, x) for c, x in starts.items()))
    if name == "maestro":
        # The board's own ranges are as wide as such servos go.
        hobby = [HobbySpec(c, x, min_steps=2000, max_steps=10_000) for c, x in starts.items()]
        return MaestroLine(12, servos=tuple(hobby))
    specs = tuple(ServoSpec(i, OF[name].model, round(x)) for i, x in starts.items())
    return DynamixelLine(specs) if name == "dynamixel" else FeetechLine(specs)


def _device(name: str) -> Callable[[Mapping[int, float], Callable[[], float]], Device]:
    return lambda starts, now_s: build(_line(name, starts), now_s)


_OVERLOAD = Fault("overload {id}", "overload")
OF: dict[str, BusUnderTest] = {
    "dynamixel": BusUnderTest(
        "dynamixel", "xl330-m077", 1000, 3000, 4000.0, _smart("xl330-m077"), _device("dynamixel"),
        fault=_OVERLOAD,
    ),
    "feetech": BusUnderTest(
        "feetech", "sts3215", 1000, 3000, 3000.0, _smart("sts3215"), _device("feetech"),
        fault=_OVERLOAD,
    ),
    "scs": BusUnderTest(
        "scs", "scs0009", 200, 900, 1500.0, _smart("scs0009"), _device("scs"), fault=_OVERLOAD
    ),
    "maestro": BusUnderTest(
        "maestro", "hobby", 4400, 7600, 12_000.0, _maestro, _device("maestro"), board=True,
        fault=Fault("error protocol", "serial protocol error", board="board 12"),
        absence=Absence("set mode mute", "set mode usb-dual-port", "no Maestro answers"),
        pulses_on=_maestro_pulses_on,
    ),
    "pca9685": BusUnderTest(
        "pca9685", "hobby", 4400, 7600, 12_000.0, _pca9685, _device("pca9685"), board=True,
        # 4096 counts a period are 4.9 us each at 50 Hz.
        grain_steps=20,
        # It finds no errors; that it restarts again and again is a fault of its channels.
        fault=Fault("brown-out", "restarts again", times=4),
        absence=Absence("absent on", "absent off", "no PCA9685 answers at 0x40"),
        pulses_on=_pca9685_pulses_on,
    ),
}  # fmt: skip
"""Our kinds by the names of ``PLACES``."""


def in_process(kind: str) -> InProcessBench:
    """Make a kind's bench in this process, on a clock that waiting moves."""
    return bench_in_process(OF, PLACES[kind])


def line(kind: str, name: str) -> Emulated:
    """Return what is emulated on one bus of a kind."""
    return _line(name, starts_of(OF[name], PLACES[kind][name]))


@contextmanager
def twin_of(kind: str, place: str) -> Iterator[BusBench]:
    """Return a kind's servos ``in-process`` or behind a ``pty``."""
    if place == "in-process":
        yield in_process(kind).bench
        return
    with PtyBuses() as server:
        paths = server.start({name: line(kind, name) for name in PLACES[kind]})
        ports = {name: BlockingPort(path) for name, path in paths.items()}
        wires = Wires(ports, time.monotonic, time.sleep, server.command)
        try:
            yield BusBench(OF, PLACES[kind], wires, patient=True)
        finally:
            for port in ports.values():
                port.closePort()
