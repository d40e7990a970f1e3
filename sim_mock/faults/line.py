"""Faults of an emulated line with any device at its end.

A command is a line of text (gazerig.sim_mock.faults.verbs). A fault of answers lasts for
``count`` of them, for ``seconds`` of the device's time, or until ``clear``; the id None means
every servo.
"""

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from math import log
from random import Random
from typing import Any

from gazerig.sim_mock.faults.grammar import CommandTable
from gazerig.sim_mock.replies import NO_DEVICE, Piece


@dataclass
class LineFault:
    """One active fault.

    servo_id: servo with the affected answers; None: all servos
    values: parameters of the kind (milliseconds, byte counts)
    remaining_answers: remaining answers, until_s: end time; None: no such end
    """

    kind: str
    servo_id: int | None = None
    values: tuple[float, ...] = ()
    remaining_answers: int | None = None
    until_s: float | None = None


class LineFaults(ABC):
    """Faults of a line and the device at its end; a device adds its own.

    ``has_any`` is False while no fault of the line is active, which saves further calls.
    """

    def __init__(self, chain: Any, commands: CommandTable, seed: int) -> None:
        self.chain = chain
        self.commands = commands
        self._faults: list[LineFault] = []
        self._rng = Random(seed)
        self.has_any = False

    @abstractmethod
    def reports(self) -> list[dict[str, object]]:
        """Return the state of every servo, for ``status``."""

    # --- commands

    def command(self, text: str) -> str:
        """Run a command such as ``lose 3 count 2``; return a description of the effect.

        Raises:
            ValueError: the command is invalid; the message names the wrong word and valid ones.
        """
        return self.commands.obey(self, text)

    def label(self, servo_id: int | None) -> str:
        """Return a servo's label for messages."""
        return "all" if servo_id is None else f"servo {servo_id}"

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
        self._keep([*self._faults, LineFault(kind, servo_id, numbers, count, until_s)])
        span = "" if count is None else f" {count} times"
        span += "" if seconds is None else f" for {seconds:g} s"
        return text + (span or " until cleared")

    def plug(self) -> str:
        """Reconnect the adapter."""
        self._keep(fault for fault in self._faults if fault.kind != "unplug")
        return "plugged in"

    def clear(self) -> str:
        """End every fault of the line; faults of servos stay."""
        before = len(self._faults)
        self._keep(())
        return f"{before} faults cleared"

    def status(self) -> str:
        """Return all servos and the active faults as one line of JSON."""
        faults = [
            f"{fault.kind} {'all' if fault.servo_id is None else fault.servo_id}"
            for fault in self._active()
        ]
        return json.dumps({"servos": self.reports(), "faults": faults})

    # --- effects

    def is_on(self, kind: str, servo_id: int | None = None) -> bool:
        """Return whether a fault of this kind affects this servo, or the line, now."""
        return self.has_any and self._find(kind, servo_id) is not None

    def use_fault(self, kind: str, servo_id: int | None = None) -> LineFault | None:
        """Find a fault that affects this servo now and count one use of it."""
        fault = self._find(kind, servo_id) if self.has_any else None
        if fault is not None and fault.remaining_answers is not None:
            fault.remaining_answers -= 1
        return fault

    def disturb(self, pieces: list[Piece], sent: bytes) -> list[Piece]:
        """Return what arrives of answers, after the echo of the host's own bytes."""
        disturbed = [self._spoil(piece) for piece in pieces]
        if self.is_on("echo"):
            disturbed.insert(0, Piece(NO_DEVICE, sent, len(sent)))
        return [piece._replace(data=self.add_noise(piece.data)) for piece in disturbed]

    def add_noise(self, data: bytes) -> bytes:
        """Return bytes after a noisy line: some changed, lost or inserted.

        The fault's number is the percentage of bytes that are hit. Of four such bytes two are
        changed, one is lost, and one gets another byte inserted before it.
        """
        noise = self.use_fault("static")
        if noise is None:
            return data
        rng, out, share, at = self._rng, bytearray(), noise.values[0] / 100.0, 0
        while True:
            # One draw for the distance to the next byte hit, instead of a draw for each byte.
            ahead = int(log(1.0 - rng.random()) / log(1.0 - share)) if share < 1.0 else 0
            out += data[at : at + ahead]
            at += ahead
            if at >= len(data):
                return bytes(out)
            how = rng.randrange(4)
            if how < 2:
                out.append(data[at] ^ rng.randrange(1, 256))
            elif how == 3:
                out += bytes((rng.randrange(256), data[at]))
            at += 1

    def _spoil(self, piece: Piece) -> Piece:
        """Change a bit, the end and the time of an answer."""
        data, late_s = bytearray(piece.data), piece.late_s
        if data and (flip := self.use_fault("corrupt", piece.servo_id)) is not None:
            bit = int(flip.values[0]) if flip.values else self._rng.randrange(len(data) * 8)
            bit %= len(data) * 8
            data[bit // 8] ^= 1 << bit % 8
        if (cut := self.use_fault("truncate", piece.servo_id)) is not None:
            del data[int(cut.values[0]) :]
        if (late := self.use_fault("delay", piece.servo_id)) is not None:
            late_s += late.values[0] / 1000.0
        return piece._replace(data=bytes(data), late_s=late_s)

    def _find(self, kind: str, servo_id: int | None) -> LineFault | None:
        return next(
            (f for f in self._active() if f.kind == kind and f.servo_id in (None, servo_id)), None
        )

    def _active(self) -> list[LineFault]:
        """Return the active faults, oldest first; forget the others."""
        now_s = self.chain.now_s()
        self._keep(
            fault
            for fault in self._faults
            if fault.remaining_answers != 0 and (fault.until_s is None or now_s < fault.until_s)
        )
        return self._faults

    def _keep(self, faults: Iterable[LineFault]) -> None:
        self._faults = list(faults)
        self.has_any = bool(self._faults)
