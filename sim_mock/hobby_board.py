"""An emulated board with a hobby servo on each channel, and its line.

Time passes in whole steps of 10 ms; a servo gets a new pulse every second step.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence

from gazerig.sim_mock.faults.grammar import CommandTable
from gazerig.sim_mock.faults.hobby import HobbyFaults
from gazerig.sim_mock.hobby_servo import STEP_S, HobbyServo
from gazerig.sim_mock.replies import Piece

STEPS_S = round(1.0 / STEP_S)
MOST_STEPS = 1000
"""Only the end of a longer time without a command is simulated."""


class HobbyBoard(ABC):
    """One board, or several on one line."""

    def __init__(
        self,
        servos: Sequence[HobbyServo],
        now_s: Callable[[], float],
        commands: CommandTable,
        seed: int,
    ) -> None:
        self.now_s = now_s
        self.servos = tuple(servos)
        self.faults = HobbyFaults(self, commands, seed)
        self._step = self._step_number()

    # --- what a kind of board defines

    @abstractmethod
    def restart(self) -> None:
        """Restart as after a dip of the supply."""

    @abstractmethod
    def pulse_steps(self, channel: int) -> int:
        """Return the present pulse of a channel, quarter microseconds; 0: none."""

    def target_steps(self, channel: int) -> int:
        """Return the commanded pulse of a channel, if it differs from the present one."""
        return self.pulse_steps(channel)

    def step_outputs(self) -> None:  # noqa: B027  # not every board has a ramp
        """Advance outputs that have a ramp by 10 ms."""

    @abstractmethod
    def execute(self, data: bytes) -> Iterator[Piece]:
        """Execute the commands in bytes; yield their answers."""

    # --- device interface

    def find_servo(self, channel: int) -> HobbyServo:
        """Return the servo of a channel, advanced to the present time."""
        self.advance()
        if not 0 <= channel < len(self.servos):
            raise KeyError(f"no channel {channel}; channels are 0 to {len(self.servos) - 1}")
        return self.servos[channel]

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions of the shafts now, in quarter microseconds, by channel."""
        self.advance()
        return tuple(servo.place_steps for servo in self.servos)

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[Piece]:
        """Process received bytes; return the answers to the commands in them."""
        self.advance()
        return [
            piece
            for piece in self.execute(data)
            if not self.faults.use_fault("lose", piece.servo_id)
        ]

    # --- time

    def _step_number(self) -> int:
        return int(self.now_s() * STEPS_S + 1e-3)  # the margin keeps 0.03 s from being two steps

    def advance(self) -> None:
        """Advance to the present time."""
        until = self._step_number()
        self._step = max(self._step, until - MOST_STEPS)
        while self._step < until:
            self._step += 1
            self.step_outputs()
            for channel, servo in enumerate(self.servos):
                if self._step % 2 == 0:
                    servo.width_steps = self.pulse_steps(channel)
                servo.step()
