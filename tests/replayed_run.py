"""A run to be replayed, and a page that keeps what it is shown."""

import json
from collections.abc import Sequence

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.dashboard.feed.page_process import REPLAY, SNAPSHOT, decode_snapshot
from gazerig.robot.model.commands import Ask

SECONDS = 6.0
RATE_HZ = 200.0


def ticks_of(seconds: float, asked: Sequence[tuple[float, Ask]] = ()) -> list[Tick]:
    made = assemble(
        load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene="face-to-face")
    )
    ticks: list[Tick] = []
    left = list(asked)

    def over(s: float) -> str | None:
        while left and s >= left[0][0]:
            made.robot.command(left.pop(0)[1])
        return "over" if s > seconds else None

    made.robot.start(made.clock)
    try:
        run(made.robot, made.clock, made.loop, over, ticks.append)
    finally:
        made.robot.stop()
        made.close()
    return ticks


class Screen:
    """A page that accepts messages, and none while it is full."""

    def __init__(self) -> None:
        self.messages: list[bytes] = []
        self.full = False

    def send(self, message: bytes) -> bool:
        if not self.full:
            self.messages.append(message)
        return not self.full

    def of(self, kind: bytes) -> list[bytes]:
        return [message[1:] for message in self.messages if message[:1] == kind]

    def times_s(self, start_s: float) -> list[float]:
        return [decode_snapshot(m).t_s - start_s for m in self.messages if m[:1] == SNAPSHOT]

    def states(self) -> list[dict]:
        return [json.loads(body) for body in self.of(REPLAY)]
