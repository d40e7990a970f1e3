"""The process of a study's head, and the connection to it."""

import contextlib
import json
import subprocess
from dataclasses import fields
from pathlib import Path
from subprocess import PIPE
from typing import Any

from gazerig.drivers.errors import DriverError
from gazerig.drivers.process import child_process
from gazerig.features.study.study_run import HeadLost
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.head_state import HeadState
from gazerig.robot.model.clock import Clock
from gazerig.robot.remote.client import NoRobotError, RobotClient

_MODULE = "gazerig.features.study.run.head_main"
_STARTS_S, _LOOKS_S = 90.0, 0.05
_PARKS_S = 20.0
_PATHS = ("record", "video", "replay", "heatmap", "heatmap_face")


class HeadProcess:
    """A running head.

    Attributes:
        client: the connection to it.

    Args:
        options: options of the run.
        log: file for its output.
        clock: clock of the host.

    Raises:
        HeadLost: it does not start; the message gives the reason.
    """

    def __init__(self, options: RunOptions, log: Path, clock: Clock) -> None:
        self._log, self._clock = log, clock
        with log.open("ab") as file:
            self._process = child_process.start(_MODULE, stdin=PIPE, stderr=file.fileno())
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(encode_options(options))
            self._process.stdin.flush()
            self.client = self._connect()
        except (OSError, HeadLost) as error:
            self.end()
            raise HeadLost(str(error) or self.last_log_line()) from error
        except BaseException:
            self.end()
            raise

    @property
    def alive(self) -> bool:
        """Return whether the process runs."""
        return self._process.poll() is None

    def state(self) -> HeadState:
        """Return the head's state at its newest tick.

        Raises:
            HeadLost: it has no tick, or has ended.
        """
        try:
            state, _ = self.client.state()
        except DriverError as error:
            raise HeadLost(self.last_log_line() if not self.alive else str(error)) from error
        if state is None:
            raise HeadLost("the head has not started to move")
        return state

    def last_log_line(self) -> str:
        """Return the last line of its output."""
        with contextlib.suppress(OSError):
            lines = self._log.read_text(encoding="utf-8", errors="replace").split("\n")
            said = [line.strip() for line in lines if line.strip()]
            if said:
                return said[-1]
        return "the head's program has ended"

    def end(self) -> None:
        """Park it, switch it off, and wait for that; a process that hangs is killed."""
        if hasattr(self, "client"):
            with contextlib.suppress(DriverError, OSError):
                self.client.close()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(_PARKS_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _connect(self) -> RobotClient:
        """Wait until the head moves; return the connection to it."""
        end_s = self._clock.now_s() + _STARTS_S
        client: RobotClient | None = None
        while self._clock.now_s() < end_s:
            if not self.alive:
                raise HeadLost(self.last_log_line())
            try:
                client = client or RobotClient.connect(self._process.pid, "the study")
                if client.state()[0] is not None:
                    return client
            except NoRobotError:
                pass
            except DriverError:
                client = None
            self._clock.sleep_until(self._clock.now_s() + _LOOKS_S)
        late = f"the head did not start to move within {_STARTS_S:g} s"
        raise HeadLost(f"{late}: {self.last_log_line()}")


def encode_options(options: RunOptions) -> bytes:
    """Return options as the line that the process reads."""
    plain = {field.name: getattr(options, field.name) for field in fields(options)}
    said = {name: str(one) if isinstance(one, Path) else one for name, one in plain.items()}
    return json.dumps(said).encode() + b"\n"


def decode_options(line: bytes) -> RunOptions:
    """Return the options of a line."""
    said: dict[str, Any] = json.loads(line)
    for name in _PATHS:
        said[name] = None if said[name] is None else Path(said[name])
    return RunOptions(**said)
