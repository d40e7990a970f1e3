"""Starts, commands and stops emulated buses on pseudo-terminals in another process."""

import json
import pickle
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

from gazerig.drivers.errors import SetupError
from gazerig.drivers.process import child_process
from gazerig.sim_mock.devices import Emulated
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.pty.server import MakeSurroundings, ServerSettings

STOP_S = 2.0


class PtyBuses:
    """Emulated buses in one process of ``gazerig.sim_mock.pty.server``."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[bytes] | None = None
        self._folder: Path | None = None
        self._asking = threading.Lock()
        self.joints: dict[str, int] = {}
        """Index of each joint in the state of the surroundings; {} without these."""

    def start(
        self,
        devices: Mapping[str, Emulated],
        surroundings: Callable[[Path], MakeSurroundings] | None = None,
    ) -> dict[str, str]:
        """Start it; return the path of each bus, which does not change when it is unplugged.

        Args:
            devices: the device of each bus, by its name; a single bus may have the name "".
            surroundings: returns the surroundings of all servos, given a folder for their files.

        Raises:
            SetupError: the surroundings cannot be used; the message gives the reason.
            RuntimeError: the server did not start; its message is on standard error.
        """
        self._folder = folder = Path(tempfile.mkdtemp(prefix="gazerig-servos-"))
        around = None if surroundings is None else surroundings(folder)
        buses = tuple(
            BusSettings(device, name, link=str(folder / f"tty{k}"))
            for k, (name, device) in enumerate(devices.items())
        )
        settings = folder / "settings"
        settings.write_bytes(pickle.dumps(ServerSettings(buses, True, around)))
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
            return {name: str(self._read_answer()["path"]) for name in devices}
        except BaseException:
            self.stop()
            raise

    @property
    def folder(self) -> Path:
        """Return the folder of the terminals and of the surroundings."""
        if self._folder is None:
            raise RuntimeError("the emulated bus is not running: start it first")
        return self._folder

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
                return str(self._read_answer()["ok"])
            except (SetupError, RuntimeError) as error:
                raise ValueError(str(error)) from None

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
            shutil.rmtree(self._folder, ignore_errors=True)
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
