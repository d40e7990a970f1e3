"""Starts, commands and stops emulated buses on pseudo-terminals in another process."""

import json
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, Self

from gazerig.drivers.errors import SetupError
from gazerig.drivers.process import child_process
from gazerig.sim_mock.devices import DynamixelLine, Emulated, packed
from gazerig.sim_mock.smart_servo.physics import ServoSpec

if TYPE_CHECKING:
    from gazerig.sim_mock.pty.served_folder import ServedFolder

STOP_S = 2.0


def has_terminals() -> bool:
    """Return whether this system has the pseudo-terminals that servos are emulated on: Linux."""
    try:
        import gazerig.sim_mock.pty.terminal  # noqa: F401
    except ImportError:
        return False
    return sys.platform == "linux"


class SentSurroundings(Protocol):
    """Surroundings that the server's process makes."""

    @property
    def make(self) -> str:
        """Return "module:function", which makes a ``server.ServedSurroundings``.

        It gets the folder, and what returns the host's time in seconds.
        """
        ...

    def write(self, folder: Path) -> None:
        """Write into a folder what that function needs."""
        ...


class _Served:
    """A server process of ``gazerig.sim_mock.pty.server``."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[bytes] | None = None
        self._folder: ServedFolder | None = None
        self._asking = threading.Lock()
        self.joints: list[dict[str, int]] = []
        """Place of each rig's joints in the state of the surroundings; [] without these."""

    def _start(
        self, buses: Sequence[Mapping[str, object]], surroundings: SentSurroundings | None = None
    ) -> list[str]:
        """Start it for these settings of buses; return the path of each."""
        from gazerig.sim_mock.pty.served_folder import ServedFolder  # where there are terminals

        self._folder = ServedFolder()
        folder = self._folder.path
        links = [str(folder / f"tty{k or ''}") for k in range(len(buses))]
        linked = [{**bus, "link": link} for bus, link in zip(buses, links, strict=True)]
        more: dict[str, object] = {}
        if surroundings is not None:
            surroundings.write(folder)
            more["surroundings"] = {"make": surroundings.make, "folder": str(folder)}
        settings = json.dumps({"buses": linked, "until_eof": True, **more})
        self._server = child_process.start(
            # The servos must outlive their client's way out: they end when their input does.
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
        """Carry out a fault command in the server, on the bus of this name; return what it did.

        May be called from any thread.

        Raises:
            ValueError: names the word that is wrong and what would be right.
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
        """Nothing is started before ``start``."""
        return self

    def __exit__(self, *raised: object) -> None:
        """End the server."""
        self.stop()


class PtyBus(_Served):
    """One emulated bus in a process of its own, and the terminal it is on."""

    def start(
        self,
        specs: Sequence[ServoSpec | tuple[int, str, float]],
        baud: int | None = None,
        wire_time: bool = False,
        turnaround_us: float = 0.0,
        choices: Mapping[str, str] | None = None,
    ) -> str:
        """Start a server for Dynamixel servos; return the path to open as a serial port.

        The rest as for ``start_device``.
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

        The path stays the same over ``unplug`` and ``plug``. The rest as in
        gazerig.sim_mock.pty.line.BusSettings.

        Raises:
            RuntimeError: the server did not start; its message is on standard error.
        """
        bus: dict[str, object] = {
            "device": packed(device),
            "wire_time": wire_time,
            "turnaround_us": turnaround_us,
            "choices": dict(choices or {}),
            "seed": seed,
        }
        (path,) = self._start([bus])
        return path


class PtyBuses(_Served):
    """All emulated buses of a rig, or of several in one place, in one process of their own."""

    def start(
        self, devices: Mapping[str, Emulated], surroundings: SentSurroundings | None = None
    ) -> dict[str, str]:
        """Start a server for what is on every bus; return the path of each, by the same names.

        Args:
            devices: by the name of their bus.
            surroundings: in which all their servos are; None: each has mechanics of its own.

        Raises:
            SetupError: the surroundings cannot be used; says why.
            RuntimeError: the server did not start; its message is on standard error.
        """
        return self.start_rigs([("", devices)], surroundings)[0]

    def start_rigs(
        self,
        rigs: Sequence[tuple[str, Mapping[str, Emulated]]],
        surroundings: SentSurroundings | None = None,
    ) -> list[dict[str, str]]:
        """Start a server for the buses of several rigs in one place; return the paths of each.

        Args:
            rigs: in the surroundings' order: a name, "" for the first, which is before the names
                of its buses in commands, and what is on its buses.
            surroundings: as for ``start``.

        Raises:
            SetupError: as ``start``, or two buses would have one name.
            RuntimeError: as ``start``.
        """
        places = [(number, bus) for number, (_, devices) in enumerate(rigs) for bus in devices]
        names = ["_".join(filter(None, (rigs[number][0], bus))) for number, bus in places]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise SetupError(
                f"two buses of this world are named {twice}: rename the head or its bus"
            )
        buses: list[dict[str, object]] = [
            {"name": name, "device": packed(rigs[number][1][bus]), "rig": number, "rig_bus": bus}
            for name, (number, bus) in zip(names, places, strict=True)
        ]
        found: list[dict[str, str]] = [{} for _ in rigs]
        for (number, bus), path in zip(places, self._start(buses, surroundings), strict=True):
            found[number][bus] = path
        return found
