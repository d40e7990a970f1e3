"""Server of a running rig's remote control: a thread for each connected program.

The threads never touch the control loop: they use the tuning and queue commands, which the loop
executes at its next tick. A program that sends malformed data, stops within a request or reads no
answers only occupies a thread.
"""

import os
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from gazerig.robot.model.clock import RealClock
from gazerig.robot.remote import socket_io as remote_socket
from gazerig.robot.remote.request_handler import RequestHandler, is_stop
from gazerig.robot.remote.socket_io import REQUEST_BYTES, Listener, MalformedMessage, Wire


class RequestRate(NamedTuple):
    """Share of one processor, and the largest burst, s."""

    share: float
    burst_s: float


EACH = RequestRate(0.06, 0.2)
ALL = RequestRate(0.1, 0.4)


class ProcessorBudget:
    """Token bucket of processor time.

    Args:
        rate: Share and size of the bucket.
        now_s: Time of the start, at which it is full, s.
    """

    def __init__(self, rate: RequestRate, now_s: float) -> None:
        self._rate = rate
        self._left_s = rate.burst_s
        self._at_s = now_s
        self._lock = threading.Lock()

    def spend(self, used_s: float, now_s: float) -> None:
        """Deduct processor time that was used, even if none is left."""
        with self._lock:
            self._fill(now_s)
            self._left_s -= used_s

    def wait_s(self, now_s: float) -> float:
        """Return the time until the bucket is no longer empty, s."""
        with self._lock:
            self._fill(now_s)
            return max(0.0, -self._left_s / self._rate.share)

    def _fill(self, now_s: float) -> None:
        gained = self._rate.share * max(0.0, now_s - self._at_s)
        self._left_s = min(self._rate.burst_s, self._left_s + gained)
        self._at_s = now_s


_REST_S = 2.0
"""Timeout of the rest of a request, s."""
_TAKES_S = 2.0
"""Timeout of sending an answer, s."""
_LONGEST_WAIT_S = 0.25
"""Longest delay of a program that has used up its processor time, s."""
_MOST = 16
"""Largest number of programs; for one more the least recently active is disconnected."""


_NAMING = threading.Lock()
"""Two heads of one program that start at the same time get two names."""


class RemoteServer:
    """Server that listens while a rig runs.

    Attributes:
        path: Path of the socket, None before ``open``.
    """

    def __init__(self, requests: RequestHandler, say: Callable[[str], None]) -> None:
        self._requests = requests
        self._say = say
        self._clock = RealClock()
        self._budget = ProcessorBudget(ALL, self._clock.now_s())
        self.path: Path | None = None
        self._listener: Listener | None = None
        self._lock = threading.Lock()
        self._wires: dict[Wire, None] = {}  # the least recently active first
        self._threads: list[threading.Thread] = []

    def open(self) -> Path:
        """Start listening, remove the sockets of killed rigs, and return the socket's path.

        Raises:
            SetupError: no socket can be opened; the message names the reason.
        """
        uid = remote_socket.user_id()
        folder = remote_socket.socket_folder(os.environ, uid)
        remote_socket.make_private(folder, uid)
        remote_socket.remove_dead_sockets(folder)
        with _NAMING:
            self.path = remote_socket.unused_path(folder, os.getpid())
            self._listener = remote_socket.listen(self.path)
        self._start(self._accept, self._listener)
        return self.path

    def close(self) -> None:
        """Close all connections and remove the socket."""
        if self._listener is None or self.path is None:
            return
        self.path.unlink(missing_ok=True)
        listener, self._listener = self._listener, None
        listener.close()
        with self._lock:
            for wire in self._wires:
                wire.close()
            threads = tuple(self._threads)
        for thread in threads:
            thread.join(timeout=2.0)

    def _start(self, work: Callable[..., None], *words: object) -> bool:
        """Start a thread unless the server was closed; return whether it was started."""
        thread = threading.Thread(target=work, args=words, name="remote control", daemon=True)
        with self._lock:
            if self._listener is None:
                return False
            self._threads = [t for t in self._threads if t.is_alive()] + [thread]
            thread.start()
        return True

    def _accept(self, listener: Listener) -> None:
        """Start a thread for every program that connects."""
        while self._listener is not None:
            try:
                end = listener.accept()
            except OSError:  # it was closed
                return
            if not listener.waits_for_token:  # accept programs in the order of arrival
                self._admit(end, listener)
            elif not self._start(self._admit, end, listener):
                end.close()

    def _admit(self, end: socket.socket, listener: Listener) -> None:
        """Accept a program if it belongs to this user."""
        try:
            caller = listener.identify(end)
        except OSError:  # gone already
            caller = None
        if caller is None:
            end.close()
            return
        wire = Wire(end, REQUEST_BYTES)
        with self._lock:
            if self._listener is None:  # closed meanwhile: this connection would stay open
                wire.close()
                return
            if len(self._wires) >= _MOST:
                # A client that wants to stop the head must always be accepted.
                quietest = next(iter(self._wires))
                del self._wires[quietest]
                quietest.close()
            self._wires[wire] = None
        peer = f"process {caller.pid}" if caller.pid else "another program"
        self._start(self._serve, wire, peer)

    def _serve(self, wire: Wire, peer: str) -> None:
        """Answer one program until it disconnects or its data cannot be parsed."""
        own = ProcessorBudget(EACH, self._clock.now_s())
        try:
            while self._serve_request(wire, peer, own):
                pass
        finally:
            with self._lock:
                self._wires.pop(wire, None)
            wire.close()

    def _serve_request(self, wire: Wire, peer: str, own: ProcessorBudget) -> bool:
        """Answer one request; return whether another can follow."""
        try:
            request = wire.read(None, _REST_S)
        except MalformedMessage as error:
            return self._answer(wire, {"refused": str(error)}) and not error.over
        except (EOFError, OSError):
            return False
        with self._lock:
            if wire in self._wires:
                self._wires[wire] = self._wires.pop(wire)
        if not is_stop(request) and (text := self._delay(own)):
            return self._answer(wire, {"refused": text})
        began_s = time.thread_time()
        try:
            answer = self._requests.answer(request, peer)
        except Exception as error:
            # An internal error in one request must not end the remote control, which stops need.
            answer = {"failed": f"{type(error).__name__}: {error}"}
            self._say(f"remote control: {request!r:.200} failed: {answer['failed']}")
        taken = self._answer(wire, answer)
        used_s, now_s = time.thread_time() - began_s, self._clock.now_s()
        own.spend(used_s, now_s)
        self._budget.spend(used_s, now_s)
        return taken

    def _delay(self, own: ProcessorBudget) -> str:
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
