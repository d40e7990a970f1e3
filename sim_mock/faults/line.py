"""Faults of an emulated line with any device at its other end.

A command is a line of text (gazerig.sim_mock.faults.verbs). A fault of answers lasts
for ``count`` of them, for ``seconds`` of the device's time, or until ``clear``; the id None stands
for every servo.
"""

import json
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from gazerig.sim_mock.device import DeviceReply
from gazerig.sim_mock.faults.active import NO_DEVICE, ActiveFaults, LineFault
from gazerig.sim_mock.faults.grammar import CommandTable
from gazerig.sim_mock.replies import Piece


class FaultTarget(Protocol):
    """The interface of a device to its faults."""

    now_s: Callable[[], float]

    def here(self, servo_id: int) -> object:
        """Return what has this id, brought up to now.

        Raises:
            KeyError: nothing has it; the message lists those that there are.
        """
        ...

    def choose(self, case: str, value: str) -> None:
        """Choose what the device does where documents and devices differ."""
        ...


class LineFaults(ABC):
    """The faults of a line and the device behind it; a device adds its own.

    Args:
        chain: the device.
        commands: what can be asked for as text.
        seed: of the random numbers that faults draw.
        header: what its packets begin with: ``fragment`` and ``babble`` send it.
    """

    noun = "servo"
    """What an id belongs to, for messages."""

    def __init__(
        self, chain: FaultTarget, commands: CommandTable, seed: int, header: bytes
    ) -> None:
        self._chain = chain
        self.commands = commands
        self.wire = ActiveFaults(seed, header)

    @abstractmethod
    def reports(self) -> list[dict[str, object]]:
        """Return the state of every servo, for ``status``."""

    def board(self) -> dict[str, object]:
        """Return further entries of ``status`` of devices that are more than servos."""
        return {}

    def command(self, text: str) -> str:
        """Carry out a line such as ``lose 3 count 2``; return what was done.

        Raises:
            ValueError: names the word that is wrong and what would be right.
        """
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
        data: bytes | None = None,
    ) -> str:
        """Start a fault; return what was done.

        Args:
            kind: its name among the faults in force.
            servo_id: whose answers; None for those of all servos.
            text: what is done, for the reply.
            count: for so many answers.
            seconds: for so long.
            numbers: what the kind needs.
            data: what the kind needs, too.

        Raises:
            KeyError: there is no such servo.
        """
        if servo_id is not None:
            self._chain.here(servo_id)
        until_s = None if seconds is None else self._chain.now_s() + seconds
        self.wire.add(LineFault(kind, servo_id, numbers, data, count, until_s))
        span = "" if count is None else f" {count} times"
        span += "" if seconds is None else f" for {seconds:g} s"
        return text + (span or " until cleared")

    def switch(self, kind: str, on: bool, text: str, seconds: float | None = None) -> str:
        """Start or end a fault of the whole line; return what was done."""
        self.wire.remove(kind)
        if on:
            return self.begin(kind, None, text, None, seconds)
        return f"no longer: {text}"

    # --- all

    def on(self, kind: str) -> bool:
        """True if echo, babble, unplug, deny or block is on now."""
        return self.wire.on(kind, self._chain.now_s())

    def choose(self, case: str, value: str) -> str:
        """Choose what servos do where documents and devices differ.

        Raises:
            ValueError: there is no such case or value.
        """
        self._chain.choose(case, value)
        return f"{case} is {value}"

    def clear(self, servo_id: int | None = None) -> str:
        """End every fault of the line (of one servo's answers); faults of servos stay."""
        return f"{self.wire.remove(None, servo_id)} faults cleared"

    def status(self) -> str:
        """Return all servos and the faults in force as one line of JSON."""
        faults = [
            f"{fault.kind} {'all' if fault.servo_id is None else fault.servo_id}"
            for fault in self.wire.listed(self._chain.now_s())
        ]
        return json.dumps({"servos": self.reports(), **self.board(), "faults": faults})

    def around(self, replies: list[DeviceReply], data: bytes) -> list[DeviceReply]:
        """Add the host's echo and a babbling node to replies, if the line has such faults."""
        now_s = self._chain.now_s()
        if self.wire.on("echo", now_s):
            replies.insert(0, DeviceReply(len(data), [Piece(NO_DEVICE, data)]))
        babble = self.wire.babble(now_s)
        if babble:
            replies.insert(0, DeviceReply(0, [Piece(NO_DEVICE, babble)]))
        return replies
