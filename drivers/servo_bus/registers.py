"""Access to single registers of single servos, for tasks outside the tick."""

from collections.abc import Iterable, Sequence

from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BITS_PER_BYTE, BusPort
from gazerig.drivers.servo_bus.family import Family, Identity, Status
from gazerig.drivers.servo_bus.transaction import ROOM, TRIES, read_some

REPLY_S = 0.04
"""Time-out for one servo: the longest return delay and two turns of a 16 ms latency timer."""

LATE_S = 0.15
"""Longest delay of an answer after its time-out."""

LONGEST = 1024
"""Largest number of bytes read from a line that never falls silent."""


class Registers:
    """Registers of servos by name; every exchange is tried three times.

    Args:
        port: Port, open at the servos' baud rate.
        family: Family of the servos.
        tries: Number of attempts for a silent servo.
        lateness: Delays of this computer, which are recorded there.

    refusal: error number of the newest exchange if it was refused, otherwise 0
    """

    def __init__(
        self,
        port: BusPort,
        family: Family,
        tries: int = TRIES,
        lateness: HostLateness | None = None,
    ) -> None:
        self._port, self._family = port, family
        self.lateness = lateness or HostLateness()
        self._tries = tries
        self._late_until_s: dict[int, float] = {}
        self.refusal = 0

    def identify(self, servo_id: int) -> Identity | None:
        """Return a servo's model and firmware, None if it does not answer."""
        codec = self._family.codec
        status = self._exchange(servo_id, codec.identity_request(servo_id), codec.IDENTITY_LENGTH)
        return None if status is None else codec.parse_identity(status)

    def read(self, servo_id: int, name: str) -> int | None:
        """Return a register's value, None without a good answer."""
        return self.read_many(servo_id, (name,))[name]

    def read_many(self, servo_id: int, names: Iterable[str]) -> dict[str, int | None]:
        """Return values by name; adjacent registers are read together.

        The value is None without a good answer. A servo that falls silent is not read further.
        """
        values: dict[str, int | None] = dict.fromkeys(names)
        left = sorted((self._family.registers[name] for name in values), key=lambda r: r.address)
        while left:
            start = end = left[0].address
            while left and left[0].address == end:
                end += left.pop(0).size
            request = self._family.codec.read(servo_id, start, end - start)
            status = self._exchange(servo_id, request, end - start)
            if status is not None:
                values |= self._family.decode(start, status.params)
            elif not self.refusal:
                break
        return values

    def write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register; return whether the servo confirmed it."""
        register = self._family.registers[name]
        data = register.encode(value)
        request = self._family.codec.write(servo_id, register.address, data)
        return self._exchange(servo_id, request, 0, insist=True) is not None

    def write_all(self, ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to a register of several servos with one packet, unconfirmed."""
        register = self._family.registers[name]
        rows = [register.encode(value)] * len(ids)
        self._port.write(self._family.codec.sync_write(ids, register.address, register.size, rows))

    def write_if_different(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register only if it differs; return whether it now has the value."""
        return self.read(servo_id, name) == value or self.write(servo_id, name, value)

    def write_persistent(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register so that an EEPROM value survives a loss of power.

        The lock, if any, is open only during the write.

        Returns:
            Whether the servo has the value.
        """
        lock = self._family.lock_register
        if lock is None or self._family.registers[name].area != "eeprom":
            return self.write_if_different(servo_id, name, value)
        if not self.write(servo_id, lock, 0):
            return False
        written = self.write(servo_id, name, value)
        closed = self.write(servo_id, lock, 1)
        return closed and written and self.read(servo_id, name) == value

    def _exchange(
        self, servo_id: int, request: bytes, length: int, insist: bool = False
    ) -> Status | None:
        """Send a request until a good answer arrives; ``insist``: also after a refusal."""
        port, codec = self._port, self._family.codec
        self.refusal = 0
        for _ in range(self._tries):
            # No answer to an earlier request may arrive any more, as it does not contain the
            # address of its register.
            dropped = port.read_until(ROOM, self._late_until_s.pop(servo_id, 0.0))
            if any(one.intact and one.id == servo_id for one in codec.parse_statuses(dropped)):
                self.lateness.record_late_answer(port.now_s())
            _, status = transact(port, self._family, request, length, REPLY_S, servo_id)
            self.refusal = 0 if status is None else status.error & codec.REFUSAL
            if status is None:
                self._late_until_s[servo_id] = port.now_s() + LATE_S
            elif not self.refusal:
                return status
            elif not insist:
                return None
        return None


def transact(
    port: BusPort,
    family: Family,
    request: bytes,
    length: int,
    timeout_s: float,
    servo_id: int | None = None,
) -> tuple[bytes, Status | None]:
    """Send a request to one servo and wait for its answer.

    Noise, echoes, and answers of other servos or of another length are skipped.

    Args:
        port: Open port.
        family: Family of the servo.
        request: Packet to send.
        length: Number of params of the answer.
        timeout_s: Time-out in addition to the time on the wire, seconds.
        servo_id: Id of the servo that must answer; None for any.

    Returns:
        All received bytes, and the answer or None.
    """
    codec = family.codec
    port.write(request)
    byte_s = BITS_PER_BYTE / float(getattr(port, "baudrate", family.factory_baud))
    wire_s = (len(request) + length + codec.STATUS_OVERHEAD) * byte_s
    deadline_s, raw = port.now_s() + wire_s + timeout_s, b""
    while len(raw) < LONGEST and (more := read_some(port, deadline_s)):
        raw += more
        # Some adapters return the request before the answer, which may look like one.
        for status in codec.parse_statuses(raw.replace(request, b"", 1)):
            mine = status.intact and servo_id in (None, status.id)
            if mine and (len(status.params) == length or status.error & codec.REFUSAL):
                return raw, status
    return raw, None
