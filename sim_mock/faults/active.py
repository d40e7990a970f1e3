"""Effects of faults on the bytes between servos and host. Values in, values out.

A ``LineFault`` lasts for a number of answers, for a time, or until it is cleared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from random import Random

from gazerig.sim_mock.replies import Piece

NO_DEVICE = -1
"""Id of pieces that no servo sent: the host's echo."""


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

    def is_active(self, now_s: float) -> bool:
        """Return whether it is not over."""
        return self.remaining_answers != 0 and (self.until_s is None or now_s < self.until_s)


class ActiveFaults:
    """The active faults, and their effects on bytes.

    ``has_any`` is False while no fault is active, which saves further calls.
    """

    def __init__(self, seed: int) -> None:
        self._faults: list[LineFault] = []
        self._rng = Random(seed)
        self.has_any = False

    def add(self, fault: LineFault) -> None:
        """Start a fault."""
        self._faults.append(fault)
        self.has_any = True

    def remove(self, kind: str | None = None, servo_id: int | None = None) -> int:
        """End faults of a kind (None: all kinds) and servo (None: all); return their number."""
        before = len(self._faults)
        self._faults = [
            fault
            for fault in self._faults
            if (kind is not None and fault.kind != kind)
            or (servo_id is not None and fault.servo_id != servo_id)
        ]
        self.has_any = bool(self._faults)
        return before - len(self._faults)

    def active_faults(self, now_s: float) -> tuple[LineFault, ...]:
        """Return the active faults, oldest first; forget the others."""
        self._faults = [fault for fault in self._faults if fault.is_active(now_s)]
        self.has_any = bool(self._faults)
        return tuple(self._faults)

    def is_on(self, kind: str, now_s: float) -> bool:
        """Return whether a fault of this kind is active."""
        return self.has_any and any(f.kind == kind and f.is_active(now_s) for f in self._faults)

    def use_fault(self, kind: str, servo_id: int | None, now_s: float) -> LineFault | None:
        """Find a fault that affects this servo now and count one use of it."""
        for fault in self._faults:
            if fault.kind != kind or fault.servo_id not in (None, servo_id):
                continue
            if fault.is_active(now_s):
                if fault.remaining_answers is not None:
                    fault.remaining_answers -= 1
                return fault
        self.active_faults(now_s)
        return None

    def add_noise(self, data: bytes, now_s: float) -> bytes:
        """Return bytes after a noisy line: some changed, lost or inserted.

        The fault's number is the percentage of bytes that are hit. Of four such bytes two are
        changed, one is lost, and one gets another byte inserted before it.
        """
        noise = next((f for f in self._faults if f.kind == "static" and f.is_active(now_s)), None)
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

    def spoil_pieces(self, pieces: Sequence[Piece], fast: bool, now_s: float) -> list[Piece]:
        """Change bits, ends and times of answers; ``fast``: the pieces are blocks of one packet."""
        out: list[Piece] = []
        for piece in pieces:
            servo_id, data = piece.servo_id, bytearray(piece.data)
            flip = self.use_fault("corrupt", servo_id, now_s)
            if flip is not None and data:
                bit = int(flip.values[0]) if flip.values else self._rng.randrange(len(data) * 8)
                bit %= len(data) * 8
                data[bit // 8] ^= 1 << bit % 8
            cut = self.use_fault("truncate", servo_id, now_s)
            if cut is not None:
                del data[int(cut.values[0]) :]
            late = self.use_fault("delay", servo_id, now_s)
            late_s = piece.late_s + (late.values[0] / 1000.0 if late is not None else 0.0)
            out.append(piece._replace(data=bytes(data), late_s=late_s))
            if cut is not None and fast:
                break
        return out
