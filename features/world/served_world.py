"""World of emulated buses in its own process: it is kept up to date and publishes its state.

People keep their first pose until the first message of a client: a program may take seconds to
start and must not miss a part of the round.
"""

import json
from collections.abc import Callable
from pathlib import Path

from gazerig.features.world.physics import World
from gazerig.features.world.state_file import StateWriter
from gazerig.features.world.world_spec import WorldSpec
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.faults.grammar import CommandTable, Verb
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.smart_servo.shaft import whole_ms

DIRECTIONS = {
    "forward": (1.0, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
}
"""In the frame of the rig's base: its own left."""

PUSH_S = 0.5
"""Default duration of a push."""


def _push(world: World, body: str, newton: float, to: str, seconds: float = PUSH_S) -> str:
    if to not in DIRECTIONS:
        raise ValueError(f"{to!r} is not {'|'.join(DIRECTIONS)}")
    x, y, z = DIRECTIONS[to]
    world.push(body, (newton * x, newton * y, newton * z), seconds)
    return f"{body} is pushed {to} with {newton:g} N for {seconds:g} s"


COMMANDS = CommandTable(
    {
        # At its origin; the servos give way.
        "push": Verb(_push, f"BODY NEWTONS {'|'.join(DIRECTIONS)} [SECONDS]"),
    }
)
"""Fault commands of a world."""


PUBLISH_MS = 5
"""Period of the states; a camera uses one in six."""


class ServedWorld:
    """The world of all buses of a server.

    Attributes:
        commands: the first words of the commands for ``execute``.

    Raises:
        SetupError: a user's own world cannot be used.
    """

    def __init__(self, spec: WorldSpec, state: Path, clock_s: Callable[[], float]) -> None:
        self._clock_s = clock_s
        self.commands = frozenset(COMMANDS.verbs)
        self.world = World(spec.compile(), clock_s)
        spec.figures.share()
        self._writer = StateWriter(state, self.world.state().qpos.size)
        self._due_ms = 0
        self._begun = False

    def joints(self) -> dict[str, int]:
        """Return the indices of the rig's joints in a state."""
        return self.world.model.rig.qpos

    def device(self, bus: BusSettings) -> Device:
        """Return an emulated device whose servos move the joints of the world's rig."""
        return self.world.device(bus.device, bus.name or "")

    def obey(self, text: str) -> str:
        """Execute a command of the world; return {"ok": ...} or {"error": ...} as JSON."""
        try:
            return json.dumps({"ok": COMMANDS.obey(self.world, text)})
        except ValueError as error:
            return json.dumps({"error": str(error)})

    def wait_s(self) -> float:
        """Return how long to sleep if nothing arrives."""
        return max(0.0, self._due_ms / 1e3 - self._clock_s())

    def serve(self, heard: bool) -> None:
        """Simulate the world up to now, and write its state if it is due.

        heard: whether a client has sent something; the first time this starts the script of the
            people
        """
        now_ms = whole_ms(self._clock_s())
        if heard and not self._begun:
            self._begun = True
            self.world.begin(now_ms)
        if now_ms < self._due_ms:
            return
        self.world.advance(now_ms)
        if self._begun:
            self._writer.write(self.world.state())
        self._due_ms = now_ms + PUBLISH_MS
