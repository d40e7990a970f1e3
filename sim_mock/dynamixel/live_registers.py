"""The registers of an emulated Dynamixel servo that change by themselves, packed as on the wire."""

import struct
from typing import NamedTuple

SENSED = struct.Struct("<hii")
SENSED_AT = 126
"""126 current, 128 velocity, 132 position: what a control loop reads every tick."""

_HEAD, _HEAD_AT = struct.Struct("<HBBh"), 120
_TAIL, _TAIL_AT = struct.Struct("<ii"), 136
_SURROUNDINGS, _SURROUNDINGS_AT = struct.Struct("<HB"), 144

SENSED_SPAN = SENSED_AT, _TAIL_AT
SURROUNDINGS_SPAN = _SURROUNDINGS_AT, _SURROUNDINGS_AT + _SURROUNDINGS.size
PROFILED = ((_HEAD_AT, SENSED_AT), (_TAIL_AT, _SURROUNDINGS_AT))
"""Addresses of what is sensed, of voltage and temperature, and of what the profile does."""

ARRIVED, RUNNING, ASTRAY = 1, 2, 8
"""Bits of Moving Status (123): in position, profile ongoing, following error."""

IN_POSITION_STEPS = 12
FOLLOWING_STEPS = 100
"""Distances that decide over in position and following error; no document tells them."""


class Live(NamedTuple):
    """What the profile does, in the registers' units."""

    tick_ms: int
    moving: bool
    status: int
    pwm: int
    velocity_asked: int
    position_asked: int


def put_profiled(live: Live, into: bytearray) -> None:
    """Write what the profile does into a control table."""
    _HEAD.pack_into(into, _HEAD_AT, live.tick_ms & 0x7FFF, live.moving, live.status, live.pwm)
    _TAIL.pack_into(into, _TAIL_AT, live.velocity_asked, live.position_asked)


def put_sensed(sensed: tuple[int, int, int], into: bytearray) -> None:
    """Write current, velocity and position into a control table."""
    SENSED.pack_into(into, SENSED_AT, *sensed)


def put_surroundings(voltage_01v: int, celsius: float, into: bytearray) -> None:
    """Write voltage and temperature into a control table."""
    warmth = max(0, min(255, round(celsius)))
    _SURROUNDINGS.pack_into(into, _SURROUNDINGS_AT, voltage_01v, warmth)
