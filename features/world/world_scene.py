"""World as a scene for the score, the true gaze and detectors."""

from functools import cached_property
from math import atan2
from typing import Any

import numpy as np

from gazerig.features.world.body_motion import SIDES
from gazerig.features.world.figure import Figures
from gazerig.features.world.motions import FIST_M, OUT_S
from gazerig.features.world.opponent_motion import Opponent
from gazerig.features.world.rotations import rotation_matrix, rotation_vector
from gazerig.features.world.timeline import HEAD_M, place_m
from gazerig.gaze.angles import yaw_pitch
from gazerig.gaze.types import Floats, Vec3
from gazerig.sim_mock.scenes.scene import Event, ScenePerson, Thing
from gazerig.sim_mock.scenes.timeline import HALF_FIELD_RAD, TimedAct, events_of

GLOVE_M, HAND_M, THING_M = 0.078, 0.07, 0.05
"""Radii of the gaze targets."""
_RAISED_M = 0.50
"""Largest distance of a raised hand below the nose."""
_GLOVE_MIDDLE_M = 0.09
_SPIN_WITHIN_S = 0.01


class WorldScene:
    """A Scene of gazerig.sim_mock.scenes whose people are a world's."""

    def __init__(self, name: str, figures: Figures) -> None:
        script = figures.script
        self.name, self.round_s, self.agent = name, script.round_s, script.agent
        boxes = any(person.gloves for person in script.people.values())
        self.behaviours: tuple[str, ...] = ("wait", "guard", "attack") if boxes else ()
        self.figures = figures

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.name, self.figures)

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return all people in the script's order: tip of nose, face direction, raised hand."""
        return tuple(self._person(name, t_s) for name in self.figures.script.people)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return boxing gloves, second raised hands, and held things."""
        found = []
        script = self.figures.script
        for number, (name, person) in enumerate(script.people.items()):
            nose = self.face(name, t_s)
            first = True
            for which, side in enumerate(SIDES):
                middle = self.hand(name, side, t_s)
                if not person.gloves and middle[2] < nose[2] - _RAISED_M:
                    continue
                if person.gloves or not first:
                    radius = GLOVE_M if person.gloves else HAND_M
                    spin = self._spin(f"{name}/{side}_hand", middle, t_s)
                    found.append(
                        Thing(2 * number + which, "hand", middle, radius, spin, person=number)
                    )
                first = False
        beyond = 2 * len(script.people)
        for number, name in enumerate(script.things):
            place = _vec(self._p(f"thing/{name}", t_s))
            found.append(Thing(beyond + number, "thing", place, THING_M))
        return tuple(found)

    def events(self) -> tuple[Event, ...]:
        """Return the events of a round and the expected response of a person's gaze."""
        return self._events

    @cached_property
    def _events(self) -> tuple[Event, ...]:
        return events_of(self.figures.script, self.figures.timelines, self)

    @property
    def opponent(self) -> Opponent | None:
        """Return the boxer that a person can move, None without one."""
        return self.figures.opponent

    def place(self, name: str) -> Vec3:
        """Return a place, at the height of its gaze target."""
        return place_m(self.figures.script, name)

    def reach_times_s(self, one: TimedAct) -> tuple[float, float]:
        """Return the times that a hand takes to its target, and back."""
        lasts_s = one.end_s - one.start_s
        out, back = OUT_S[one.act.do]
        return out * lasts_s, back * lasts_s

    def is_before_head(self, p_m: Vec3) -> bool:
        """Return whether a point is in the field of view of a camera that points ahead."""
        x, y, z = np.subtract(p_m, HEAD_M).tolist()
        return bool(x > 0.0 and abs(atan2(y, x)) < HALF_FIELD_RAD and z > -0.35 * x)

    def _p(self, segment: str, t_s: float) -> Floats:
        return np.asarray(self.figures.segments(t_s).p_m[self.figures.row[segment]])

    def _R(self, segment: str, t_s: float) -> Floats:
        quat = self.figures.segments(t_s).quat[self.figures.row[segment]]
        return rotation_matrix(quat)

    def face(self, name: str, t_s: float) -> Vec3:
        """Return the tip of a nose."""
        back = np.array(self.figures.measures[name].skull_m)
        return _vec(self._p(f"{name}/head", t_s) - self._R(f"{name}/head", t_s) @ back)

    def hand(self, name: str, side: str, t_s: float) -> Vec3:
        """Return the centre of a hand or glove."""
        gloves = self.figures.script.people[name].gloves
        out = _GLOVE_MIDDLE_M if gloves else FIST_M
        segment = f"{name}/{side}_hand"
        return _vec(self._p(segment, t_s) - out * self._R(segment, t_s)[:, 2])

    def _person(self, name: str, t_s: float) -> ScenePerson:
        R = self._R(f"{name}/head", t_s)
        nose = self.face(name, t_s)
        hand = None
        if not self.figures.script.people[name].gloves:
            hands = (self.hand(name, side, t_s) for side in SIDES)
            hand = next((one for one in hands if one[2] > nose[2] - _RAISED_M), None)
        return ScenePerson(nose, yaw_pitch(_vec(R[:, 0])), hand)

    def _spin(self, segment: str, middle: Vec3, t_s: float) -> float:
        """Return the rotation rate about the line of sight, clockwise as seen from the robot."""
        before, after = (self._R(segment, t_s + s) for s in (-_SPIN_WITHIN_S, _SPIN_WITHIN_S))
        turn = rotation_vector(after @ before.T) / (2.0 * _SPIN_WITHIN_S)
        sight = np.subtract(middle, HEAD_M)
        return float(turn @ sight / max(float(np.linalg.norm(sight)), 1e-6))


def _vec(row: Floats) -> Vec3:
    return float(row[0]), float(row[1]), float(row[2])
