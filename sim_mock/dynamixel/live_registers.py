"""The registers of an emulated servo that live: what it senses, packed as they are on the wire."""

import struct
from typing import NamedTuple

SENSED = struct.Struct("<hii")
SENSED_AT = 126
"""126 current, 128 velocity, 132 position: what a control loop reads every tick."""

LIVE_AT = 120
_HEAD, _TAIL = struct.Struct("<HBBh"), struct.Struct("<iiHB")
_TAIL_AT = 136

PROFILED = ((LIVE_AT, SENSED_AT), (_TAIL_AT, 144))
"""Ranges that tell of the profile, besides what is sensed; a control loop seldom reads them."""

_SURROUNDINGS, _SURROUNDINGS_AT = struct.Struct("<HB"), 144

ARRIVED, RUNNING, ASTRAY = 1, 2, 8
"""Bits of Moving Status (123): in position, profile ongoing, following error."""

IN_POSITION_STEPS = 12
FOLLOWING_STEPS = 100
"""Distances that decide over in position and following error; no document tells them."""


class Live(NamedTuple):
    """What the registers tell, in their units."""

    tick_ms: int
    moving: bool
    status: int
    pwm: int
    sensed: tuple[int, int, int]
    velocity_asked: int
    position_asked: int
    voltage: int
    temperature: int


def put(live: Live, into: bytearray) -> None:
    """Write the live registers into a control table."""
    _HEAD.pack_into(into, LIVE_AT, live.tick_ms & 0x7FFF, live.moving, live.status, live.pwm)
    SENSED.pack_into(into, SENSED_AT, *live.sensed)
    _TAIL.pack_into(
        into,
        _TAIL_AT,
        live.velocity_asked,
        live.position_asked,
        live.voltage,
        max(0, min(255, live.temperature)),
    )


def put_sensed(
    sensed: tuple[int, int, int], voltage: int, temperature: int, into: bytearray
) -> None:
    """Write what is sensed into a control table, the profile's registers left as they are."""
    SENSED.pack_into(into, SENSED_AT, *sensed)
    _SURROUNDINGS.pack_into(into, _SURROUNDINGS_AT, voltage, max(0, min(255, temperature)))
