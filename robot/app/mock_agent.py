"""A simulated voice agent: it reports the turns of a script to the head, as a real one does."""

from collections.abc import Callable, Sequence
from math import dist
from typing import Protocol, runtime_checkable

from gazerig.gaze.types import Vec3
from gazerig.robot.control.tick import Tick
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
        ...


class MockAgent:
    """Reports of a script, each once when its time has come.

    Args:
        command: queues commands for the next tick.
        scene: the scene whose script contains its own agent; None: only ``play`` begins reports.
        scene_start_s: returns the start of the scene; None: the first tick.
    """

    def __init__(
        self,
        command: CommandTaker,
        scene: AgentScene | None = None,
        scene_start_s: Callable[[], float | None] = lambda: None,
    ) -> None:
        self._command, self._scene, self._scene_start_s = command, scene, scene_start_s
        self._acts: Sequence[AgentAct] = () if scene is None else scene.agent
        self._round_s = 0.0 if scene is None else scene.round_s
        self._start_s: float | None = None
        self._next = 0
        self._asked: Sequence[AgentAct] = ()

    def play(self, acts: Sequence[AgentAct]) -> None:
        """Begin a script at the next tick, once; a person in it is the nearest one. Thread-safe."""
        self._asked = acts

    def update(self, tick: Tick) -> None:
        """Report what has become due at the newest tick."""
        if self._asked:
            self._scene, self._acts, self._round_s = None, self._asked, 0.0
            self._start_s, self._next, self._asked = tick.t_s, 0, ()
        if self._start_s is None:
            begun_s = self._scene_start_s()
            self._start_s = tick.t_s if begun_s is None else begun_s
        while self._next < len(self._acts):
            act = self._acts[self._next]
            if tick.t_s - self._start_s < act.at_s:
                return
            self._next += 1
            person = self._person_id(act.person, tick) if act.person else None
            self._command(Talk(act.state, person, act.seconds, act.text, who=AGENT, stay=True))
        if self._round_s and tick.t_s - self._start_s >= self._round_s:
            self._start_s += self._round_s
            self._next = 0

    def _person_id(self, name: str, tick: Tick) -> int | None:
        """Return perception's number of a person of the script, None while nobody is seen there."""
        faces = tick.percept.faces if tick.percept is not None else ()
        assert self._start_s is not None
        place: Vec3 = tick.pose.p_world_head_m
        if self._scene is not None:
            place = self._scene.face(name, tick.t_s - self._start_s)
        near = [
            (dist(face.p_world_m, place), face.id)
            for face in faces
            if self._scene is None or dist(face.p_world_m, place) < _NEAR_M
        ]
        return min(near)[1] if near else None
