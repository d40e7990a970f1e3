"""The world of emulated buses in its own process: it is kept up to date and publishes its state.

People keep their first pose until the first client has sent something: a program may take seconds
to start and must not miss a part of the round.
"""

import json
from collections.abc import Callable
from pathlib import Path

from gazerig.features.world.commands import COMMANDS
from gazerig.features.world.physics import World
from gazerig.features.world.state_file import StateWriter
from gazerig.features.world.world_spec import WorldSpec
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.pty.line import BusSettings
from gazerig.sim_mock.smart_servo.integration import whole_ms

PUBLISH_MS = 5
"""Period of the states; a camera uses one in six."""


class ServedWorld:
    """The world of all buses of a server.

    Attributes:
        commands: the first words of the commands for ``obey``.

    Raises:
        SetupError: a user's own world cannot be used.
    """

    def __init__(self, spec: WorldSpec, state: Path, clock_s: Callable[[], float]) -> None:
        self._clock_s = clock_s
        self.commands = frozenset(COMMANDS.verbs)
        self.world = World(spec.compiled(), clock_s)
        if spec.figures is not None:
            spec.figures.share()
        self._writer = StateWriter(state, self.world.state().qpos.size)
        self._due_ms = 0
        self._begun = False

    def joints(self) -> list[dict[str, int]]:
        """Return the indices of the joints of each rig in a state."""
        return [rig.qpos for rig in self.world.model.rigs]

    def device(self, bus: BusSettings) -> Device:
        """Return an emulated device whose servos move the joints of one of the world's rigs."""
        name = bus.rig_bus if bus.rig_bus is not None else bus.name or ""
        return self.world.device(bus.device, name, bus.seed, bus.rig)

    def obey(self, text: str) -> str:
        """Carry out a command of the world; return {"ok": ...} or {"error": ...} as JSON."""
        try:
            return json.dumps({"ok": COMMANDS.obey(self.world, text)})
        except ValueError as error:
            return json.dumps({"error": str(error)})

    def wait_s(self) -> float:
        """Return how long to sleep if nothing arrives."""
        return max(0.0, self._due_ms / 1e3 - self._clock_s())

    def serve(self, heard: bool) -> None:
        """Simulate the world up to now, and write its state if it is due.

        heard: a client has sent something; the first time this begins the script of the people
        """
        now_ms = whole_ms(self._clock_s())
        if heard and not self._begun:
            self._begun = True
            self.world.begin(now_ms)
        if now_ms < self._due_ms:
            return
        self.world.advance(now_ms)
        if self._begun:
            state = self.world.state()
            self._writer.write(now_ms / 1e3, state.t_s, state.qpos)
        self._due_ms = now_ms + PUBLISH_MS
