"""The client's side of an emulated bus on a pseudo-terminal: starts, commands and ends it."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType

from sim_mock.servo import ServoSpec

STOP_S = 2.0
ROOT = Path(__file__).parents[1]


class PtyBus:
    """A server process of ``sim_mock.emulate`` and the terminal it serves."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[bytes] | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def start(
        self,
        specs: Sequence[ServoSpec | tuple[int, str, float]],
        baud: int | None = None,
        wire_time: bool = False,
        turnaround_us: float = 0.0,
        choices: Mapping[str, str] | None = None,
    ) -> str:
        """Start a server for these servos; gives the path to open as a serial port.

        The path stays the same over ``unplug`` and ``plug``. The rest as in
        sim_mock.emulate.Settings.

        Raises:
            RuntimeError: the server did not start; its message is on standard error.
        """
        self._folder = tempfile.TemporaryDirectory(prefix="servo-bus-")
        settings = {
            "servos": [list(spec) for spec in specs],
            "baud": baud,
            "wire_time": wire_time,
            "turnaround_us": turnaround_us,
            "link": str(Path(self._folder.name) / "tty"),
            "until_eof": True,
            "choices": dict(choices or {}),
        }
        self._server = subprocess.Popen(
            [sys.executable, "-m", "sim_mock.emulate", json.dumps(settings)],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # Ctrl-C and timeouts go to a whole group: the servos must outlive their client's
            # way out. They end when their standard input does.
            start_new_session=True,
        )
        line = self._hear()
        if not line:
            self.stop()
            raise RuntimeError("the emulated bus did not start: its message is above")
        return str(json.loads(line)["path"])

    @property
    def pid(self) -> int:
        """Give the server's process id."""
        if self._server is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        return self._server.pid

    def command(self, text: str) -> str:
        """Carry out a fault command in the server; gives what it did.

        Raises:
            ValueError: names the word that is wrong and what would be right.
            RuntimeError: the server is not running.
        """
        if self._server is None or self._server.stdin is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        self._server.stdin.write(text.replace("\n", " ").encode() + b"\n")
        self._server.stdin.flush()
        answer = json.loads(self._hear() or '{"error": "the emulated bus has ended"}')
        if "error" in answer:
            raise ValueError(answer["error"])
        return json.dumps(answer) if len(answer) > 1 else str(answer["ok"])

    def _hear(self) -> bytes:
        assert self._server is not None and self._server.stdout is not None
        return self._server.stdout.readline()

    def stop(self) -> None:
        """End the server; safe to call twice."""
        if self._server is not None:
            server, self._server = self._server, None
            for pipe in (server.stdin, server.stdout):
                if pipe is not None:
                    pipe.close()
            try:
                server.wait(STOP_S)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

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
