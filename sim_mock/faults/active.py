"""Effects of faults on the bytes between servos and host. Values in, values out.

A ``LineFault`` lasts for a number of answers, for a time, or until it is cleared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from random import Random

from gazerig.sim_mock.replies import Answer, Piece

NO_DEVICE = -1
"""Id of pieces that no servo sent: noise, echo, babble."""

BABBLE_BYTES_S = 20_000
BABBLE_MOST = 2000
"""Most bytes of a babbling node per call, however long ago the last call was."""


@dataclass
class LineFault:
    """One active fault.

    servo_id: servo with the affected answers; None: all servos
    values, data: parameters of the kind (milliseconds, byte counts, ids; noise bytes)
    remaining_answers: remaining answers, until_s: end time; None: no such end
    """

    kind: str
    servo_id: int | None = None
    values: tuple[float, ...] = ()
    data: bytes | None = None
    remaining_answers: int | None = None
    until_s: float | None = None

    def is_active(self, now_s: float) -> bool:
        """Return whether it is not over."""
        return self.remaining_answers != 0 and (self.until_s is None or now_s < self.until_s)


class ActiveFaults:
    """The active faults, and their effects on answers and bytes.

    ``has_any`` is False while no fault is active, which saves further calls.
    header: first bytes of packets on this line
    """

    def __init__(self, seed: int, header: bytes) -> None:
        self._header = header
        self._faults: list[LineFault] = []
        self._rng = Random(seed)
        self._babbled_s = 0.0
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
        """Return the active faults, oldest first."""
        self._drop_expired(now_s)
        return tuple(self._faults)

    def is_on(self, kind: str, now_s: float) -> bool:
        """Return whether a fault of this kind is active."""
        return self.has_any and any(f.kind == kind and f.is_active(now_s) for f in self._faults)

    def use_fault(self, kind: str, servo_id: int | None, now_s: float) -> LineFault | None:
        """Find a fault that affects this servo now and count one use of it."""
        if not self.has_any:
            return None
        for fault in self._faults:
            if fault.kind != kind or fault.servo_id not in (None, servo_id):
                continue
            if fault.is_active(now_s):
                if fault.remaining_answers is not None:
                    fault.remaining_answers -= 1
                return fault
        self._drop_expired(now_s)
        return None

    def _drop_expired(self, now_s: float) -> None:
        self._faults = [fault for fault in self._faults if fault.is_active(now_s)]
        self.has_any = bool(self._faults)

    # --- electrical noise, in both directions

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

    # --- answers before their checksums

    def spoil_answers(self, answers: Sequence[Answer], fast: bool, now_s: float) -> list[Answer]:
        """Change answers before their checksums are computed: ids, errors, lengths and order."""
        said: list[Answer] = []
        for answer in answers:
            servo_id, params = answer.servo_id, answer.params
            refused = self.use_fault("refuse", servo_id, now_s)
            if refused is not None:
                error = answer.error | int(refused.values[0])
                # A block of a fast reply keeps its position: it is filled with zeros.
                answer = answer._replace(error=error, params=bytes(len(params)) if fast else b"")
            short = self.use_fault("short", servo_id, now_s)
            if short is not None:
                kept = max(0, len(params) - int(short.values[0]))
                answer = answer._replace(params=params[:kept])
            long = self.use_fault("long", servo_id, now_s)
            if long is not None:
                answer = answer._replace(params=params + bytes(int(long.values[0])))
            other = self.use_fault("wrong_id", servo_id, now_s)
            if other is not None:
                answer = answer._replace(servo_id=int(other.values[0]))
            said.append(answer)
        if len(said) > 1 and self.use_fault("reorder", None, now_s):
            said.reverse()
        return said

    # --- received bytes

    def spoil_pieces(self, pieces: Sequence[Piece], fast: bool, now_s: float) -> list[Piece]:
        """Change received pieces; ``fast``: the pieces are blocks of one packet."""
        out: list[Piece] = []
        repeat = False
        for piece in pieces:
            servo_id, data = piece.servo_id, bytearray(piece.data)
            flip = self.use_fault("corrupt", servo_id, now_s)
            if flip is not None and data:
                bit = int(flip.values[0]) if flip.values else self._rng.randrange(len(data) * 8)
                bit %= len(data) * 8
                data[bit // 8] ^= 1 << bit % 8
            drop = self.use_fault("drop", servo_id, now_s)
            if drop is not None and data:
                del data[int(drop.values[0]) % len(data)]
            cut = self.use_fault("truncate", servo_id, now_s)
            if cut is not None:
                del data[int(cut.values[0]) :]
            hurt = piece._replace(data=bytes(data))
            late = self.use_fault("delay", servo_id, now_s)
            if late is not None:
                hurt = hurt._replace(late_s=hurt.late_s + late.values[0] / 1000.0)
            gap = self.use_fault("stall", servo_id, now_s)
            if gap is None:
                out.append(hurt)
            else:
                half = len(hurt.data) // 2
                rest = Piece(servo_id, hurt.data[half:], 0.0, gap.values[0] / 1000.0)
                out += [hurt._replace(data=hurt.data[:half]), rest]
            again = self.use_fault("duplicate", piece.servo_id, now_s) is not None
            if again and not fast:
                out.append(Piece(NO_DEVICE, hurt.data))
            repeat = repeat or again
            if cut is not None and fast:
                break
        if fast and repeat:
            out += [Piece(NO_DEVICE, piece.data) for piece in out]
        if not pieces:
            return out
        if self.use_fault("fragment", pieces[0].servo_id, now_s):
            out.insert(0, Piece(NO_DEVICE, self._header))
        before = self.use_fault("noise_before", None, now_s)
        if before is not None:
            out.insert(0, Piece(NO_DEVICE, self._noise_bytes(before)))
        after = self.use_fault("noise_after", None, now_s)
        if after is not None:
            out.append(Piece(NO_DEVICE, self._noise_bytes(after)))
        return out

    def _noise_bytes(self, fault: LineFault) -> bytes:
        return self._rng.randbytes(8) if fault.data is None else fault.data

    def babble_bytes(self, now_s: float) -> bytes:
        """Return the bytes of a babbling node since the last call: headers and noise."""
        if not self.is_on("babble", now_s):
            self._babbled_s = now_s
            return b""
        length = min(BABBLE_MOST, int((now_s - self._babbled_s) * BABBLE_BYTES_S))
        if length > 0:
            self._babbled_s = now_s
        size = len(self._header) + 4
        words = (self._header + self._rng.randbytes(4) for _ in range(length // size + 1))
        return b"".join(words)[:length]
