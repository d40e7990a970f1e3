"""What servos do where documents and devices are silent or differ.

Sources: ROBOTIS e-Manual, Protocol 2.0; the device side of ROBOTIS' Dynamixel2Arduino
(silent on a wrong CRC); logic analyser traces published by users of ROBOTIS' SDK (later
servos of a group wait for a missing one). Times marked [A] are assumed.
"""

from dataclasses import dataclass
from typing import Literal, get_args

from sim_mock.smart_servo.quirks import cases_of, decided

AfterMissing = Literal["silence", "skip", "timeout"]
BadCrc = Literal["silent", "reply"]
Stuffing = Literal["accept", "strict"]
WrongBaud = Literal["silence", "garbage"]


@dataclass(frozen=True)
class DynamixelQuirks:
    """The choices.

    after_missing: what servos do that come after a silent one in a plain group read:
        never answer, answer at once, or answer after ``slot_timeout_s`` [A]
    bad_crc: a wrong CRC is met with silence or with error number 3
    stuffing: an instruction with FF FF FD among its parameters that was not stuffed is
        understood by its length, or dropped
    wrong_baud: a client at another baud rate hears nothing, or garbage
    packet_gap_s: a packet that stays unfinished so long is dropped
    """

    after_missing: AfterMissing = "silence"
    bad_crc: BadCrc = "silent"
    stuffing: Stuffing = "accept"
    wrong_baud: WrongBaud = "silence"
    slot_timeout_s: float = 0.001
    packet_gap_s: float = 0.0015


_CHOICES: dict[str, tuple[str, ...]] = {
    "after_missing": get_args(AfterMissing),
    "bad_crc": get_args(BadCrc),
    "stuffing": get_args(Stuffing),
    "wrong_baud": get_args(WrongBaud),
}


def cases() -> dict[str, str]:
    """Give the name of every case, as it is typed, and its possible values."""
    return cases_of(_CHOICES)


def chosen(quirks: DynamixelQuirks, case: str, value: str) -> DynamixelQuirks:
    """Give the quirks with one case decided otherwise.

    Raises:
        ValueError: there is no such case or value.
    """
    return decided(quirks, _CHOICES, case, value)
