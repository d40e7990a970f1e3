"""A rig that ticks at every command, for tests of clients."""

from collections.abc import Iterator
from math import degrees

import msgspec
import pytest
from expressive_rig import started
from fakes.runs import ticks
from typer.testing import CliRunner

from gazerig.robot.cli.ctl import app
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.model.commands import Command
from gazerig.robot.model.reply import Ticket
from gazerig.robot.net.client import RobotClient
from gazerig.robot.run.requests import RequestHandler
from gazerig.robot.run.run import Run


class TickedRig:
    """A rig that ticks once whenever a command comes, and its connection in one object."""

    def __init__(self, made: Run) -> None:
        self.made, self.pulse = made, TickFeed()
        self.commands: list[Command] = []
        self.handler = RequestHandler(made, self.pulse, {})
        self._take, made.robot.command = made.robot.command, self.command  # type: ignore[method-assign]
        self.answer: object = None

    def command(self, command: Command) -> Ticket:
        ticket = self._take(command)
        self.commands.append(command)
        self.tick()
        return ticket

    def tick(self, number: int = 1) -> dict[str, float]:
        for tick in ticks(self.made, number):
            self.pulse.update(tick)
        return dict(zip(self.made.robot.body.names, map(degrees, tick.desired_rad), strict=True))

    def write(self, request: object, within_s: float) -> None:
        answer = self.handler.answer(msgspec.to_builtins(request))
        self.answer = msgspec.json.decode(msgspec.json.encode(answer))

    def read(self, first_s: float, within_s: float) -> object:
        return self.answer

    def close(self) -> None:
        pass


def connected(monkeypatch: pytest.MonkeyPatch) -> Iterator[TickedRig]:
    """Yield a rig that every client connects to."""
    made = started()
    rig = TickedRig(made)
    monkeypatch.setattr(TickFeed, "wait_for_ticks", lambda *_, **__: True)
    monkeypatch.setattr(
        RobotClient, "connect", lambda pid=None, who="": RobotClient(rig, 1)  # type: ignore[arg-type]
    )  # fmt: skip
    yield rig
    made.close()


def gazerig(*words: str, typed: str = "") -> str:
    done = CliRunner().invoke(app, words, input=typed)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.stdout + done.stderr
