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
from collections import deque
from collections.abc import Callable, Container
from pathlib import Path
from typing import NamedTuple

from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import ORDERS, REQUESTS
from gazerig.robot.net import socket_io as remote_socket
from gazerig.robot.net.excess import (
    CLOSED,
    REST_S,
    STOPPED,
    TOO_MANY,
    ExcessCount,
    TokenBucket,
    find_stop,
)
from gazerig.robot.net.request_handler import RequestHandler, is_stop
from gazerig.robot.net.socket_io import (
    REQUEST_BYTES,
    Listener,
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


class WaitingRequest(NamedTuple):
    """A request, or the answer to one that is already decided, in the order of arrival."""

    request: object
    answer: dict[str, object] | None = None


class RequestsAhead:
    """The requests of one program that were received and not answered yet; thread-safe."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._waiting: deque[WaitingRequest] = deque()
        self._over = False

    @property
    def is_full(self) -> bool:
        """Return whether too much waits; answers wait if the program does not read them."""
        return len(self._waiting) >= MOST_AHEAD

    def add_request(self, request: object) -> None:
        """Add a request."""
        with self._changed:
            self._waiting.append(WaitingRequest(request))
            self._changed.notify()

    def add_answer(self, answer: dict[str, object], times: int = 1) -> None:
        """Add an answer, which is sent after those of the earlier requests."""
        with self._changed:
            self._waiting.extend([WaitingRequest(None, answer)] * times)
            self._changed.notify()

    def refuse(self, reason: str, names: Container[str]) -> None:
        """Refuse all requests with these names that wait."""
        with self._changed:
            kept = list(self._waiting)
            self._waiting.clear()
            for one in kept:
                match one.request:
                    case {"do": str(name), **rest} if name in names:
                        tag = {"tag": rest["tag"]} if "tag" in rest else {}
                        self._waiting.append(WaitingRequest(None, {"refused": reason, **tag}))
                    case _:
                        self._waiting.append(one)

    def end(self) -> None:
        """Mark the end: no request follows."""
        with self._changed:
            self._over = True
            self._changed.notify()

    def wait_for_end(self, within_s: float) -> None:
        """Wait until no request can follow."""
        with self._changed:
            self._changed.wait_for(lambda: self._over, within_s)

    def take(self) -> WaitingRequest | None:
        """Wait for the next request and remove it; return None after the last one."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._over)
            if not self._waiting:
                return None
            return self._waiting.popleft()


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
        self._budget = TokenBucket(*ALL)
        self.path: Path | None = None
        self._listener: Listener | None = None
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
        folder = remote_socket.socket_folder(os.environ, uid)
        remote_socket.make_private(folder, uid)
        remote_socket.remove_dead_sockets(folder)
        with _NAMING:
            self.path = remote_socket.unused_path(folder, os.getpid())
            self._listener = remote_socket.listen(self.path)
        self._start(self._accept, self._listener)
        return self.path

    def serve(self, end: socket.socket) -> None:
        """Answer the requests of the page's process, which names its clients itself."""
        wire = Wire(end, REQUEST_BYTES)
        with self._lock:
            self._wires[wire] = None
        if not self._start(self._serve, wire, ""):
            wire.close()

    def close(self) -> None:
        """Close all connections and remove the socket."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)
        with self._lock:
            self._over = True
            listener, self._listener = self._listener, None
        if listener is not None:
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
            if self._over:
                return False
            self._threads = [t for t in self._threads if t.is_alive()] + [thread]
            thread.start()
        return True

    def _accept(self, listener: Listener) -> None:
        """Start a thread for every program that connects."""
        while not self._over:
            try:
                end = listener.accept()
            except OSError:  # it was closed
                return
            self._admit(end, listener)

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
            if self._over:  # closed meanwhile: this connection would stay open
                wire.close()
                return
            if len(self._wires) >= _MOST:
                # A client that wants to stop the head must always be accepted.
                quietest = next(iter(self._wires))
                del self._wires[quietest]
                quietest.close()
            self._wires[wire] = None
        peer = f"process {caller.pid}"
        self._start(self._serve, wire, peer)

    def _serve(self, wire: Wire, peer: str) -> None:
        """Receive the requests of one program until it disconnects; a second thread answers them.

        So a stop is executed at once, whatever the program has sent before it.
        """
        ahead = RequestsAhead()
        if not self._start(self._answer_all, wire, peer, ahead):
            wire.close()
            return
        excess = ExcessCount()
        try:
            while not excess.is_over and self._receive(wire, peer, ahead, excess):
                pass
            if excess.is_over:
                ahead.refuse(CLOSED, REQUESTS)
                ahead.add_answer({"refused": CLOSED})
                self._receive_for(REST_S, wire, peer, ahead, excess)
        finally:
            ahead.end()
        if excess.is_over:  # stops, while the other thread sends the last answers
            self._receive_for(REST_S, wire, peer, ahead, excess)
            wire.close()

    def _receive_for(
        self, seconds: float, wire: Wire, peer: str, ahead: RequestsAhead, excess: ExcessCount
    ) -> None:
        end_s = self._clock.now_s() + seconds
        while (left_s := end_s - self._clock.now_s()) > 0.0:
            if not self._receive(wire, peer, ahead, excess, left_s):
                break

    def _receive(
        self,
        wire: Wire,
        peer: str,
        ahead: RequestsAhead,
        excess: ExcessCount,
        within_s: float | None = None,
    ) -> bool:
        """Receive one line, and execute a stop; return whether another line can follow."""
        if ahead.is_full or excess.is_over:
            late_lines = wire.drop_lines(find_stop)
            excess.add(late_lines, self._clock.now_s())
            if not excess.is_over:
                ahead.add_answer(_TOO_MANY, late_lines)
            if not wire.has_line:  # let other threads work between two packets
                self._clock.sleep_until(self._clock.now_s() + _PAUSE_S)
        try:
            line = wire.read_line(within_s, _REST_S)
            late = ahead.is_full or excess.is_over
            excess.add(late, self._clock.now_s())
            with self._lock:
                if wire in self._wires:
                    self._wires[wire] = self._wires.pop(wire)
            request = parse_line(line) if not late or find_stop(line) >= 0 else None
        except MalformedMessage as error:
            if not excess.is_over:
                ahead.add_answer({"refused": str(error)})
            return not error.over
        except (EOFError, OSError) as error:
            return isinstance(error, TimeoutError)
        if is_stop(request):
            # A resume from before a stop must not be executed after it.
            ahead.refuse(STOPPED, ORDERS)
            ahead.add_answer(self._execute(request, peer))
        elif not late:
            ahead.add_request(request)
        elif not excess.is_over:
            ahead.add_answer(_TOO_MANY)
        return True

    def _answer_all(self, wire: Wire, peer: str, ahead: "RequestsAhead") -> None:
        """Answer the requests of one program in their order."""
        own = TokenBucket(*EACH)
        try:
            while (waiting := ahead.take()) is not None:
                answer = waiting.answer
                if answer is None and (text := self._delay(own)):
                    answer = {"refused": text}
                began_s = time.thread_time()
                if not self._answer(wire, answer or self._execute(waiting.request, peer)):
                    return
                for budget in (own, self._budget):
                    budget.spend(time.thread_time() - began_s)
        finally:
            # A client that has closed, or reads nothing, may have sent a stop before.
            ahead.wait_for_end(REST_S)
            with self._lock:
                self._wires.pop(wire, None)
            wire.close()

    def _execute(self, request: object, peer: str) -> dict[str, object]:
        """Execute a request; return its answer."""
        try:
            return self._requests.answer(request, peer)
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
