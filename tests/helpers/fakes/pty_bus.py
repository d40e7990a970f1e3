"""One emulated bus in its own process, and its terminal."""

from collections.abc import Sequence

from gazerig.sim_mock.devices import DynamixelLine, Emulated
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.smart_servo.physics import ServoSpec


class PtyBus:
    """A server of one bus; ``command`` and ``stop`` are those of the server."""

    def __init__(self) -> None:
        self._server = PtyBuses()
        self.command, self.stop = self._server.command, self._server.stop

    def start(
        self, specs: Sequence[ServoSpec | tuple[int, str, float]], baud: int | None = None
    ) -> str:
        """Start a server for Dynamixel servos; return the path to open as a serial port."""
        return self.start_device(DynamixelLine(tuple(ServoSpec(*spec) for spec in specs), baud))

    def start_device(self, device: Emulated) -> str:
        """Start a server for servos or a board; return the path to open as a serial port."""
        return self._server.start({"": device})[""]

    def __enter__(self) -> "PtyBus":
        return self

    def __exit__(self, *raised: object) -> None:
        self.stop()
