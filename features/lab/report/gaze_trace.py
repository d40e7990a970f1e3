"""Data of all measures and figures of the report, from one pass over the ticks of a run."""

from array import array
from collections import defaultdict
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from math import atan2, degrees, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis.blink_finder import (
    BlinkEvent,
    blinks_of,
    wider_opening,
)
from gazerig.features.lab.analysis.event_detector import FixationEvent, SaccadeEvent, find_events
from gazerig.gaze.angles import (
    add,
    angle_between,
    cross,
    dot,
    norm,
    rotate_back,
    scale,
    sub,
    unit,
    yaw_pitch,
)
from gazerig.gaze.attention.conversation import face_extent_deg
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.loop.tick import Tick, cyclopean_direction
from gazerig.robot.model.commands import Ask
from gazerig.robot.model.types import GAZE_JOINTS, order_joints

PLANE_M = -0.028
"""The plane between the tip of the nose and eyes and mouth, along the face's own x axis."""

MODES = ("none", "talk", "listen", "think", "turns")
"""Modes of conversation; turns: a voice agent reports them."""
STATES = ("idle", "listening", "thinking", "speaking", "interrupted")
"""States of a conversation with turns."""
PHASES = ("fixate", "saccade", "pursue")
"""States of the eyes, in the order of ``phase``."""

_IDLE = frozenset(("search", "glance", "rest"))
_LONGEST_FORESEEN_S = 0.3
_NEAR_PART_M, _NEAR_FACE_M = 0.03, 0.12
"""Largest distances at which a line of sight is on a part, and on a face around its centre."""
_ALONG = 0.05
"""Cosine between a line of sight and a face's direction: from 87 deg it is parallel to the face."""
_EYE_JOINTS = frozenset(name for name in GAZE_JOINTS if "eye" in name)

_COLUMNS = {
    "t": 1, "gaze": 2, "head": 3, "eye_pitch": 1, "target": 2, "target_rate": 2,
    "vergence": 1, "vergence_due": 1, "off": 2, "face": 2, "face_off": 1, "on_face": 1,
    "lid": 1, "asked_lid": 1, "asked_pitch": 1, "phase": 1, "is_face": 1,
    "idle": 1, "eye_limited": 1, "shift": 1, "mode": 1, "turn": 1, "turn_number": 1,
    "off_partner": 2, "face_edge": 1, "measured": 1, "part": 1, "on_any_face": 1, "way": 3,
    "plan": 3,
}  # fmt: skip
ROW = np.dtype([(name, float, (size,) if size > 1 else ()) for name, size in _COLUMNS.items()])
"""One tick; degrees (yaw, pitch, roll), seconds or metres; NaN if unknown.

gaze: mean line of sight in space; head: neck; eye_pitch: mean of the eyes in the head
target: direction of the current target from the head; target_rate: its speed
vergence, vergence_due: measured, and required by the target's distance
off: angles of the left and the right line of sight from the target
face: intersection of the gaze with the face (y, z), from the tip of the nose
face_off: angle of the person's face away from the robot; on_face: whether the gaze is on that face
lid: the wider opening of the upper lids, 0 shut .. 1 open
asked_lid, asked_pitch: the upper lids and the eyes as commanded by the models
phase: index in PHASES; is_face: whether the target is a face; idle: one without a person
eye_limited: whether an eye is at the end of its range, short of its target
shift: the target's event count; mode: index in MODES
turn, turn_number: state of conversation as an index in STATES, and its number
off_partner: the gaze from the partner's face; face_edge: extent of that face there
measured: whether all eyes reported their positions
part, on_any_face: index of the face part under the gaze, -1 off the parts; if on any face
way, plan: unit directions of the measured and of the planned gaze in the world
"""


LIDS = "Lids"
"""Section of the report that lids decide; eyes and neck decide the others."""


@dataclass(frozen=True)
class JointBasis:
    """The joints of a run.

    names: names in order; if empty, the joints are unknown and nothing is omitted
    estimated: joints whose servos have no feedback
    """

    names: tuple[str, ...] = ()
    estimated: tuple[str, ...] = ()

    def has_any(self, wanted: Collection[str]) -> bool:
        """Return whether the rig has any of some joints; True if none is wanted."""
        return not wanted or not self.names or not {*wanted}.isdisjoint(self.names)

    @property
    def has_measured_eye(self) -> bool:
        """Return whether an eye's servo reports its position."""
        eyes = {name for name in self.names if "eye" in name}
        return not eyes or not eyes <= {*self.estimated}

    @property
    def styles(self) -> frozenset[str]:
        """Return the styles that select notes of the bands."""
        return frozenset(("eyes parallel",) if "eyes_pan" in self.names else ())

    def basis(self, group: str) -> str:
        """Return the basis of a section of the report: its lids, or eyes and neck."""
        kinds = {name.endswith("_lid") for name in self.estimated}
        return "estimated" if (group == LIDS) in kinds else "measured"


@dataclass(frozen=True)
class GazeTrace:
    """Trace of a whole run: rows (one per tick), and events in the order of their start.

    asked_blinks: blinks as commanded by the models; kinds: seconds per kind of target
    joints: joints of the rig, and which of them are estimated
    ideal_servos: whether the servos were a lag without bytes, which says nothing about servos
    """

    rows: NDArray[np.void]
    saccades: tuple[SaccadeEvent, ...] = ()
    fixations: tuple[FixationEvent, ...] = ()
    blinks: tuple[BlinkEvent, ...] = ()
    asked_blinks: tuple[BlinkEvent, ...] = ()
    kinds: dict[str, float] = field(default_factory=dict)
    joints: JointBasis = JointBasis()
    ideal_servos: bool = False

    def column(self, name: str) -> Floats:
        """Return a column of ROW by its name, (n,) or (n, k)."""
        return np.asarray(self.rows[name])

    @property
    def seconds(self) -> float:
        """Return the length of the run."""
        t = self.column("t")
        return float(t[-1] - t[0]) if len(t) else 0.0

    @property
    def rate_hz(self) -> float:
        """Return the median tick rate, 0 for an empty run."""
        t = self.column("t")
        return float(1.0 / np.median(np.diff(t))) if len(t) > 1 else 0.0

    @property
    def mode(self) -> str:
        """Return the mode of conversation with the longest time."""
        return MODES[int(np.bincount(self.column("mode").astype(int), minlength=1).argmax())]

    def slices(self, mask: NDArray[np.bool_], least_s: float | None = None) -> list[slice]:
        """Return the stretches of rows with a true mask.

        Args:
            mask: (n,) One value a row.
            least_s: Shortest stretch; stretches also end with their target. None: all.
        """
        t, changes = self.column("t"), np.diff(mask.astype(int), prepend=0, append=0) != 0
        if least_s is not None:
            changes[1:-1] |= np.diff(self.column("shift")) != 0
        cuts = np.flatnonzero(changes).tolist()
        return [
            slice(a, b)
            for a, b in zip(cuts, cuts[1:], strict=False)
            if mask[a] and (least_s is None or (b - a > 2 and t[b - 1] - t[a] >= least_s))
        ]

    def between(self, start_s: float, end_s: float) -> slice:
        """Return the rows from ``start_s`` to before ``end_s``."""
        first, last = np.searchsorted(self.column("t"), (start_s, end_s))
        return slice(int(first), int(last))

    def slow(self, before_s: float = 0.015, after_s: float = 0.04) -> NDArray[np.bool_]:
        """Return (n,) whether each row is clear of saccades."""
        clear = np.ones(len(self.rows), dtype=bool)
        for saccade in self.saccades:
            clear[self.between(saccade.onset_s - before_s, saccade.end_s + after_s)] = False
        return clear


class GazeTraceBuilder:
    """Builds the gaze trace of a run from its ticks.

    Args:
        ideal_servos: Whether the servos are a lag without bytes.
    """

    def __init__(self, ideal_servos: bool = False) -> None:
        self._ideal_servos = ideal_servos
        self._flat = array("d")
        self._kinds: defaultdict[str, float] = defaultdict(float)
        self._mode = "none"
        self._last_s: float | None = None
        self._names: tuple[str, ...] = ()
        self._estimated = set[str]()

    def update(self, tick: Tick) -> None:
        """Add a tick; time while a user has stopped the robot does not count."""
        for command in tick.commands:
            if isinstance(command, Ask) and command.menu == "conversation":
                self._mode = command.choice if command.choice in MODES else self._mode
        self._names = tick.guard_result.joints
        self._estimated.update(tick.estimated_joints)
        if self._last_s is not None:
            self._kinds[tick.target.kind] += tick.t_s - self._last_s
        self._last_s = tick.t_s
        if not tick.stopped:
            mode = self._mode if tick.conversation.state == "idle" else "turns"
            self._flat.extend(_row(tick, MODES.index(mode)))

    def trace(self) -> GazeTrace:
        """Return the trace of all added ticks."""
        rows = np.array(self._flat).view(ROW)
        return GazeTrace(
            rows,
            *find_events(rows, rows["phase"] == PHASES.index("saccade")),
            blinks_of(rows["t"], rows["lid"], rows["eye_pitch"]),
            blinks_of(rows["t"], rows["asked_lid"], rows["asked_pitch"]),
            dict(self._kinds),
            JointBasis(order_joints(self._names), order_joints(self._estimated)),
            self._ideal_servos,
        )


def _row(tick: Tick, mode: int) -> Iterator[float]:
    """Yield the values of ROW of one tick."""
    pose, target, gaze, names = tick.pose, tick.target, tick.gaze, tick.guard_result.joints
    head, left, right = pose.p_world_head_m, pose.p_world_eye_left_m, pose.p_world_eye_right_m
    way = cyclopean_direction(tick)
    moved = scale(target.v_world_m_s, min(max(0.0, tick.t_s - target.at_s), _LONGEST_FORESEEN_S))
    point = add(target.p_world_m, moved)
    rel = sub(point, head)
    x, y, _ = rotate_back(pose.R_world_head, rel)
    half = 0.5 * norm(sub(left, right))
    eye_left, eye_right = pose.eye_left_rad, pose.eye_right_rad
    yield tick.t_s
    yield from map(degrees, (
        *yaw_pitch(way), *pose.head_rad, 0.5 * (eye_left[1] + eye_right[1]),
        *yaw_pitch(rel), *_rates(rel, target.v_world_m_s),
        eye_right[0] - eye_left[0], atan2(y + half, x) - atan2(y - half, x),
        angle_between(line_of_sight(pose, True), sub(point, left)),
        angle_between(line_of_sight(pose, False), sub(point, right)),
    ))  # fmt: skip
    yield from _face_gaze(tick, way)
    yield wider_opening(pose.lid_left, pose.lid_right, names)
    yield wider_opening(gaze.lid_left, gaze.lid_right, names)
    yield degrees(0.5 * (gaze.eye_left_rad[1] + gaze.eye_right_rad[1]))
    yield PHASES.index(gaze.phase)
    yield target.kind == "face"
    yield target.kind in _IDLE
    yield any("eye" in limited.axis for limited in gaze.limited)
    yield target.shift
    yield mode
    yield STATES.index(tick.conversation.state)
    yield tick.conversation.number
    yield from _off_partner(tick, way)
    yield _EYE_JOINTS.isdisjoint(tick.joints.missing)
    yield from _part_looked_at(tick, way)
    yield from way
    yield from unit(sub(gaze.gaze_point_world_m, head))


def _off_partner(tick: Tick, way: Vec3) -> tuple[float, float, float]:
    """Return yaw and pitch of the gaze from the partner's face, and its extent; nan if unknown."""
    now = tick.conversation
    wanted = now.partner if now.partner is not None else tick.target.id
    for face in tick.percept.faces if tick.percept is not None and now.state != "idle" else ():
        if face.id == wanted:
            rel = sub(face.p_world_m, tick.pose.p_world_head_m)
            yaw, pitch = np.subtract(yaw_pitch(way), yaw_pitch(rel)).tolist()
            return degrees(yaw), degrees(pitch), face_extent_deg(atan2(pitch, -yaw), norm(rel))
    return nan, nan, nan


def _rates(rel: Vec3, v: Vec3) -> tuple[float, float]:
    """Return yaw and pitch rate of a moving point, seen from a head at rest."""
    x, y, z = rel
    level2 = x * x + y * y
    if level2 < 1e-6:
        return 0.0, 0.0
    level = level2**0.5
    yaw_rate = (x * v[1] - y * v[0]) / level2
    outward = (x * v[0] + y * v[1]) / level
    return yaw_rate, (level * v[2] - z * outward) / (level2 + z * z)


def _part_looked_at(tick: Tick, way: Vec3) -> tuple[float, bool]:
    """Return the index of the face part under the gaze, -1 off them, and if it is on a face."""
    for face in tick.percept.faces if tick.percept is not None else ():
        moved = sub(_moved_m(tick, face), tick.pose.p_world_head_m)
        if miss_distance_m(way, add(face.p_world_m, moved)) <= _NEAR_FACE_M:
            apart = [miss_distance_m(way, add(p, moved)) for p in face.parts_world_m]
            least = min(apart)
            return (apart.index(least) if least <= _NEAR_PART_M else -1), True
    return -1, False


def _face_gaze(tick: Tick, way: Vec3) -> tuple[float, float, float, float]:
    """Return the gaze at the target's face, or else at the first one: face, face_off, on_face."""
    percept, head = tick.percept, tick.pose.p_world_head_m
    if percept is None or not percept.faces:
        return nan, nan, nan, 0.0
    face = next((one for one in percept.faces if one.id == tick.target.id), percept.faces[0])
    nose = add(face.p_world_m, _moved_m(tick, face))
    R = face.R_world_face
    ahead = R[0][0], R[1][0], R[2][0]
    centre = add(nose, scale(ahead, PLANE_M))
    meets = None
    if dot(way, sub(centre, head)) > 0.0:
        meets = gaze_point_on_face(head, way, centre, R)
    off_deg = degrees(angle_between(ahead, sub(head, face.p_world_m)))
    return *(meets or (nan, nan)), off_deg, miss_distance_m(way, sub(nose, head)) <= _NEAR_FACE_M


def _moved_m(tick: Tick, face: Any) -> Vec3:
    """Return how far a face has moved since its frame."""
    assert tick.percept is not None
    since_s = min(max(0.0, tick.t_s - tick.percept.captured_s), _LONGEST_FORESEEN_S)
    return scale(face.v_world_m_s, since_s)


def gaze_point_on_face(
    p_world_eye_m: Vec3, direction_world: Vec3, p_world_face_m: Vec3, R_world_face: Mat3
) -> tuple[float, float] | None:
    """Return the intersection of a line of sight with the plane of a face: (y, z) in its frame.

    None if the line is parallel to the plane or points away, or the face is seen from behind.
    """
    out = (R_world_face[0][0], R_world_face[1][0], R_world_face[2][0])
    towards = dot(direction_world, out)
    before = dot(sub(p_world_eye_m, p_world_face_m), out)
    if towards > -_ALONG or before <= 0.0:
        return None
    distance = before / -towards
    meets = add(p_world_eye_m, scale(direction_world, distance))
    _, y, z = rotate_back(R_world_face, sub(meets, p_world_face_m))
    return (y, z)


def miss_distance_m(direction: Vec3, rel_m: Vec3) -> float:
    """Return the distance between a line of sight and a place; both are relative to the eye."""
    if dot(direction, rel_m) <= 0.0:
        return norm(rel_m)
    return norm(cross(direction, rel_m))
