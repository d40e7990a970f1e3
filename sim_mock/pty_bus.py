"""An emulated chain on a pseudo-terminal, served by a process of its own.

A server in a thread of the client's process would fight it for the interpreter lock.
``python -m sim_mock.pty_bus '[[1, "xl330-m077", 2048], ...]'`` prints one JSON line with
the terminal's path and serves until its standard input closes or SIGTERM comes. Imports
nothing heavy, so that it is up within a tenth of a second. Any baud rate is understood.
"""

import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
import tty
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from sim_mock.servo import ServoSpec
from sim_mock.servo_chain import ServoChain, build_chain

GAP_S = 0.05
"""On a real line 1.5 ms; here the host's scheduler may tear a packet apart for longer."""

STOP_S = 2.0
ROOT = Path(__file__).parents[1]


class PtyBus:
    """The client's side: starts the server and knows the terminal's path."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[bytes] | None = None

    def start(self, specs: Sequence[ServoSpec | tuple[int, str, float]]) -> str:
        """Start a server for these servos; gives the path to open as a serial port."""
        command = [sys.executable, "-m", "sim_mock.pty_bus", json.dumps(specs)]
        self._server = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        line = self._server.stdout.readline() if self._server.stdout else b""
        if not line:
            self.stop()
            raise RuntimeError("the emulated bus did not start: its message is above")
        return str(json.loads(line)["path"])

    def stop(self) -> None:
        """End the server; safe to call twice."""
        if self._server is None:
            return
        server, self._server = self._server, None
        for pipe in (server.stdin, server.stdout):
            if pipe is not None:
                pipe.close()
        try:
            server.wait(STOP_S)
        except subprocess.TimeoutExpired:
            server.kill()
            server.wait()

    def __enter__(self) -> "PtyBus":
        """Nothing is started before ``start``."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the server."""
        self.stop()


def serve(chain: ServoChain, master: int, ending: int) -> None:
    """Pass bytes between a terminal and the chain until ``ending`` closes."""
    os.set_blocking(master, False)
    while True:
        ready, _, _ = select.select((master, ending), (), ())
        if ending in ready and not os.read(ending, 4096):
            return
        if master in ready:
            _send(master, chain.receive(os.read(master, 4096)))


def _send(master: int, answer: bytes) -> None:
    """Write an answer; what a full terminal does not take is lost, as on a wire."""
    try:
        os.write(master, answer)
    except BlockingIOError:
        return


def main() -> None:
    """Serve the servos named on the command line."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    chain = build_chain(json.loads(sys.argv[1]), time.monotonic, packet_gap_s=GAP_S)
    master, slave = pty.openpty()
    # Raw, and the slave kept open: else it echoes, and fails between two clients.
    tty.setraw(slave)
    sys.stdout.write(json.dumps({"path": os.ttyname(slave)}) + "\n")
    sys.stdout.flush()
    serve(chain, master, sys.stdin.fileno())


if __name__ == "__main__":
    main()
