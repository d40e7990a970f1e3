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

    servo_id: the servo whose answers it affects; None: all servos
    numbers, data: parameters of the kind (milliseconds, byte counts, ids; noise bytes)
    left: remaining answers, until_s: end time; None: no such end
    """

    kind: str
    servo_id: int | None = None
    numbers: tuple[float, ...] = ()
    data: bytes | None = None
    left: int | None = None
    until_s: float | None = None

    def lasts(self, now_s: float) -> bool:
        """Return whether it is not over."""
        return self.left != 0 and (self.until_s is None or now_s < self.until_s)


class ActiveFaults:
    """The active faults, and their effects on answers and bytes.

    ``any`` is False while no fault is active, which saves further calls.
    header: first bytes of packets on this line
    """

    def __init__(self, seed: int, header: bytes) -> None:
        self._header = header
        self._faults: list[LineFault] = []
        self._rng = Random(seed)
        self._babbled_s = 0.0
        self.any = False

    def add(self, fault: LineFault) -> None:
        """Start a fault."""
        self._faults.append(fault)
        self.any = True

    def remove(self, kind: str | None = None, servo_id: int | None = None) -> int:
        """End faults of a kind (None: all kinds) and servo (None: all); return their number."""
        before = len(self._faults)
        self._faults = [
            fault
            for fault in self._faults
            if (kind is not None and fault.kind != kind)
            or (servo_id is not None and fault.servo_id != servo_id)
        ]
        self.any = bool(self._faults)
        return before - len(self._faults)

    def listed(self, now_s: float) -> tuple[LineFault, ...]:
        """Return the active faults, oldest first."""
        self._drop_expired(now_s)
        return tuple(self._faults)

    def on(self, kind: str, now_s: float) -> bool:
        """Return whether a fault of this kind is active."""
        return self.any and any(f.kind == kind and f.lasts(now_s) for f in self._faults)

    def take(self, kind: str, servo_id: int | None, now_s: float) -> LineFault | None:
        """Find a fault that affects this servo now and count one use of it."""
        if not self.any:
            return None
        for fault in self._faults:
            if fault.kind != kind or fault.servo_id not in (None, servo_id):
                continue
            if fault.lasts(now_s):
                if fault.left is not None:
                    fault.left -= 1
                return fault
        self._drop_expired(now_s)
        return None

    def _drop_expired(self, now_s: float) -> None:
        self._faults = [fault for fault in self._faults if fault.lasts(now_s)]
        self.any = bool(self._faults)

    # --- electrical noise, in both directions

    def add_noise(self, data: bytes, now_s: float) -> bytes:
        """Return bytes after a noisy line: some changed, lost or inserted.

        The fault's number is the percentage of bytes that are hit. Of four such bytes two are
        changed, one is lost, and one gets another byte inserted before it.
        """
        noise = next((f for f in self._faults if f.kind == "static" and f.lasts(now_s)), None)
        if noise is None:
            return data
        rng, out, share, at = self._rng, bytearray(), noise.numbers[0] / 100.0, 0
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
            refused = self.take("refuse", servo_id, now_s)
            if refused is not None:
                error = answer.error | int(refused.numbers[0])
                # A block of a fast reply keeps its position: it is filled with zeros.
                answer = answer._replace(error=error, params=bytes(len(params)) if fast else b"")
            short = self.take("short", servo_id, now_s)
            if short is not None:
                kept = max(0, len(params) - int(short.numbers[0]))
                answer = answer._replace(params=params[:kept])
            long = self.take("long", servo_id, now_s)
            if long is not None:
                answer = answer._replace(params=params + bytes(int(long.numbers[0])))
            other = self.take("wrong_id", servo_id, now_s)
            if other is not None:
                answer = answer._replace(servo_id=int(other.numbers[0]))
            said.append(answer)
        if len(said) > 1 and self.take("reorder", None, now_s):
            said.reverse()
        return said

    # --- received bytes

    def spoil_pieces(self, pieces: Sequence[Piece], fast: bool, now_s: float) -> list[Piece]:
        """Change received pieces; ``fast``: the pieces are blocks of one packet."""
        out: list[Piece] = []
        repeat = False
        for piece in pieces:
            servo_id, data = piece.servo_id, bytearray(piece.data)
            flip = self.take("corrupt", servo_id, now_s)
            if flip is not None and data:
                bit = int(flip.numbers[0]) if flip.numbers else self._rng.randrange(len(data) * 8)
                bit %= len(data) * 8
                data[bit // 8] ^= 1 << bit % 8
            drop = self.take("drop", servo_id, now_s)
            if drop is not None and data:
                del data[int(drop.numbers[0]) % len(data)]
            cut = self.take("truncate", servo_id, now_s)
            if cut is not None:
                del data[int(cut.numbers[0]) :]
            hurt = piece._replace(data=bytes(data))
            late = self.take("delay", servo_id, now_s)
            if late is not None:
                hurt = hurt._replace(late_s=hurt.late_s + late.numbers[0] / 1000.0)
            gap = self.take("stall", servo_id, now_s)
            if gap is None:
                out.append(hurt)
            else:
                half = len(hurt.data) // 2
                rest = Piece(servo_id, hurt.data[half:], 0.0, gap.numbers[0] / 1000.0)
                out += [hurt._replace(data=hurt.data[:half]), rest]
            again = self.take("duplicate", piece.servo_id, now_s) is not None
            if again and not fast:
                out.append(Piece(NO_DEVICE, hurt.data))
            repeat = repeat or again
            if cut is not None and fast:
                break
        if fast and repeat:
            out += [Piece(NO_DEVICE, piece.data) for piece in out]
        if not pieces:
            return out
        if self.take("fragment", pieces[0].servo_id, now_s):
            out.insert(0, Piece(NO_DEVICE, self._header))
        before = self.take("noise_before", None, now_s)
        if before is not None:
            out.insert(0, Piece(NO_DEVICE, self._noise(before)))
        after = self.take("noise_after", None, now_s)
        if after is not None:
            out.append(Piece(NO_DEVICE, self._noise(after)))
        return out

    def _noise(self, fault: LineFault) -> bytes:
        return self._rng.randbytes(8) if fault.data is None else fault.data

    def babble(self, now_s: float) -> bytes:
        """Return the bytes of a babbling node since the last call: headers and noise."""
        if not self.on("babble", now_s):
            self._babbled_s = now_s
            return b""
        length = min(BABBLE_MOST, int((now_s - self._babbled_s) * BABBLE_BYTES_S))
        if length > 0:
            self._babbled_s = now_s
        size = len(self._header) + 4
        words = (self._header + self._rng.randbytes(4) for _ in range(length // size + 1))
        return b"".join(words)[:length]
