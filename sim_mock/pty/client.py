"""Starts, commands and stops emulated buses on pseudo-terminals in another process."""

import json
import pickle
import subprocess
import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

from gazerig.drivers.errors import SetupError
from gazerig.drivers.process import child_process
from gazerig.drivers.process.own_folder import OwnFolder
from gazerig.sim_mock.devices import DynamixelLine, Emulated
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import SentSurroundings, ServerSettings
from gazerig.sim_mock.smart_servo.physics import ServoSpec

STOP_S = 2.0


class ServerProcess:
    """A server process of ``gazerig.sim_mock.pty.server``."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[bytes] | None = None
        self._folder: OwnFolder | None = None
        self._asking = threading.Lock()
        self.joints: dict[str, int] = {}
        """Index of each joint in the state of the surroundings; {} without these."""

    def serve(
        self, buses: Sequence[BusSettings], surroundings: SentSurroundings | None = None
    ) -> list[str]:
        """Start it; return the path of each bus, which does not change when it is unplugged.

        Raises:
            SetupError: the surroundings cannot be used; the message gives the reason.
            RuntimeError: the server did not start; its message is on standard error.
        """
        self._folder = OwnFolder("servos")
        folder = self._folder.path
        around = None if surroundings is None else (surroundings.in_folder(folder), folder)
        linked = tuple(replace(bus, link=str(folder / f"tty{k}")) for k, bus in enumerate(buses))
        settings = folder / "settings"
        settings.write_bytes(pickle.dumps(ServerSettings(linked, True, around)))
        self._server = child_process.start(
            # The servos must outlive their client's shutdown: they end when their input does.
            "gazerig.sim_mock.pty.server",
            str(settings),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        try:
            if surroundings is not None:
                self.joints = self._read_answer()["joints"]
            return [str(self._read_answer()["path"]) for _ in buses]
        except BaseException:
            self.stop()
            raise

    @property
    def folder(self) -> Path:
        """Return the folder of the terminals and of the surroundings."""
        if self._folder is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        return self._folder.path

    @property
    def pid(self) -> int:
        """Return the server's process id."""
        return self._running().pid

    def command(self, text: str, bus: str = "") -> str:
        """Run a fault command in the server, on the bus of this name; return its description.

        May be called from any thread.

        Raises:
            ValueError: the command is invalid; the message names the wrong word and valid ones.
            RuntimeError: the server is not running.
        """
        pipe = self._running().stdin
        assert pipe is not None
        line = f"{bus}: {text}" if bus else text
        with self._asking:
            pipe.write(line.replace("\n", " ").encode() + b"\n")
            pipe.flush()
            try:
                answer = self._read_answer()
            except (SetupError, RuntimeError) as error:
                raise ValueError(str(error)) from None
        answer.pop("bus", None)
        return json.dumps(answer) if len(answer) > 1 else str(answer["ok"])

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

    def _running(self) -> subprocess.Popen[bytes]:
        if self._server is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        return self._server

    def _read_answer(self) -> dict[str, Any]:
        """Return the server's next message; raise SetupError with its message if it refuses."""
        pipe = self._running().stdout
        assert pipe is not None
        line = pipe.readline()
        if not line:
            raise RuntimeError("the emulated bus did not start or has ended: its message is above")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise SetupError(answer["error"])
        return answer


class PtyBus(ServerProcess):
    """One emulated bus in its own process, and its terminal."""

    def start(
        self,
        specs: Sequence[ServoSpec | tuple[int, str, float]],
        baud: int | None = None,
        wire_time: bool = False,
    ) -> str:
        """Start a server for Dynamixel servos; return the path to open as a serial port."""
        line = DynamixelLine(tuple(ServoSpec(*spec) for spec in specs), baud)
        return self.start_device(line, wire_time)

    def start_device(self, device: Emulated, wire_time: bool = False) -> str:
        """Start a server for servos or a board; return the path to open as a serial port."""
        return self.serve([BusSettings(device, wire_time=wire_time)])[0]


class PtyBuses(ServerProcess):
    """All emulated buses of a rig in one process."""

    def start(
        self, devices: Mapping[str, Emulated], surroundings: SentSurroundings | None = None
    ) -> dict[str, str]:
        """Start a server for the devices of every bus; return the path of each, by the same names.

        The errors are those of ``serve``.
        """
        buses = [BusSettings(device, name) for name, device in devices.items()]
        return dict(zip(devices, self.serve(buses, surroundings), strict=True))
