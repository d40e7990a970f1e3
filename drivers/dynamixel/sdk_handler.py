"""The SDK's packet layer with its faults contained, for all that is not done every tick.

What is put right here, each seen in dynamixel-sdk 4.1: it does not stuff what it sends;
unstuffing eats a byte of FF FF FD FF FD FD; an answer's id is checked but not its length,
so a short one gives its CRC as data and a refused one an IndexError; line noise is waited
for without end; a port that failed once stays "in use".
"""

from typing import Any

from dynamixel_sdk import COMM_RX_CORRUPT, COMM_RX_TIMEOUT, COMM_SUCCESS, COMM_TX_ERROR
from dynamixel_sdk.protocol2_packet_handler import Protocol2PacketHandler
from fastcrc.crc16 import umts

from gazerig.drivers.dynamixel.protocol import (
    ERROR_NUMBER,
    STATUS_OVERHEAD,
    bytes_missing,
    instruction,
)
from gazerig.drivers.dynamixel.protocol import statuses as find_statuses

LONGEST = 1024
"""No packet of the SDK is longer."""

_ID, _LENGTH, _INSTRUCTION, _PARAMS = 4, 5, 7, 8
_PING_PARAMS = 3


class SdkPackets(Protocol2PacketHandler):  # type: ignore[misc]  # the SDK has no types
    """The SDK's packet handler for Protocol 2.0; use it on one port from one thread."""

    def txPacket(self, port: Any, txpacket: list[int]) -> int:
        """Send an instruction, stuffed; ``txpacket`` is left as it is."""
        length = txpacket[_LENGTH] | txpacket[_LENGTH + 1] << 8
        params = bytes(txpacket[_PARAMS : _PARAMS + length - 3])
        packet = instruction(txpacket[_ID], txpacket[_INSTRUCTION], params)
        if len(packet) > LONGEST:
            return int(COMM_TX_ERROR)
        # One thread uses the port: whatever went wrong before, it is free now.
        port.is_using = False
        port.clearPort()
        port.writePort(packet)
        return int(COMM_SUCCESS)

    def rxPacket(self, port: Any, fast_option: bool) -> tuple[list[int], int]:
        """Wait for one whole status with a right CRC until the packet's deadline."""
        raw = b""
        while True:
            more = port.readPort(bytes_missing(raw, 1, 0) or 1)
            raw += more
            for status in find_statuses(raw):
                if status.intact:
                    return _as_the_sdk_lays_out(status.id, status.error, status.params), 0
            # What is here already is looked at, however late it is; babble has an end.
            if len(raw) > LONGEST or (not more and port.isPacketTimeout()):
                return [], int(COMM_RX_CORRUPT if raw else COMM_RX_TIMEOUT)

    def readTxRx(
        self, port: Any, dxl_id: int, address: int, length: int
    ) -> tuple[list[int], int, int]:
        """Read bytes; a refusal gives zeros and its error, a wrong length counts as corrupt."""
        packet, result, error = self.txRxPacket(port, _read_packet(dxl_id, address, length))
        if result != COMM_SUCCESS:
            return [], result, error
        data = packet[_PARAMS + 1 : -2]
        if len(data) != length and not error & ERROR_NUMBER:
            return [], int(COMM_RX_CORRUPT), error
        return (data if len(data) == length else [0] * length), result, error

    def ping(self, port: Any, dxl_id: int) -> tuple[int, int, int]:
        """Return model number, result and error."""
        number, _, result, error = self.identify(port, dxl_id)
        return number, result, error

    def identify(self, port: Any, dxl_id: int) -> tuple[int, int, int, int]:
        """Ping; give model number, firmware version, result and error."""
        ping = [0] * 10
        ping[_ID], ping[_LENGTH], ping[_INSTRUCTION] = dxl_id, 3, 1
        packet, result, error = self.txRxPacket(port, ping)
        if result != COMM_SUCCESS:
            return 0, 0, result, error
        params = packet[_PARAMS + 1 : -2]
        if len(params) != _PING_PARAMS:
            return 0, 0, int(COMM_RX_CORRUPT), error
        return params[0] | params[1] << 8, params[2], result, error

    def updateCRC(self, crc_accum: int, data_blk_ptr: list[int], data_blk_size: int) -> int:
        """Continue a CRC over bytes."""
        return int(umts(bytes(data_blk_ptr[:data_blk_size]), crc_accum))


def _read_packet(servo_id: int, address: int, length: int) -> list[int]:
    """Lay a read instruction out as the SDK does: the CRC is still 0."""
    span = [address & 0xFF, address >> 8, length & 0xFF, length >> 8]
    return [0, 0, 0, 0, servo_id, 7, 0, 2, *span, 0, 0]


def _as_the_sdk_lays_out(servo_id: int, error: int, params: bytes) -> list[int]:
    """Return an unstuffed status as a list; header and CRC, checked already, are zeros."""
    length = len(params) + STATUS_OVERHEAD - 7
    return [0, 0, 0, 0, servo_id, length & 0xFF, length >> 8, 0x55, error, *params, 0, 0]
