"""A rig that answers other programs, and clients that misbehave."""

import contextlib
import socket
import threading
from collections.abc import Callable, Mapping
from pathlib import Path

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Robot, Tick
from gazerig.robot.model.commands import Tune, Value
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.remote.request_handler import LoopMonitor
from gazerig.robot.remote.socket_server import RemoteServer

RATE = "loop.rate_hz"
BLINKS = "gaze.lids.blinks_per_min"


class Broken(Exception):
    """A broken rule, like gazerig.config.load.ConfigError."""


class SecondTuning:
    """Two parameters with memory; it checks one bound and knows no file."""

    def __init__(self, order: Callable[[Tune], None]) -> None:
        self._order = order
        self._file: dict[str, Value] = {RATE: 200.0, BLINKS: 17.0}
        self._now = dict(self._file)
        self.version = 0
        self.path, self.character_name = Path("/nowhere/my.yaml"), "bold"

    def values(self) -> Mapping[str, Value]:
        return self._now

    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(
                key, key.rpartition(".")[0], "Hz", "a rate", 1.0, 1000.0, (), "number", 17.0, "now"
            )
            for key in self._now
        )

    def get(self, prefix: str) -> Mapping[str, Value]:
        return {key: value for key, value in self._now.items() if key.startswith(prefix)}

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        broken = [
            f"{key}: {value} breaks the rule"
            for key, value in changes.items()
            if not isinstance(value, float) or not 1.0 <= value <= 1000.0
        ]
        if broken:
            raise Broken("\n".join(broken))
        if "bug" in changes:
            raise KeyError("bug")
        self._now |= changes
        self.version += 1
        self._order(Tune(tuple(changes.items())))
        return ("taken",)

    def unsaved(self) -> tuple[ParamChange, ...]:
        return tuple(
            ParamChange(key, str(self._file.get(key)), str(value))
            for key, value in self._now.items()
            if value != self._file.get(key)
        )

    def save(self, path: Path | None = None) -> SavedFile:
        changes = self.unsaved()
        self._file = dict(self._now)
        return SavedFile(path or self.path, None, changes)

    def revert(self) -> tuple[str, ...]:
        self._now = dict(self._file)
        return ()

    def characters(self) -> tuple[str, ...]:
        return ("bold", "shy")

    def apply_character(self, name: str) -> tuple[str, ...]:
        if name not in self.characters():
            raise Broken(f"no character {name!r}")
        return ()


class Beat:
    """A simulated robot whose loop runs in a thread, slowly enough to leave the processor."""

    def __init__(self) -> None:
        made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
        self.robot: Robot = made.robot
        self.clock = made.clock
        self.pulse = LoopMonitor(self.clock)
        self.ticks: list[Tick] = []
        self.hold = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.robot._executor._tune = lambda tune, t_s: (f"tuned {len(tune.changes)}",)

    def __enter__(self) -> "Beat":
        self.robot.start(self.clock)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self.robot.stop()

    def _run(self) -> None:
        slot = 0
        while not self._over.wait(0.002):
            if self.hold.is_set():
                continue
            slot += 1
            self.clock.sleep_until(slot * 0.005)
            self.robot.tick(slot * 0.005, 0.005, self._watch)

    def _watch(self, tick: Tick) -> None:
        self.ticks.append(tick)
        self.pulse.update(tick)


def server_closed(server: RemoteServer) -> bool:
    return server._listener is None


def hung_up(end: socket.socket) -> bool:
    end.settimeout(5.0)
    with contextlib.suppress(ConnectionError):
        return end.recv(100) == b""
    return True
