"""A simulated voice agent: it reports the turns of a script to the head, as a real one does."""

from collections.abc import Callable
from math import dist
from typing import Protocol, runtime_checkable

from gazerig.gaze.types import Vec3
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import Talk
from gazerig.robot.model.reply import CommandTaker
from gazerig.sim_mock.scenes.script import AgentAct

AGENT = "mock agent"
_NEAR_M = 0.5


@runtime_checkable
class AgentScene(Protocol):
    """A scene whose script contains the reports of a voice agent."""

    round_s: float
    agent: tuple[AgentAct, ...]

    def face(self, name: str, t_s: float) -> Vec3:
        """Return a person's face, world, m."""


class MockAgent:
    """Reports of a scene's script, each once when its time has come.

    Args:
        command: queues commands for the next tick.
        scene: the scene whose script contains its own agent.
        scene_start_s: returns the start of the scene; None: the first tick.
    """

    def __init__(
        self,
        command: CommandTaker,
        scene: AgentScene,
        scene_start_s: Callable[[], float | None],
    ) -> None:
        self._command, self._scene, self._scene_start_s = command, scene, scene_start_s
        self._start_s: float | None = None
        self._next = 0
        self._seen: dict[int, Vec3] = {}

    def update(self, tick: Tick) -> None:
        """Report what has become due at the newest tick."""
        scene = self._scene
        if self._start_s is None:
            begun_s = self._scene_start_s()
            self._start_s = tick.t_s if begun_s is None else begun_s
        if tick.percept is not None:
            self._seen |= {face.id: face.p_world_m for face in tick.percept.faces}
        since_s = tick.t_s - self._start_s
        while self._next < len(scene.agent):
            act = scene.agent[self._next]
            if since_s < act.at_s:
                return
            self._next += 1
            person = self._person_id(scene.face(act.person, since_s)) if act.person else None
            self._command(Talk(act.state, person, act.seconds, act.text, who=AGENT, stay=True))
        if scene.round_s and since_s >= scene.round_s:
            self._start_s += scene.round_s
            self._next = 0

    def _person_id(self, place: Vec3) -> int | None:
        """Return perception's number of the person last seen at a place, None without one."""
        near = [(dist(seen, place), number) for number, seen in self._seen.items()]
        return min([one for one in near if one[0] < _NEAR_M], default=(0.0, None))[1]
