"""The clients that benchmarks compare on one bus: ours, a bare one, and those that others wrote.

Each opens a path at a baud rate and gives a cycle: read all servos, write one goal a servo,
return how many values came. All servos are set up already and answer at once.
"""

import os
import select
import struct
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import NamedTuple

from dynamixel_sdk import GroupSyncRead, GroupSyncWrite, PacketHandler, PortHandler
from fastcrc.crc16 import umts
from rustypot import Sts3215PyController, Xl330PyController
from serial import Serial

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.dynamixel.protocol import sync_read as dynamixel_read
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.feetech.params import FeetechParams
from gazerig.drivers.feetech.protocol import sync_read as feetech_read
from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoBus, ServoConfig

IDS = tuple(range(1, 10))
MODELS = {"dynamixel": "xl330-m077", "feetech": "sts3215"}
WAIT_S = 0.2
"""So long others wait for an answer: no client is to lose values because the host is busy."""

Cycle = Callable[[int], int]
"""Takes a number, from which goals are made; returns how many values came."""


class Client(NamedTuple):
    """One that cycles: what it reads of each servo, and how it is opened."""

    name: str
    reads: str
    opened: Callable[[str, int], AbstractContextManager[Cycle]]


def driver(
    kind: str, port: BusPort, baud: int, ids: Sequence[int] = IDS, **chosen: object
) -> SmartServoBus:
    """Make our driver of one bus."""
    setups = [ServoConfig(i, MODELS[kind], 1000, 3000, 3000.0, f"joint_{i}") for i in ids]
    if kind == "dynamixel":
        # While others have their turn it is silent for longer than servos bear.
        params = DynamixelParams(baud=baud, watchdog_ms=0, **chosen)  # type: ignore[arg-type]
        return SmartServoBus(DYNAMIXEL, port, setups, params)
    return SmartServoBus(FEETECH, port, setups, FeetechParams(baud=baud))


def ours(kind: str, path: str, baud: int, **chosen: object) -> AbstractContextManager[Cycle]:
    """Return our driver, its torque on."""
    bus = driver(kind, BlockingPort(path), baud, **chosen)  # type: ignore[arg-type]
    return driven(bus, [2048] * len(IDS), time.monotonic)


@contextmanager
def driven(bus: ServoBus, goals: Sequence[int], now_s: Callable[[], float]) -> Iterator[Cycle]:
    """Cycle with a driver of ours around these goals, torque on."""
    bus.open()
    bus.enable_torque()

    def cycle(k: int) -> int:
        feedback = bus.read(now_s())
        bus.write([goal + k % 8 for goal in goals])
        return len(goals) - len(feedback.missing)

    try:
        yield cycle
    finally:
        bus.disable_torque()
        bus.close()


@contextmanager
def bare_dynamixel(path: str, baud: int) -> Iterator[Cycle]:
    """Select and read, goals and request in one write, every CRC checked: the least there is."""
    serial = Serial(path, baud, timeout=0)
    fd, count = serial.fileno(), len(IDS)
    request = dynamixel_read(IDS, 126, 10, fast=True)
    goals = struct.Struct("<4sBHBHH" + "BI" * count)
    layout = struct.Struct("<8s" + "BBhiiH" * count)
    crc_of = struct.Struct("<H").pack
    row = [number for servo_id in IDS for number in (servo_id, 0)]
    ends = [8 + 14 * (k + 1) - 2 for k in range(count)]
    parts = [slice(start, end) for start, end in zip([0, *ends[:-1]], ends, strict=True)]

    def cycle(k: int) -> int:
        row[1::2] = [2048 + k % 8] * count
        packet = goals.pack(b"\xff\xff\xfd\x00", 254, 7 + 5 * count, 0x83, 116, 4, *row)
        os.write(fd, packet + crc_of(umts(packet)) + request)
        raw = _gathered(fd, layout.size)
        if len(raw) < layout.size:
            return 0
        values, crc = layout.unpack(raw), 0
        for part, sent in zip(parts, values[6::6], strict=True):
            crc = umts(raw[part], crc)
            if crc != sent:
                return 0
        return count if values[2::6] == IDS and not any(values[1::6]) else 0

    try:
        yield cycle
    finally:
        serial.close()


@contextmanager
def bare_feetech(path: str, baud: int) -> Iterator[Cycle]:
    """Select and read, goals and request in one write, every check sum: the least there is."""
    serial = Serial(path, baud, timeout=0)
    fd, count = serial.fileno(), len(IDS)
    request = feetech_read(IDS, 56, 15)
    goals = struct.Struct("<5B" + "BHHH" * count)
    layout = struct.Struct("<" + "4sBHHHBB5xHB" * count)
    row = [number for servo_id in IDS for number in (servo_id, 0, 0, 500)]
    heads = tuple(bytes((255, 255, servo_id, 17)) for servo_id in IDS)
    parts = [slice(21 * k + 2, 21 * k + 21) for k in range(count)]

    def cycle(k: int) -> int:
        row[1::4] = [2048 + k % 8] * count
        body = goals.pack(254, 4 + 7 * count, 0x83, 42, 6, *row)
        os.write(fd, b"\xff\xff" + body + bytes((~sum(body) & 255,)) + request)
        raw = _gathered(fd, layout.size)
        if len(raw) < layout.size:
            return 0
        values = layout.unpack(raw)
        for part in parts:
            if sum(raw[part]) & 255 != 255:
                return 0
        return count if values[0::9] == heads and not any(values[1::9]) else 0

    try:
        yield cycle
    finally:
        serial.close()


def _gathered(fd: int, length: int) -> bytes:
    """Return this many bytes, or those that came in time."""
    got, fds = b"", (fd,)
    while len(got) < length and select.select(fds, (), (), WAIT_S)[0]:
        got += os.read(fd, length - len(got))
    return got


@contextmanager
def robotis(port: str | BusPort, baud: int, ids: Sequence[int] = IDS) -> Iterator[Cycle]:
    """ROBOTIS' SDK: fast sync read of 10 bytes, sync write."""
    port, packets = PortHandler(port) if isinstance(port, str) else port, PacketHandler(2.0)
    port.setBaudRate(baud)  # opens it
    reads, writes = GroupSyncRead(port, packets, 126, 10), GroupSyncWrite(port, packets, 116, 4)
    for servo_id in ids:
        reads.addParam(servo_id)

    def cycle(k: int) -> int:
        reads.fastSyncRead()
        values = [reads.getData(i, 132, 4) for i in ids if reads.isAvailable(i, 132, 4)]
        writes.clearParam()
        for servo_id in ids:
            writes.addParam(servo_id, (2048 + k % 8).to_bytes(4, "little"))
        writes.txPacket()
        return len(values)

    try:
        yield cycle
    finally:
        port.closePort()


@contextmanager
def rustypot_halves(
    kind: str, path: str, baud: int, wait_s: float = WAIT_S, servo_ids: Sequence[int] = IDS
) -> Iterator[tuple[Cycle, Cycle]]:
    """Open rustypot: its (fast) sync read of the position, as it reads one register; sync write."""
    client: Sts3215PyController | Xl330PyController
    if kind == "feetech":
        client = Sts3215PyController(path, baud, wait_s)
    else:
        client = fast = Xl330PyController(path, baud, wait_s)
        fast.set_fast_sync_read(True)
    ids = list(servo_ids)

    def read(k: int) -> int:
        try:
            return len(client.sync_read_raw_present_position(ids))
        except (OSError, RuntimeError, ValueError):
            return 0

    def write(k: int) -> int:
        client.sync_write_raw_goal_position(ids, [2048 + k % 8] * len(ids))
        return len(ids)

    try:
        yield read, write
    finally:
        client.close()


@contextmanager
def rustypot(
    kind: str, path: str, baud: int, wait_s: float = WAIT_S, servo_ids: Sequence[int] = IDS
) -> Iterator[Cycle]:
    """Cycle with rustypot: read, then write."""
    with rustypot_halves(kind, path, baud, wait_s, servo_ids) as (read, write):

        def cycle(k: int) -> int:
            values = read(k)
            write(k)
            return values

        yield cycle


def clients(kind: str) -> tuple[Client, ...]:
    """List who is compared on one kind of bus, ours first."""
    if kind == "feetech":
        return (
            Client("ours", "15 B, 31 every 8th", lambda p, b: ours(kind, p, b)),
            Client("bare", "15 B", bare_feetech),
            Client("rustypot", "2 B", lambda p, b: rustypot(kind, p, b)),
        )
    return (
        Client("ours", "10 or 11 B", lambda p, b: ours(kind, p, b, indirect_block=False)),
        Client("ours, indirect", "13 or 14 B", lambda p, b: ours(kind, p, b)),
        Client("bare", "10 B", bare_dynamixel),
        Client("rustypot", "4 B", lambda p, b: rustypot(kind, p, b)),
        Client("SDK", "10 B", robotis),
    )
