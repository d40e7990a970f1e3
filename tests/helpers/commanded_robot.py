"""A robot that runs tick by tick and is given commands."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from desk import GAZE_JOINTS
from fakes.runs import go, simulated

from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import Command
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.run.run import Run

YAW = GAZE_JOINTS.index("neck_yaw")
NECK = slice(YAW, YAW + 3)
ONE_TICK_S = 0.006


@dataclass
class Running:
    """A simulated rig that ticks on request."""

    made: Run
    ticks: list[Tick] = field(default_factory=list)

    def go(self, seconds: float = ONE_TICK_S) -> list[Tick]:
        """Run on; give the new ticks."""
        began = len(self.ticks)
        self.count = go(self.made, seconds, self.ticks.append)
        return self.ticks[began:]

    def do(self, command: Command, seconds: float = ONE_TICK_S) -> tuple[CommandReply, list[Tick]]:
        """Ask and run on; give the reply and the new ticks."""
        ticket = self.made.robot.command(command)
        ticks = self.go(seconds)
        reply = ticket.wait(0.0)
        assert reply is not None
        return reply, ticks

    def order(self, order: Command) -> None:
        """Ask."""
        self.made.robot.command(order)


@contextmanager
def running_desk() -> Iterator[Running]:
    """Run a desk rig face to face with a person, for a second as yet."""
    made = simulated(scene="face-to-face", seed=3)
    made.robot.start(made.clock)
    try:
        running = Running(made)
        running.go(1.0)
        yield running
    finally:
        made.robot.stop()
        made.close()
