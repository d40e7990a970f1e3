"""Server of a running rig's remote control: two threads for each connected program.

One receives the requests and executes stops at once, the other one answers the rest in order.

The threads never touch the control loop: they use the tuning and queue commands, which the loop
executes at its next tick. A program that sends malformed data, stops within a request or reads no
answers only occupies a thread. What is too much is dropped a packet at a time, with a pause.
"""

import os
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import ORDERS
from gazerig.robot.net import socket_io
from gazerig.robot.net.excess import (
    CLOSED,
    REST_S,
    STOPPED,
    TOO_MANY,
    ExcessCount,
    TokenBucket,
    find_stop,
    is_stop,
)
from gazerig.robot.net.socket_io import (
    REQUEST_BYTES,
    MalformedMessage,
    Wire,
    parse_line,
)

EACH, ALL = (0.06, 0.2), (0.1, 0.4)
"""Share of one processor that one program may use, and all together; and the largest burst, s."""
_REST_S = 2.0
"""Timeout of the rest of a request, s."""
_TAKES_S = 2.0
"""Timeout of sending an answer, s."""
_LONGEST_WAIT_S = 0.25
"""Longest delay of a program that has used up its processor time, s."""
_MOST = 16
"""Largest number of programs; for one more the least recently active is disconnected."""


MOST_AHEAD = 64
"""Largest number of requests of one program that wait for their answers; more are refused."""
_TOO_MANY: dict[str, object] = {"refused": f"{TOO_MANY}: {MOST_AHEAD} wait for their answers"}
_PAUSE_S = 0.005
"""Pause between two packets of a program that sends more."""


class _Waiting(NamedTuple):
    """A request, or an answer that is already decided; stops: stops before it."""

    request: Any
    answer: dict[str, object] | None
    stops: int


class _Program:
    """A connected program, and its requests that were received and not answered yet.

    Attributes:
        waiting: Requests and decided answers in the order of arrival; None after the last one.
        stops: Number of stops received.
        excess: Count of its messages that were too many.
        received: Set when no request can follow.
    """

    def __init__(self, wire: Wire, peer: str) -> None:
        self.wire, self.peer = wire, peer
        self.waiting: SimpleQueue[_Waiting | None] = SimpleQueue()
        self.stops = 0
        self.excess = ExcessCount()
        self.received = threading.Event()

    @property
    def is_full(self) -> bool:
        """Return whether too much waits; answers wait if the program does not read them."""
        return self.waiting.qsize() >= MOST_AHEAD

    def add(self, request: object, answer: dict[str, object] | None = None) -> None:
        """Add a request, or an answer, which is sent after those of the earlier requests."""
        self.waiting.put(_Waiting(request, answer, self.stops))

    def refusal(self, waiting: _Waiting) -> str:
        """Return why a request is refused after what has arrived since, "" if it is not."""
        if self.excess.is_over:
            return CLOSED
        # A resume from before a stop must not be executed after it.
        is_order = isinstance(waiting.request, dict) and waiting.request.get("do") in ORDERS
        return STOPPED if is_order and waiting.stops < self.stops else ""


_NAMING = threading.Lock()
"""Two heads of one program that start at the same time get two names."""


class RemoteServer:
    """Server that listens while a rig runs.

    Args:
        answer: Executes a request of a peer, "" for the page; returns the answer.
        say: Prints a line on the terminal.

    Attributes:
        path: Path of the socket, None before ``open``.
    """

    def __init__(
        self, answer: Callable[[object, str], dict[str, object]], say: Callable[[str], None]
    ) -> None:
        self._answer_request, self._say = answer, say
        self._clock = RealClock()
        self._budget = TokenBucket(*ALL)
        self.path: Path | None = None
        self._listener: socket.socket | None = None
        self._lock = threading.Lock()
        self._wires: dict[Wire, None] = {}  # the least recently active first
        self._over = False
        self._threads: list[threading.Thread] = []

    def open(self) -> Path:
        """Start listening, remove the sockets of killed rigs, and return the socket's path.

        Raises:
            SetupError: no socket can be opened; the message names the reason.
        """
        uid = os.getuid()
        folder = socket_io.socket_folder(os.environ, uid)
        socket_io.make_private(folder, uid)
        socket_io.remove_dead_sockets(folder)
        with _NAMING:
            self.path = socket_io.unused_path(folder, os.getpid())
            self._listener = socket_io.listen(self.path)
        self._start(self._accept, self._listener)
        return self.path

    def serve(self, end: socket.socket) -> None:
        """Answer the requests of the page's process, which names its clients itself."""
        self._admit(end, "")

    def close(self) -> None:
        """Send the last answers, close all connections and remove the socket."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
        with self._lock:
            self._over = True
            if self._listener is not None:
                socket_io.shut(self._listener)
            for wire in self._wires:
                wire.stop_reading()
        for thread in self._threads:  # no more are started; each ends its connection
            thread.join(timeout=2.0)

    def _start(self, work: Callable[..., None], *words: object) -> bool:
        """Start a thread unless the server was closed; return whether it was started."""
        thread = threading.Thread(target=work, args=words, name="remote control", daemon=True)
        with self._lock:
            if self._over:
                return False
            self._threads = [t for t in self._threads if t.is_alive()] + [thread]
            thread.start()
        return True

    def _accept(self, listener: socket.socket) -> None:
        """Accept the programs of this user that connect."""
        while not self._over:
            try:
                end, _ = listener.accept()
            except OSError:  # it was closed
                return
            if (pid := socket_io.peer_pid(end)) is None:
                end.close()
            else:
                self._admit(end, f"process {pid}")

    def _admit(self, end: socket.socket, peer: str) -> None:
        """Answer a program's requests; one too many replaces the least recently active."""
        wire = Wire(end, REQUEST_BYTES)
        with self._lock:
            if len(self._wires) >= _MOST:
                # A client that wants to stop the head must always be accepted.
                quietest = next(iter(self._wires))
                del self._wires[quietest]
                quietest.close()
            self._wires[wire] = None
        if not self._start(self._serve, _Program(wire, peer)):
            wire.close()

    def _serve(self, program: _Program) -> None:
        """Receive the requests of one program until it disconnects; a second thread answers them.

        So a stop is executed at once, whatever the program has sent before it.
        """
        if not self._start(self._answer_all, program):
            program.wire.close()
            return
        try:
            while not program.excess.is_over and self._receive(program):
                pass
            if program.excess.is_over:  # only stops, while the other thread sends the last answers
                program.add(None, {"refused": CLOSED})
                end_s = self._clock.now_s() + REST_S
                while (left_s := end_s - self._clock.now_s()) > 0.0:
                    if not self._receive(program, left_s):
                        break
        finally:
            program.received.set()
            program.waiting.put(None)

    def _receive(self, program: _Program, within_s: float | None = None) -> bool:
        """Receive one line, and execute a stop; return whether another line can follow."""
        wire, excess = program.wire, program.excess
        if program.is_full or excess.is_over:
            late_lines = wire.drop_lines(find_stop)
            excess.add(late_lines, self._clock.now_s())
            if not excess.is_over:
                for _ in range(late_lines):
                    program.add(None, _TOO_MANY)
            if not wire.has_line:  # let other threads work between two packets
                self._clock.sleep_until(self._clock.now_s() + _PAUSE_S)
        try:
            line = wire.read_line(within_s, _REST_S)
            late = program.is_full or excess.is_over
            excess.add(late, self._clock.now_s())
            with self._lock:
                if wire in self._wires:
                    self._wires[wire] = self._wires.pop(wire)
            request = parse_line(line) if not late or find_stop(line) >= 0 else None
        except MalformedMessage as error:
            if not excess.is_over:
                program.add(None, {"refused": str(error)})
            return not error.over
        except (EOFError, OSError) as error:
            return isinstance(error, TimeoutError)
        if is_stop(request):
            program.stops += 1
            program.add(None, self._execute(request, program.peer))
        elif not late:
            program.add(request)
        elif not excess.is_over:
            program.add(None, _TOO_MANY)
        return True

    def _answer_all(self, program: _Program) -> None:
        """Answer the requests of one program in their order."""
        own = TokenBucket(*EACH)
        try:
            while (waiting := program.waiting.get()) is not None:
                answer = waiting.answer
                if answer is None and self._over:
                    continue
                if answer is None and (refused := self._delay(own) or program.refusal(waiting)):
                    tag = waiting.request.get("tag") if isinstance(waiting.request, dict) else None
                    answer = {"refused": refused} | ({"tag": tag} if tag is not None else {})
                began_s = time.thread_time()
                if not self._answer(
                    program.wire, answer or self._execute(waiting.request, program.peer)
                ):
                    return
                for budget in (own, self._budget):
                    budget.spend(time.thread_time() - began_s)
        finally:
            # A client that has closed, or reads nothing, may have sent a stop before.
            program.received.wait(REST_S)
            with self._lock:
                self._wires.pop(program.wire, None)
            program.wire.close()

    def _execute(self, request: object, peer: str) -> dict[str, object]:
        """Execute a request; return its answer."""
        try:
            return self._answer_request(request, peer)
        except Exception as error:
            # An internal error in one request must not end the remote control, which stops need.
            failed = f"{type(error).__name__}: {error}"
            self._say(f"remote control: {request!r:.200} failed: {failed}")
            return {"failed": failed}

    def _delay(self, own: TokenBucket) -> str:
        """Delay a program that uses too much time; return the reason if it is refused."""
        now_s = self._clock.now_s()
        wait_s = max(own.wait_s(now_s), self._budget.wait_s(now_s))
        if wait_s > 0.0:
            self._clock.sleep_until(now_s + min(wait_s, _LONGEST_WAIT_S))
        left_s = wait_s - _LONGEST_WAIT_S
        return f"too many requests: try again in {left_s:.1f} s" if left_s > 0.0 else ""

    def _answer(self, wire: Wire, answer: dict[str, object]) -> bool:
        """Send an answer; return whether it was sent."""
        try:
            try:
                wire.write(answer, _TAKES_S)
            except ValueError as error:
                wire.write({"failed": f"the answer cannot be written as JSON: {error}"}, _TAKES_S)
        except OSError:
            return False
        return True
