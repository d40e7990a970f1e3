"""The instructions common to all makes, for one servo and for groups."""

import struct
from collections.abc import Callable, Iterable, Mapping
from functools import cache, lru_cache
from typing import Generic, Literal, TypeVar

from gazerig.sim_mock.smart_servo.framing import ACTION, PING, READ, REBOOT, REG_WRITE, WRITE
from gazerig.sim_mock.smart_servo.servo import EmulatedServo

Result = tuple[int, bytes]
"""Error number and parameters of an answer."""

GroupRead = tuple[int, int, int]
"""Id, address, length of one servo's part of a group read."""

GroupWrite = tuple[int, int, bytes]
"""Id, address, data of one servo's part of a group write."""

S = TypeVar("S", bound=EmulatedServo)


class InstructionSet(Generic[S]):
    """Instructions of one make of servos.

    Args:
        address_bytes: bytes of an address or a length in a packet.
        misunderstood: the result of an unknown instruction; None: silence.
        own: instructions of this make, by code.
    """

    def __init__(
        self,
        address_bytes: Literal[1, 2],
        misunderstood: Result | None,
        own: Mapping[int, Callable[[S, bytes], Result | None]],
    ) -> None:
        self._address_bytes = address_bytes
        self._span = struct.Struct("<HH" if address_bytes == 2 else "<BB")
        self._misunderstood = misunderstood
        self._actions: dict[int, Callable[[S, bytes], Result | None]] = {
            PING: lambda servo, params: (0, servo.identity()),
            READ: self._read,
            WRITE: lambda servo, params: self._write(servo.write, params),
            REG_WRITE: lambda servo, params: self._write(servo.store_write, params),
            ACTION: lambda servo, params: (servo.action(), b""),
            REBOOT: _reboot,
            **own,
        }

    def carry_out(self, servo: S, code: int, params: bytes) -> Result | None:
        """Execute an instruction on a servo; return its answer, None for silence."""
        action = self._actions.get(code)
        return self._misunderstood if action is None else action(servo, params)

    def sync_rows(self, params: bytes) -> tuple[GroupRead, ...]:
        """Parse the parameters of a sync read."""
        return _sync_rows(self._span, params)

    def sync_writes(self, params: bytes) -> tuple[int, Iterable[tuple[int, bytes]]]:
        """Return address, ids and data of a sync write; no ids if the lengths do not match."""
        if len(params) < self._span.size:
            return 0, ()
        address, length = self._span.unpack_from(params)
        if (len(params) - self._span.size) % (1 + length):
            return 0, ()
        return address, _row(length).iter_unpack(params[self._span.size :])

    def address_of(self, params: bytes) -> int:
        """Return the address at the start of a write."""
        return int.from_bytes(params[: self._address_bytes], "little")

    def _read(self, servo: S, params: bytes) -> Result | None:
        if len(params) != self._span.size:
            return self._misunderstood
        data = servo.read(*self._span.unpack(params))
        return (servo.unreadable, b"") if data is None else (0, data)

    def _write(self, take: Callable[[int, bytes], int], params: bytes) -> Result | None:
        if len(params) < self._address_bytes:
            return self._misunderstood
        return take(self.address_of(params), params[self._address_bytes :]), b""


@cache
def _row(length: int) -> struct.Struct:
    """Return the layout of one servo's part of a sync write."""
    return struct.Struct(f"<B{length}s")


@lru_cache(maxsize=64)
def _sync_rows(span: struct.Struct, params: bytes) -> tuple[GroupRead, ...]:
    """Parse the parameters of a sync read; cached, because a control loop repeats them."""
    if len(params) <= span.size:
        return ()
    address, length = span.unpack_from(params)
    return tuple((servo_id, address, length) for servo_id in params[span.size :])


def _reboot(servo: EmulatedServo, params: bytes) -> Result:
    servo.restart()
    return 0, b""
