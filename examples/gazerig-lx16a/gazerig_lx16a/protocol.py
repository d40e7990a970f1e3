"""Frames of the LX-16A: 55 55, id, length, command, parameters, inverted sum."""

import struct

BAUD = 115_200
BROADCAST = 0xFE
HEADER = b"\x55\x55"

MOVE, TEMPERATURE, VOLTAGE, POSITION, MODE, LOAD, LOADED = 1, 26, 27, 28, 30, 31, 32
"""Commands; the last but one switches the torque, the last reads whether it is on."""

ANSWERS = {
    TEMPERATURE: struct.Struct("<B"),
    VOLTAGE: struct.Struct("<H"),
    POSITION: struct.Struct("<h"),
    MODE: struct.Struct("<BBh"),
    LOADED: struct.Struct("<B"),
}
"""Parameters of the answer to a command that reads."""


def frame(servo_id: int, command: int, params: bytes = b"") -> bytes:
    """Return a frame; the length counts itself, the command, the parameters and the sum."""
    body = bytes((servo_id, len(params) + 3, command)) + params
    return HEADER + body + bytes((~sum(body) & 0xFF,))


def frames(data: bytes) -> tuple[list[tuple[int, int, bytes, int]], int]:
    """Return what whole frames there are, and where the rest begins.

    A frame is id, command, parameters and the position behind it.
    """
    found: list[tuple[int, int, bytes, int]] = []
    at = 0
    while (at := data.find(HEADER, at)) >= 0:
        if len(data) < at + 4 or len(data) < (end := at + 3 + data[at + 3]):
            return found, at
        body = data[at + 2 : end - 1]
        if data[at + 3] >= 3 and ~sum(body) & 0xFF == data[end - 1]:
            found.append((body[0], body[2], body[3:], end))
            at = end
        else:
            at += 1
    return found, len(data) - data.endswith(HEADER[:1])
