"""All that can go wrong on an emulated line, whatever device is at its other end.

Every method does one thing and says what it did. What happens to answers lasts for
``count`` of them, for ``seconds`` of the device's time, or until ``clear``; the id None
stands for every servo. ``command`` takes the same as a line of text.
"""

import json
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Protocol

from gazerig.sim_mock.device import Reply
from gazerig.sim_mock.faults.active import NOBODY, ActiveFaults, Fault
from gazerig.sim_mock.faults.grammar import Commands
from gazerig.sim_mock.replies import Piece


class Struck(Protocol):
    """What faults need of the device they strike."""

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

    def __init__(self, chain: Struck, commands: Commands, seed: int, header: bytes) -> None:
        self._chain = chain
        self.commands = commands
        self.wire = ActiveFaults(seed, header)

    @abstractmethod
    def reports(self) -> list[dict[str, object]]:
        """Return the state of every servo, for ``status``."""

    def board(self) -> dict[str, object]:
        """Return what else ``status`` tells, where there is more than servos."""
        return {}

    def command(self, text: str) -> str:
        """Carry out a line such as ``lose 3 count 2``; return what was done.

        Raises:
            ValueError: names the word that is wrong and what would be right.
        """
        return self.commands.obey(self, text)

    def who(self, servo_id: int | None) -> str:
        """Name a servo for people."""
        return "everybody" if servo_id is None else f"{self.noun} {servo_id}"

    def _begin(
        self,
        kind: str,
        servo_id: int | None,
        says: str,
        count: int | None,
        seconds: float | None,
        numbers: tuple[float, ...] = (),
        data: bytes | None = None,
    ) -> str:
        if servo_id is not None:
            self._chain.here(servo_id)
        until_s = None if seconds is None else self._chain.now_s() + seconds
        self.wire.add(Fault(kind, servo_id, numbers, data, count, until_s))
        span = "" if count is None else f" {count} times"
        span += "" if seconds is None else f" for {seconds:g} s"
        return says + (span or " until cleared")

    # --- what arrives of an answer

    def lose(
        self, servo_id: int | None, count: int | None = None, seconds: float | None = None
    ) -> str:
        """Let a servo stay silent though it obeys."""
        says = f"{self.who(servo_id)} does not answer"
        return self._begin("lose", servo_id, says, count, seconds)

    def delay(
        self,
        servo_id: int | None,
        ms: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers come late; in a group those behind wait as well."""
        says = f"{self.who(servo_id)} answers {ms:g} ms late"
        return self._begin("delay", servo_id, says, count, seconds, (ms,))

    def truncate(
        self,
        servo_id: int | None,
        kept: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let only the first bytes of answers arrive."""
        says = f"only {kept} bytes arrive of what {self.who(servo_id)} answers"
        return self._begin("truncate", servo_id, says, count, seconds, (kept,))

    def duplicate(
        self, servo_id: int | None, count: int | None = None, seconds: float | None = None
    ) -> str:
        """Let answers arrive twice."""
        says = f"what {self.who(servo_id)} answers arrives twice"
        return self._begin("duplicate", servo_id, says, count, seconds)

    def corrupt(
        self,
        servo_id: int | None,
        bit: int | None = None,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Flip one bit of answers, counted from the first byte's lowest; at random where None."""
        numbers = () if bit is None else (float(bit),)
        says = f"a bit flips in what {self.who(servo_id)} answers"
        return self._begin("corrupt", servo_id, says, count, seconds, numbers)

    def drop(
        self,
        servo_id: int | None,
        byte: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let one byte of answers be lost, 0 for the first, -1 for the last."""
        says = f"byte {byte} is lost of what {self.who(servo_id)} answers"
        return self._begin("drop", servo_id, says, count, seconds, (byte,))

    def stall(
        self,
        servo_id: int | None,
        ms: float,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers stop half-way for a while."""
        says = f"{self.who(servo_id)} stops for {ms:g} ms half-way through its answer"
        return self._begin("stall", servo_id, says, count, seconds, (ms,))

    def noise(
        self,
        where: str,
        data: bytes | None = None,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Put bytes (None: eight random ones) ``before`` or ``after`` whatever is answered."""
        if where not in ("before", "after"):
            raise ValueError(f"noise {where!r}: it can be before or after the answer")
        what = "random bytes" if data is None else data.hex(" ")
        says = f"noise ({what}) {where} answers"
        return self._begin(f"noise_{where}", None, says, count, seconds, (), data)

    def static(self, percent: float, count: int | None = None, seconds: float | None = None) -> str:
        """Let a share of all bytes be changed, lost or doubled by noise, in both directions."""
        says = f"noise hits {percent:g} % of all bytes, to and fro"
        return self._begin("static", None, says, count, seconds, (percent / 100.0,))

    def repeat(self, count: int | None = None, seconds: float | None = None) -> str:
        """Let what was answered before arrive once more before the next answer."""
        says = "the answers of before arrive again before the next ones"
        return self._begin("repeat", None, says, count, seconds)

    def fragment(
        self,
        servo_id: int | None = None,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Put a header without a packet before the real one."""
        says = f"a loose header before what {self.who(servo_id)} answers"
        return self._begin("fragment", servo_id, says, count, seconds)

    def reorder(self, count: int | None = None, seconds: float | None = None) -> str:
        """Let the answers of a group come in the wrong order."""
        return self._begin("reorder", None, "groups answer in reverse order", count, seconds)

    # --- what a servo says

    def wrong_id(
        self,
        servo_id: int | None,
        other: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers carry another id, with a right CRC."""
        says = f"{self.who(servo_id)} answers as {other}"
        return self._begin("wrong_id", servo_id, says, count, seconds, (other,))

    def short(
        self,
        servo_id: int | None,
        fewer: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers hold fewer parameter bytes, with a right CRC and no error."""
        says = f"{self.who(servo_id)} answers {fewer} bytes too few"
        return self._begin("short", servo_id, says, count, seconds, (fewer,))

    def long(
        self,
        servo_id: int | None,
        more: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers hold more parameter bytes, with a right CRC and no error."""
        says = f"{self.who(servo_id)} answers {more} bytes too many"
        return self._begin("long", servo_id, says, count, seconds, (more,))

    def refuse(
        self,
        servo_id: int | None,
        number: int,
        count: int | None = None,
        seconds: float | None = None,
    ) -> str:
        """Let answers carry an error number and no parameters."""
        says = f"{self.who(servo_id)} answers with error {number} and no data"
        return self._begin("refuse", servo_id, says, count, seconds, (number,))

    # --- what the line does

    def echo(self, on: bool = True, seconds: float | None = None) -> str:
        """Let the host hear its own bytes."""
        return self._switch("echo", on, "the line echoes the host", seconds)

    def babble(self, on: bool = True, seconds: float | None = None) -> str:
        """Let a broken node send headers and noise all the time."""
        return self._switch("babble", on, "a broken node babbles", seconds)

    def lose_writes(self, count: int | None = None, seconds: float | None = None) -> str:
        """Let sync and bulk writes be lost on their way; no status tells."""
        return self._begin("lose_writes", None, "group writes are lost", count, seconds)

    def unplug(self, seconds: float | None = None) -> str:
        """Pull the adapter out of the host."""
        return self._switch("unplug", True, "unplugged", seconds)

    def plug(self) -> str:
        """Put the adapter back."""
        return self._switch("unplug", False, "unplugged", None)

    def deny(self, on: bool = True, seconds: float | None = None) -> str:
        """Let opening the port be forbidden."""
        return self._switch("deny", on, "opening is forbidden", seconds)

    def block(self, on: bool = True, seconds: float | None = None) -> str:
        """Let the adapter take no bytes: its buffer is full and stays so."""
        return self._switch("block", on, "the adapter takes no bytes", seconds)

    def _switch(self, kind: str, on: bool, says: str, seconds: float | None) -> str:
        self.wire.remove(kind)
        if on:
            return self._begin(kind, None, says, None, seconds)
        return f"no longer: {says}"

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
        """End every fault of the line (of one servo's answers); what servos suffered stays."""
        return f"{self.wire.remove(None, servo_id)} faults cleared"

    def status(self) -> str:
        """Return all servos and the faults in force as one line of JSON."""
        faults = [
            f"{fault.kind} {'all' if fault.servo_id is None else fault.servo_id}"
            for fault in self.wire.listed(self._chain.now_s())
        ]
        return json.dumps({"servos": self.reports(), **self.board(), "faults": faults})

    def around(self, replies: list[Reply], data: bytes) -> list[Reply]:
        """Let the host hear itself and a babbling node, where the line has such faults."""
        now_s = self._chain.now_s()
        if self.wire.on("echo", now_s):
            replies.insert(0, Reply(len(data), [Piece(NOBODY, data)]))
        babble = self.wire.babble(now_s)
        if babble:
            replies.insert(0, Reply(0, [Piece(NOBODY, babble)]))
        return replies
