"""Starts, commands and stops emulated buses on pseudo-terminals in another process."""

import json
import subprocess
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol, Self

from gazerig.drivers.errors import SetupError
from gazerig.drivers.process import child_process
from gazerig.drivers.process.own_folder import OwnFolder
from gazerig.sim_mock.devices import DynamixelLine, Emulated, device_data
from gazerig.sim_mock.smart_servo.physics import ServoSpec

STOP_S = 2.0


class SentSurroundings(Protocol):
    """Surroundings that the server's process creates."""

    @property
    def make(self) -> str:
        """Return "module:function", which creates a ``server.ServedSurroundings``.

        Its arguments are the folder and a function that returns the host's time in seconds.
        """
        ...

    def write(self, folder: Path) -> None:
        """Write the data of that function into a folder."""
        ...


class _ServerProcess:
    """A server process of ``gazerig.sim_mock.pty.server``."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[bytes] | None = None
        self._folder: OwnFolder | None = None
        self._asking = threading.Lock()
        self.joints: dict[str, int] = {}
        """Index of each joint in the state of the surroundings; {} without these."""

    def _start(
        self, buses: Sequence[Mapping[str, object]], surroundings: SentSurroundings | None = None
    ) -> list[str]:
        """Start it with these settings of buses; return the path of each."""
        self._folder = OwnFolder("servos")
        folder = self._folder.path
        links = [str(folder / f"tty{k or ''}") for k in range(len(buses))]
        linked = [{**bus, "link": link} for bus, link in zip(buses, links, strict=True)]
        more: dict[str, object] = {}
        if surroundings is not None:
            surroundings.write(folder)
            more["surroundings"] = {"factory": surroundings.make, "folder": str(folder)}
        settings = json.dumps({"buses": linked, "until_eof": True, **more})
        self._server = child_process.start(
            # The servos must outlive their client's shutdown: they end when their input does.
            "gazerig.sim_mock.pty.server",
            settings,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        lines = [self._read_line() for _ in range(len(buses) + (surroundings is not None))]
        said = [json.loads(line) for line in lines if line]
        refused = next((one["error"] for one in said if "error" in one), None)
        if refused is not None or not all(lines):
            self.stop()
            if refused is not None:
                raise SetupError(refused)
            raise RuntimeError("the emulated bus did not start: its message is above")
        if surroundings is not None:
            self.joints = said.pop(0)["joints"]
        return [str(one["path"]) for one in said]

    @property
    def folder(self) -> Path:
        """Return the folder of the terminals and of the surroundings."""
        if self._folder is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        return self._folder.path

    @property
    def pid(self) -> int:
        """Return the server's process id."""
        if self._server is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        return self._server.pid

    def command(self, text: str, bus: str = "") -> str:
        """Run a fault command in the server, on the bus of this name; return its description.

        May be called from any thread.

        Raises:
            ValueError: the command is invalid; the message names the wrong word and valid ones.
            RuntimeError: the server is not running.
        """
        if self._server is None or self._server.stdin is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        line = f"{bus}: {text}" if bus else text
        with self._asking:
            self._server.stdin.write(line.replace("\n", " ").encode() + b"\n")
            self._server.stdin.flush()
            answer = json.loads(self._read_line() or '{"error": "the emulated bus has ended"}')
        if "error" in answer:
            raise ValueError(answer["error"])
        answer.pop("bus", None)
        return json.dumps(answer) if len(answer) > 1 else str(answer["ok"])

    def _read_line(self) -> bytes:
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
            self._folder.remove()
            self._folder = None

    def __enter__(self) -> Self:
        """Return this object; ``start`` starts the server."""
        return self

    def __exit__(self, *raised: object) -> None:
        """End the server."""
        self.stop()


class PtyBus(_ServerProcess):
    """One emulated bus in its own process, and its terminal."""

    def start(
        self,
        specs: Sequence[ServoSpec | tuple[int, str, float]],
        baud: int | None = None,
        wire_time: bool = False,
        turnaround_us: float = 0.0,
        choices: Mapping[str, str] | None = None,
    ) -> str:
        """Start a server for Dynamixel servos; return the path to open as a serial port.

        The other arguments are those of ``start_device``.
        """
        line = DynamixelLine(tuple(ServoSpec(*spec) for spec in specs), baud)
        return self.start_device(line, wire_time, turnaround_us, choices)

    def start_device(
        self,
        device: Emulated,
        wire_time: bool = False,
        turnaround_us: float = 0.0,
        choices: Mapping[str, str] | None = None,
        seed: int = 0,
    ) -> str:
        """Start a server for servos or a board; return the path to open as a serial port.

        The path does not change with ``unplug`` and ``plug``. The other arguments are those of
        gazerig.sim_mock.pty.line.BusSettings.

        Raises:
            RuntimeError: the server did not start; its message is on standard error.
        """
        bus: dict[str, object] = {
            "device": device_data(device),
            "wire_time": wire_time,
            "turnaround_us": turnaround_us,
            "choices": dict(choices or {}),
            "seed": seed,
        }
        (path,) = self._start([bus])
        return path


class PtyBuses(_ServerProcess):
    """All emulated buses of a rig in one process."""

    def start(
        self, devices: Mapping[str, Emulated], surroundings: SentSurroundings | None = None
    ) -> dict[str, str]:
        """Start a server for the devices of every bus; return the path of each, by the same names.

        Raises:
            SetupError: the surroundings cannot be used; the message gives the reason.
            RuntimeError: the server did not start; its message is on standard error.
        """
        buses: list[dict[str, object]] = [
            {"name": name, "device": device_data(device)} for name, device in devices.items()
        ]
        return dict(zip(devices, self._start(buses, surroundings), strict=True))
