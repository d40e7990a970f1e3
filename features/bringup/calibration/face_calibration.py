"""Places of a person's own face parts: offsets that keys move until the gaze seems right.

People judge well where another person looks (Nakamoto & Tsuruno 3.7), so a person whose face
differs from an adult's average steers the gaze to each part of it and confirms each. Only the
direction of a gaze can be judged: a part moves in the face's plane, to its owner's left and up,
and its distance out of the face stays as it was.

Face frame: origin at the tip of the nose, x out of the face, y to the owner's left, z up;
millimetres. The offsets live in that frame, so they hold wherever the face goes and
however it turns. Pure: keys and poses in, values out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from gazerig.gaze.angles import add, rotate, rotate_back, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.face_geometry import PARTS_FACE_M

Key = Literal["left", "right", "up", "down", "larger", "smaller", "enter", "skip", "back", "end"]

ORDER = ("N", "LE", "RE", "M", "DN", "UP", "FL", "FR")
"""The parts in the order of the calibration, from the middle outwards."""

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

STEPS_MM = (1.0, 2.0, 5.0, 10.0, 20.0)
FARTHEST_MM = 150.0
"""No part of a face is farther from the tip of its nose, sideways or upright."""

# A person who faces the robot sees the gaze go to their own left, which is the face's +y.
_WAYS: Mapping[str, tuple[float, float]] = {
    "left": (1.0, 0.0),
    "right": (-1.0, 0.0),
    "up": (0.0, 1.0),
    "down": (0.0, -1.0),
}


@dataclass(frozen=True, slots=True)
class FaceCalibration:
    """Progress of a calibration.

    starts_mm, places_mm: each part's first and present place in the face frame
    at: number of the part in ORDER, len(ORDER) after the last
    chosen: parts that the gaze seemed to look at
    step: number of the present step in STEPS_MM
    ended: no part is due any more
    """

    starts_mm: tuple[Vec3, ...]
    places_mm: tuple[Vec3, ...]
    at: int = 0
    chosen: frozenset[str] = frozenset()
    step: int = 2
    ended: bool = False

    @property
    def part(self) -> str | None:
        """Return the part that is due, None at the end."""
        return None if self.ended or self.at >= len(ORDER) else ORDER[self.at]

    @property
    def step_mm(self) -> float:
        """Return how far one key moves the gaze."""
        return STEPS_MM[self.step]

    def place_mm(self, part: str) -> Vec3:
        """Return the present place of a part, in the face frame."""
        return self.places_mm[ORDER.index(part)]

    def moved_mm(self, part: str) -> tuple[float, float]:
        """Return how far a part has been moved to its owner's left and up."""
        _, y0, z0 = self.starts_mm[ORDER.index(part)]
        _, y, z = self.place_mm(part)
        return y - y0, z - z0


def initial_calibration(own_mm: Mapping[str, Vec3]) -> FaceCalibration:
    """Return the start: a rig's own places, or those of an adult's face for parts without one.

    own_mm: part -> place in the face frame, as under ``face_parts_mm`` of a rig file
    """
    starts = [
        own_mm[part] if part in own_mm else _tenths((x * 1e3, y * 1e3, z * 1e3))
        for part, (x, y, z) in ((part, PARTS_FACE_M[part]) for part in ORDER)
    ]
    return FaceCalibration(tuple(starts), tuple(starts))


def apply_key(state: FaceCalibration, key: Key) -> FaceCalibration:
    """Return the state after a key; after the end, keys do nothing."""
    part = state.part
    if part is None:
        return state
    if key in _WAYS:
        (x, y, z), (left, up) = state.place_mm(part), _WAYS[key]
        place = x, _within(y, left * state.step_mm), _within(z, up * state.step_mm)
        return _with_place(state, place)
    match key:
        case "larger" | "smaller":
            step = state.step + (1 if key == "larger" else -1)
            return replace(state, step=max(0, min(len(STEPS_MM) - 1, step)))
        case "enter":
            return _next(replace(state, chosen=state.chosen | {part}))
        case "skip":
            left_alone = _with_place(state, state.starts_mm[state.at])
            return _next(replace(left_alone, chosen=state.chosen - {part}))
        case "back":
            return replace(state, at=max(0, state.at - 1))
        case _:
            return replace(state, ended=True)


def point_world_m(place_mm: Vec3, p_world_face_m: Vec3, R_world_face: Mat3) -> Vec3:
    """Return the point in the world of a place in the face frame."""
    x, y, z = place_mm
    return add(p_world_face_m, rotate(R_world_face, (x / 1e3, y / 1e3, z / 1e3)))


def place_in_face_mm(p_world_m: Vec3, p_world_face_m: Vec3, R_world_face: Mat3) -> Vec3:
    """Return the place in the face frame of a point in the world."""
    x, y, z = rotate_back(R_world_face, sub(p_world_m, p_world_face_m))
    return x * 1e3, y * 1e3, z * 1e3


def changes(state: FaceCalibration) -> dict[str, Vec3]:
    """Return the chosen places as dotted keys of a rig file and values, to 0.1 mm."""
    return {
        f"face_parts_mm.{part}": _tenths(state.place_mm(part))
        for part in ORDER
        if part in state.chosen
    }


def _tenths(place_mm: Vec3) -> Vec3:
    x, y, z = (round(v, 1) + 0.0 for v in place_mm)  # + 0.0: no -0.0 in a file
    return x, y, z


def _within(value: float, by: float) -> float:
    # A place that was written down farther out stays, but moves only inwards.
    far = max(FARTHEST_MM, abs(value))
    return max(-far, min(far, value + by))


def _with_place(state: FaceCalibration, place_mm: Vec3) -> FaceCalibration:
    places = (*state.places_mm[: state.at], place_mm, *state.places_mm[state.at + 1 :])
    return replace(state, places_mm=places)


def _next(state: FaceCalibration) -> FaceCalibration:
    at = state.at + 1
    return replace(state, at=at, ended=at >= len(ORDER))
