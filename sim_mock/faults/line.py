"""Faults of an emulated line with any device at its end.

A command is a line of text (gazerig.sim_mock.faults.verbs). A fault of answers lasts for
``count`` of them, for ``seconds`` of the device's time, or until ``clear``; the id None means
every servo.
"""

import json
from abc import ABC, abstractmethod
from typing import Any

from gazerig.sim_mock.device import DeviceReply
from gazerig.sim_mock.faults.active import NO_DEVICE, ActiveFaults, LineFault
from gazerig.sim_mock.faults.grammar import CommandTable
from gazerig.sim_mock.replies import Piece


class LineFaults(ABC):
    """Faults of a line and the device at its end; a device adds its own."""

    noun = "servo"
    """Name of the object of an id, for messages."""

    def __init__(self, chain: Any, commands: CommandTable, seed: int) -> None:
        self.chain = chain
        self.commands = commands
        self.wire = ActiveFaults(seed)

    @abstractmethod
    def reports(self) -> list[dict[str, object]]:
        """Return the state of every servo, for ``status``."""

    def board_status(self) -> dict[str, object]:
        """Return further entries of ``status``, for devices that are more than servos."""
        return {}

    def command(self, text: str) -> str:
        """Run a command such as ``lose 3 count 2``; return a description of the effect."""
        return self.commands.obey(self, text)

    def label(self, servo_id: int | None) -> str:
        """Return a servo's label for messages."""
        return "all" if servo_id is None else f"{self.noun} {servo_id}"

    def begin(
        self,
        kind: str,
        servo_id: int | None,
        text: str,
        count: int | None = None,
        seconds: float | None = None,
        numbers: tuple[float, ...] = (),
    ) -> str:
        """Start a fault; return a description of the effect.

        Args:
            kind: its name among the active faults.
            servo_id: servo with the affected answers; None: all servos.
            text: the description, for the reply.
            count: number of answers.
            seconds: duration.
            numbers: parameters of the kind.

        Raises:
            KeyError: the servo does not exist.
        """
        if servo_id is not None:
            self.chain.find_servo(servo_id)
        until_s = None if seconds is None else self.chain.now_s() + seconds
        self.wire.add(LineFault(kind, servo_id, numbers, count, until_s))
        span = "" if count is None else f" {count} times"
        span += "" if seconds is None else f" for {seconds:g} s"
        return text + (span or " until cleared")

    # --- all

    def is_on(self, kind: str) -> bool:
        """Return whether echo or unplug is active."""
        return self.wire.is_on(kind, self.chain.now_s())

    def clear(self, servo_id: int | None = None) -> str:
        """End every fault of the line (or of one servo's answers); faults of servos stay."""
        return f"{self.wire.remove(None, servo_id)} faults cleared"

    def status(self) -> str:
        """Return all servos and the active faults as one line of JSON."""
        faults = [
            f"{fault.kind} {'all' if fault.servo_id is None else fault.servo_id}"
            for fault in self.wire.active_faults(self.chain.now_s())
        ]
        return json.dumps({"servos": self.reports(), **self.board_status(), "faults": faults})

    def add_line_noise(self, replies: list[DeviceReply], data: bytes) -> list[DeviceReply]:
        """Add the host's echo to replies, if the line has such a fault."""
        if self.is_on("echo"):
            replies.insert(0, DeviceReply(len(data), [Piece(NO_DEVICE, data)]))
        return replies
