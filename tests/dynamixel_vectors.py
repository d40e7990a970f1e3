"""Bytes of Protocol 2.0 for the emulated chain."""

from servo_bench import DynamixelBench

instruction = DynamixelBench.instruction


def vector(text: str) -> bytes:
    return bytes.fromhex(text.replace(" ", ""))


PING = vector("FF FF FD 00 01 03 00 01 19 4E")
