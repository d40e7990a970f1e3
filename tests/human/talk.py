"""A scene: one or two people talk with the head in turns of 3 to 9 s, as a voice agent reports."""

from math import atan2, hypot, pi, sin

import numpy as np
from fakes.scenes import EmptyScene
from human.swinging_face import HEAD_M

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import ScenePerson
from gazerig.sim_mock.scenes.script import AgentAct

_FIRST_S, _THINKS_S, _CYCLES = 2.0, 0.8, 60
_LEAST_S, _MOST_S, _CHARACTERS_PER_S = 3.0, 9.0, 15
_PLACES: dict[int, tuple[Vec3, ...]] = {
    1: ((1.15, 0.02, 0.24),),
    2: ((1.2, 0.30, 0.22), (1.25, -0.34, 0.26)),
}


class Talk(EmptyScene):
    """The head listens, thinks and speaks; people look at it, and speak while it listens.

    Two answers of three go to the person who has not spoken, if there are two, one of them without
    a thought. Half of the speeches have a text, half a planned length.
    """

    round_s = 3600.0

    def __init__(self, people: int, number: int) -> None:
        self.name, self._places = f"talk of {people}, {number}", _PLACES[people]
        rng, t_s, partner, acts = np.random.default_rng(number), _FIRST_S, 0, list[AgentAct]()
        for cycle in range(_CYCLES):
            hears_s, speaks_s = rng.uniform(_LEAST_S, _MOST_S, 2).tolist()
            answered = (partner + (cycle % 3 > 0)) % people
            acts.append(AgentAct(t_s, "listening", str(partner)))
            t_s += hears_s
            if people == 1 or cycle % 3 < 2:
                acts.append(AgentAct(t_s, "thinking", str(answered)))
                t_s += _THINKS_S
            text = "x" * round(_CHARACTERS_PER_S * speaks_s) if cycle % 2 else ""
            acts.append(AgentAct(t_s, "speaking", str(answered), None if text else speaks_s, text))
            t_s, partner = t_s + speaks_s, answered
        self.agent = tuple(acts)

    def face(self, name: str, t_s: float) -> Vec3:
        """Return a person's face."""
        x, y, z = self._places[int(name)]
        return x, y + 0.008 * sin(2.0 * pi * 0.17 * t_s + int(name)), z

    def partner(self, t_s: float, state: str = "") -> int:
        """Return the partner at a time, in a state or in any; -1 for none."""
        acts = [act for act in self.agent if act.at_s <= t_s]
        return int(acts[-1].person) if acts and state in ("", acts[-1].state) else -1

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the people."""
        heard, found = self.partner(t_s, "listening"), []
        for number in range(len(self._places)):
            face = self.face(str(number), t_s)
            x, y, z = (a - b for a, b in zip(HEAD_M, face, strict=True))
            way = atan2(y, x), atan2(z, hypot(x, y))
            found.append(ScenePerson(face, way, None, number == heard))
        return tuple(found)
