"""Behaviour of Dynamixel servos that is undocumented or differs between documents and devices.

Sources: ROBOTIS e-Manual, Protocol 2.0; the device side of ROBOTIS' Dynamixel2Arduino
(silent on a wrong CRC).
"""

from dataclasses import dataclass
from typing import Literal

from gazerig.sim_mock.smart_servo.quirks import ChainQuirks

BadCrc = Literal["silent", "reply"]
Stuffing = Literal["accept", "strict"]


@dataclass(frozen=True, kw_only=True)
class DynamixelQuirks(ChainQuirks):
    """Choices of behaviour.

    bad_crc: reply to a wrong CRC: silence, or error number 3
    stuffing: an instruction with FF FF FD among its parameters that lacks byte stuffing is
        understood by its length, or dropped
    """

    bad_crc: BadCrc = "silent"
    stuffing: Stuffing = "accept"
