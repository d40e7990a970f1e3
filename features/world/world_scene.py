"""A world as a scene: its people, for the score, the true gaze and detectors without pictures."""

from collections.abc import Iterator
from functools import cached_property
from math import atan2
from typing import Any

import numpy as np

from gazerig.features.world.figure import SIDES, Figures
from gazerig.features.world.motions import FIST_M, OUT_S
from gazerig.features.world.rotations import rotation_matrix
from gazerig.features.world.timeline import HEAD_M, TimedAct
from gazerig.gaze.angles import yaw_pitch
from gazerig.gaze.types import Floats, Vec3
from gazerig.sim_mock.scenes.boxing import HALF_FIELD_RAD
from gazerig.sim_mock.scenes.scene import Event, ScenePerson, Thing

GLOVE_M, HAND_M, THING_M = 0.078, 0.07, 0.05
"""Radii of the gaze targets."""
_RAISED_M = 0.50
"""A raised hand is at most this far below the nose."""
_GLOVE_MIDDLE_M = 0.09
_SPIN_WITHIN_S = 0.01
_RETURN_S = 1.3
_QUIET_S = 0.5


class WorldScene:
    """A Scene of gazerig.sim_mock.scenes whose people are a world's.

    Args:
        name: of the world.
        figures: its people.
    """

    def __init__(self, name: str, figures: Figures) -> None:
        script = figures.script
        self.name, self.round_s = name, script.round_s
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
            nose = self._nose(name, t_s)
            first = True
            for which, side in enumerate(SIDES):
                middle = self._hand(name, side, t_s)
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
        found = [
            event
            for name, acts in self.figures.timelines.items()
            for one in acts
            for event in self._of_act(name, one)
        ]
        boxes = [n for n, person in self.figures.script.people.items() if person.gloves]
        found += [event for name in boxes for event in self._quiet(name, found)]
        return tuple(sorted(found, key=lambda event: event.start_s))

    def _of_act(self, name: str, one: TimedAct) -> Iterator[Event]:
        """Yield the events of an act that is visible to the robot."""
        do, start_s, end_s = one.act.do, one.start_s, one.end_s
        middle_s = 0.5 * (start_s + end_s)
        boxes = self.figures.script.people[name].gloves
        side = one.act.side
        face = self._nose(name, middle_s)
        if do == "reach":
            yield from self._reach(name, one)
        elif do in ("punch", "wave"):
            hand = self._hand(name, side, middle_s)
            due_s = start_s + OUT_S[do][0] * (end_s - start_s) if do == "punch" else None
            yield Event(do, "look", "hand", start_s, end_s, hand, 0.5, due_s)
        elif boxes and do == "step":
            yield Event("step", "look", "face", start_s, end_s, face, 0.6)
        elif boxes and do == "open_guard":
            out, back = (0.5 * share * (end_s - start_s) for share in OUT_S[do])
            yield Event("attack", "look", "attack_target", start_s + out, end_s - back, face, 0.6)
        elif boxes and do == "feint":
            until_s = min(start_s + _RETURN_S, self.round_s)
            yield Event("return", "return", "face", start_s, until_s, face, 0.6)
        elif do == "speak":
            yield Event("speak", "look", "face", start_s, end_s, face, 0.5)

    def _reach(self, name: str, one: TimedAct) -> Iterator[Event]:
        """Expect a look at a reaching hand while it is in view of a camera that points ahead."""
        inside = [
            t_s
            for t_s in np.arange(one.start_s, one.end_s, 0.01).tolist()
            if self._before_head(self._hand(name, one.act.side, t_s))
        ]
        if inside:
            hand = self._hand(name, one.act.side, 0.5 * (one.start_s + one.end_s))
            yield Event("reach", "look", "hand", inside[0], inside[-1], hand, 0.25)

    def _before_head(self, p_m: Vec3) -> bool:
        """Return whether a point is in the field of view of a camera that points ahead."""
        x, y, z = np.subtract(p_m, HEAD_M).tolist()
        return bool(x > 0.0 and abs(atan2(y, x)) < HALF_FIELD_RAD and z > -0.35 * x)

    def _quiet(self, name: str, events: list[Event]) -> list[Event]:
        """Expect a look at a boxer's face during longer times without other events."""
        quiet, free_s = [], 0.0
        busy = sorted((event.start_s, event.end_s) for event in events)
        for start_s, end_s in (*busy, (self.round_s, self.round_s)):
            if start_s - free_s >= _QUIET_S:
                face = self._nose(name, 0.5 * (free_s + start_s))
                quiet.append(Event("face", "look", "face", free_s, start_s, face, 0.6))
            free_s = max(free_s, end_s)
        return quiet

    def _p(self, segment: str, t_s: float) -> Floats:
        return np.asarray(self.figures.segments(t_s).p_m[self.figures.row[segment]])

    def _R(self, segment: str, t_s: float) -> Floats:
        quat = self.figures.segments(t_s).quat[self.figures.row[segment]]
        return rotation_matrix(quat)

    def _nose(self, name: str, t_s: float) -> Vec3:
        back = np.array(self.figures.measures[name].skull_m)
        return _vec(self._p(f"{name}/head", t_s) - self._R(f"{name}/head", t_s) @ back)

    def _hand(self, name: str, side: str, t_s: float) -> Vec3:
        """Return the middle of a hand or glove."""
        gloves = self.figures.script.people[name].gloves
        out = _GLOVE_MIDDLE_M if gloves else FIST_M
        segment = f"{name}/{side}_hand"
        return _vec(self._p(segment, t_s) - out * self._R(segment, t_s)[:, 2])

    def _person(self, name: str, t_s: float) -> ScenePerson:
        R = self._R(f"{name}/head", t_s)
        nose = self._nose(name, t_s)
        hand = None
        if not self.figures.script.people[name].gloves:
            hands = (self._hand(name, side, t_s) for side in SIDES)
            hand = next((one for one in hands if one[2] > nose[2] - _RAISED_M), None)
        return ScenePerson(nose, yaw_pitch(_vec(R[:, 0])), hand)

    def _spin(self, segment: str, middle: Vec3, t_s: float) -> float:
        """Return the rotation rate about the line of sight, clockwise as seen from the robot."""
        from scipy.spatial.transform import Rotation  # 24 MB, only needed for hands

        before, after = (self._R(segment, t_s + s) for s in (-_SPIN_WITHIN_S, _SPIN_WITHIN_S))
        turn = Rotation.from_matrix(after @ before.T).as_rotvec() / (2.0 * _SPIN_WITHIN_S)
        sight = np.subtract(middle, HEAD_M)
        return float(turn @ sight / max(float(np.linalg.norm(sight)), 1e-6))


def _vec(row: Floats) -> Vec3:
    return float(row[0]), float(row[1]), float(row[2])
