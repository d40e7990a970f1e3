"""Clients on one bus of nine emulated servos: ours, and those that others wrote.

Each opens a path and yields a cycle: read all servos, write one goal to each, return how many
values came.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import partial
from typing import Literal

from dynamixel_sdk import GroupSyncRead, GroupSyncWrite, PacketHandler, PortHandler
from fakes.pty_bus import PtyBus
from rustypot import Sts3215PyController, Xl330PyController

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

IDS = tuple(range(1, 10))
BAUD: Literal[1_000_000] = 1_000_000
WAIT_S = 0.2
"""Time for which others wait for an answer: a busy host is no reason to lose values."""

Cycle = Callable[[int], int]
Open = Callable[[str], AbstractContextManager[Cycle]]


@contextmanager
def served(kind: str, client: Open) -> Iterator[Cycle]:
    """Open a client on a bus of its own, whose servos our driver has set up and answer at once."""
    line, model = (FeetechLine, "sts3215") if kind == "feetech" else (DynamixelLine, "xl330-m077")
    with PtyBus() as server:
        path = server.start_device(line(tuple(ServoSpec(i, model, 2048) for i in IDS), None))
        with ours(kind, path):
            pass
        with client(path) as cycle:
            yield cycle


@contextmanager
def ours(kind: str, path: str) -> Iterator[Cycle]:
    """Our driver, its torque on."""
    port = BlockingPort(path)
    model = "sts3215" if kind == "feetech" else "xl330-m077"
    setups = [ServoConfig(i, model, 1000, 3000, 3000.0, f"joint_{i}") for i in IDS]
    # While others have their turn it is silent for longer than Dynamixel servos bear.
    family = replace(FEETECH if kind == "feetech" else DYNAMIXEL, watchdog_unit_s=None)
    bus = SmartServoBus(family, port, setups, BAUD)
    bus.open()
    bus.enable_torque()

    def cycle(k: int) -> int:
        feedback = bus.read(time.monotonic())
        bus.write([2048 + k % 8] * len(IDS))
        return len(IDS) - len(feedback.missing)

    try:
        yield cycle
    finally:
        bus.disable_torque()
        bus.close()


@contextmanager
def robotis(path: str) -> Iterator[Cycle]:
    """ROBOTIS' SDK: fast sync read of 10 bytes, sync write."""
    port, packets = PortHandler(path), PacketHandler(2.0)
    port.setBaudRate(BAUD)  # opens it
    reads, writes = GroupSyncRead(port, packets, 126, 10), GroupSyncWrite(port, packets, 116, 4)
    for servo_id in IDS:
        reads.addParam(servo_id)

    def cycle(k: int) -> int:
        reads.fastSyncRead()
        writes.clearParam()
        for servo_id in IDS:
            writes.addParam(servo_id, (2048 + k % 8).to_bytes(4, "little"))
        writes.txPacket()
        return sum(reads.isAvailable(servo_id, 132, 4) for servo_id in IDS)

    try:
        yield cycle
    finally:
        port.closePort()


@contextmanager
def rustypot(kind: str, path: str) -> Iterator[Cycle]:
    """Open rustypot: its (fast) sync read of the position, sync write."""
    client: Sts3215PyController | Xl330PyController
    if kind == "feetech":
        client = Sts3215PyController(path, BAUD, WAIT_S)
    else:
        client = Xl330PyController(path, BAUD, WAIT_S)
        client.set_fast_sync_read(True)

    def cycle(k: int) -> int:
        try:
            values = len(client.sync_read_raw_present_position(list(IDS)))
        except (OSError, RuntimeError, ValueError):
            values = 0
        client.sync_write_raw_goal_position(list(IDS), [2048 + k % 8] * len(IDS))
        return values

    try:
        yield cycle
    finally:
        client.close()


CLIENTS: dict[str, dict[str, Open]] = {
    "dynamixel": {
        "ours": partial(ours, "dynamixel"),
        "rustypot": partial(rustypot, "dynamixel"),
        "ROBOTIS' SDK": robotis,
    },
    "feetech": {
        "ours": partial(ours, "feetech"),
        "rustypot": partial(rustypot, "feetech"),
    },
}
