"""Positions of a person's face parts, to which the person steers the gaze by keys.

People judge the direction of another person's gaze well (Nakamoto & Tsuruno 3.7). So a person whose
face differs from an adult's average steers the gaze to each part of it and confirms each. Only the
direction of a gaze can be judged: a part moves in the face's plane, to its owner's left and up, and
its distance out of the face does not change.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up;
millimetres. The offsets are in that frame, so they are valid for every pose of the face.

``FaceSteering`` chooses the target instead of attention: one part of the nearest face, located with
the face's full pose at every tick, so the person may move while judging. It is followed by the
oculomotor model, without refixations and scatter, the guard and the servos.
"""

from collections.abc import Mapping
from math import degrees, inf
from typing import Literal

from gazerig.gaze.angles import add, norm, rotate, scale, sub
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.types import Face, GazeState, Mat3, Percept, Target, Vec3
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.robot.model.kinematics import gaze_error

Key = Literal["left", "right", "up", "down", "enter", "skip", "back", "end"]

ORDER = ("N", "LE", "RE", "M", "DN", "UP", "FL", "FR")
"""The parts in the order of the calibration, from the centre outwards."""

PART_NAMES_TEXT = {
    "N": "the tip of your nose",
    "LE": "your left eye",
    "RE": "your right eye",
    "M": "your mouth",
    "DN": "your chin",
    "UP": "your forehead",
    "FL": "the left side of your face",
    "FR": "the right side of your face",
}
"""Left and right are the owner's."""

STEP_MM = 5.0
"""Distance by which one key moves the gaze: .4 deg at .7 m, finer than a person's judgement."""
FARTHEST_MM = 150.0
"""Largest distance of a face part from the tip of the nose, sideways or vertically."""

# A person who faces the robot sees the gaze go to their own left, which is the face's +y.
_WAYS: Mapping[str, tuple[float, float]] = {
    "left": (1.0, 0.0),
    "right": (-1.0, 0.0),
    "up": (0.0, 1.0),
    "down": (0.0, -1.0),
}


class FaceCalibration:
    """Progress of a calibration: positions of the parts in the face frame, moved by keys.

    Args:
        own_mm: part -> position in the face frame, as under ``face_parts_mm`` of a rig file; other
            parts begin at those of an adult's face.

    Attributes:
        starts_mm, places_mm: Initial and present position of each part in the face frame.
        part_number: Number of the part in ORDER, len(ORDER) after the last.
        adjusted_parts: Parts that the gaze seemed to look at.
    """

    def __init__(self, own_mm: Mapping[str, Vec3]) -> None:
        adult = {part: scale(PARTS_FACE_M[part], 1e3) for part in ORDER}
        self.starts_mm = {part: own_mm.get(part, adult[part]) for part in ORDER}
        self.places_mm = dict(self.starts_mm)
        self.part_number = 0
        self.adjusted_parts: set[str] = set()

    @property
    def part(self) -> str | None:
        """Return the current part, None at the end."""
        return ORDER[self.part_number] if self.part_number < len(ORDER) else None

    def apply(self, key: Key) -> None:
        """Apply a key; after the end, keys have no effect."""
        part = self.part
        if part is None:
            return
        match key:
            case "enter":
                self.adjusted_parts.add(part)
                self.part_number += 1
            case "skip":
                self.places_mm[part] = self.starts_mm[part]
                self.adjusted_parts.discard(part)
                self.part_number += 1
            case "back":
                self.part_number = max(0, self.part_number - 1)
            case "end":
                self.part_number = len(ORDER)
            case _:
                x, y, z = self.places_mm[part]
                left, up = (STEP_MM * way for way in _WAYS[key])
                self.places_mm[part] = x, _within_face(y, left), _within_face(z, up)

    def changed_places(self) -> dict[str, Vec3]:
        """Return the chosen positions as dotted keys of a rig file and values, to 0.1 mm."""
        return {
            f"face_parts_mm.{part}": _round_to_tenths(place)
            for part, place in self.places_mm.items()
            if part in self.adjusted_parts
        }


def point_world_m(place_mm: Vec3, p_world_face_m: Vec3, R_world_face: Mat3) -> Vec3:
    """Convert a position in the face frame to a point in the world."""
    return add(p_world_face_m, rotate(R_world_face, scale(place_mm, 1e-3)))


def _round_to_tenths(place_mm: Vec3) -> Vec3:
    x, y, z = (round(v, 1) + 0.0 for v in place_mm)  # + 0.0: no -0.0 in a file
    return x, y, z


def _within_face(value: float, by: float) -> float:
    # A position stored farther out is kept, but can only be moved inwards.
    far = max(FARTHEST_MM, abs(value))
    return max(-far, min(far, value + by))


AIMED_DEG = 1.0
"""Largest gaze error at which the eyes look at the part."""

STALE_S = 0.4
"""Largest age of an image with a face."""

_LOST_S = 5.0
_STILL: Vec3 = (0.0, 0.0, 0.0)
# The head turns to the face as far as possible, so that the eyes have their whole range.
_PULL = 1.0


class FaceSteering:
    """Chooser (gazerig.robot.loop.loop) that keys control.

    state: progress of the calibration
    face: the target face, None while no face is seen
    error_deg: angle of the worse eye from the part, as measured, or of the mean line of sight
        of eyes that share one linkage for yaw; inf while unknown

    Args:
        state: initial state.
        top_down: the behaviours, none of which is active.
        rest_world_m: point to look at while no face is seen.
        converges: whether each eye has its own yaw joint.
    """

    reacts = False

    def __init__(
        self, state: FaceCalibration, top_down: TopDown, rest_world_m: Vec3, converges: bool = True
    ) -> None:
        self._converges = converges
        self.top_down = top_down
        self.state = state
        self._lost_at = self._rest = rest_world_m
        self.face: Face | None = None
        self.error_deg = inf
        self._identity: object = None
        self._shift = 0
        self._seen_s = -inf

    def reset(self, t_s: float) -> None:
        """Keep the progress; the loop calls this at its start."""

    @property
    def is_aimed(self) -> bool:
        """Return whether both eyes are on the part."""
        return self.face is not None and self.error_deg <= AIMED_DEG

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the current part as target, or the rest point while no face is seen."""
        followed, self.face = self.face and self.face.id, None
        if percept is not None and percept.faces and percept.age_s(t_s) <= STALE_S:
            # The present face while it is seen, else the nearest.
            self.face = min(
                percept.faces,
                key=lambda one: (
                    one.id != followed,
                    norm(sub(one.p_world_m, state.p_world_head_m)),
                ),
            )
        face, part = self.face, self.state.part
        if face is None or percept is None or part is None:
            # At the last face first, and straight ahead after a while.
            lost = t_s - self._seen_s > _LOST_S
            p = self._rest if lost else self._lost_at
            shift = self._count(("rest", lost))
            return Target(p, _STILL, t_s, "rest", -1, _PULL, True, None, shift, "no face seen")
        self._seen_s = t_s
        place = self.state.places_mm[part]
        p = self._lost_at = point_world_m(place, face.p_world_m, face.R_world_face)
        shift = self._count((face.id, part, place))
        why = f"steered to this part of face {face.id}"
        return Target(
            p, face.v_world_m_s, percept.captured_s, "part", face.id, _PULL, True, part,
            shift, why, face.p_world_m,
        )  # fmt: skip

    def press(self, key: Key) -> str | None:
        """Apply a key; return the reason if that is impossible."""
        if key != "end" and self.face is None:
            return "no face is seen: keys wait until one is"
        if key == "enter" and not self.is_aimed:
            return (
                "not taken: the eyes are not on the point yet; if they never come, be nearer to "
                "where the head points"
            )
        self.state.apply(key)
        self.error_deg = inf
        return None

    def update(self, tick: Tick) -> None:
        """Measure the gaze."""
        self.error_deg = inf
        if tick.target.kind == "part" and tick.gaze.phase != "saccade":
            # The angle between the gaze and the part, as far as the eyes can reach it.
            error = gaze_error(tick.target.p_world_m, tick.pose, self._converges)
            self.error_deg = degrees(error)

    def _count(self, identity: object) -> int:
        """Return the number of the shift, a new one whenever the target point changes."""
        self._shift += identity != self._identity
        self._identity = identity
        return self._shift
