"""Data of all measures and figures of the report, from one pass over the ticks of a run."""

from array import array
from collections import defaultdict
from dataclasses import dataclass, field
from math import atan2, degrees, inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.analysis.blink_finder import (
    LOWER,
    UPPER,
    BlinkEvent,
    blinks_of,
    wider_opening,
)
from gazerig.features.lab.analysis.event_detector import (
    NEAR_FACE_M,
    EventDetector,
    FixationEvent,
    SaccadeEvent,
    miss_distance_m,
)
from gazerig.features.lab.analysis.gaze_on_face import gaze_point_on_face
from gazerig.features.lab.report.joint_basis import JointBasis
from gazerig.features.lab.report.turns import STATES, TurnTrace
from gazerig.gaze.angles import add, angle_between, dot, norm, rotate_back, scale, sub, yaw_pitch
from gazerig.gaze.attention.conversation import face_extent_deg
from gazerig.gaze.field_of_view import head_in_space, line_of_sight
from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.control.feedback_basis import estimated_joints
from gazerig.robot.control.tick import Tick, cyclopean_direction
from gazerig.robot.model.commands import Ask
from gazerig.robot.model.types import order_joints

_LONGEST_S = 1.0
"""A later saccade is a choice, not a reaction."""


class ReactionFinder:
    """Finds reactions in ticks as they arrive: saccades to things that have just come into view."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, int], float] = {}
        self._captured_s: float | None = None
        self._saccades = -1

    def update(self, tick: Tick) -> float | None:
        """Add a tick; return the time from the first frame with a thing to its saccade, if any."""
        percept = tick.percept
        if percept is not None and percept.captured_s != self._captured_s:
            # A thing in the first percept has not come into view.
            since_s = -inf if self._captured_s is None else percept.captured_s
            self._captured_s = percept.captured_s
            for number, kind in zip(percept.bodies.ids, percept.bodies.kinds, strict=True):
                self._seen.setdefault((kind, number), since_s)
        began = 0 <= self._saccades < tick.gaze.saccades
        self._saccades = tick.gaze.saccades
        name = (tick.target.kind, tick.target.id)
        if not began or tick.stopped or name not in self._seen:
            return None
        latency_s = tick.t_s - self._seen[name]
        self._seen[name] = -inf
        return latency_s if latency_s <= _LONGEST_S else None


PLANE_M = -0.028
"""The plane between the tip of the nose and eyes and mouth, along the face's own x axis."""

MODES = ("none", "talk", "listen", "think", "turns")
"""Modes of conversation; turns: a voice agent reports them."""
_TURNS = MODES.index("turns")
PHASES = ("fixate", "saccade", "pursue")
"""States of the eyes, in the order of ``phase``."""

_IDLE = frozenset(("search", "glance", "rest"))
_LONGEST_FORESEEN_S = 0.3


class TraceRow(NamedTuple):
    """One tick; degrees, seconds or metres unless the name has a unit; nan if unknown.

    gaze_*: mean line of sight in space; head_*, eye_*: neck, and mean eye in the head
    idle: whether the target is one of those without a person
    eye_limited: whether an eye is at the end of its range, short of its target
    target_*: direction of the current target from the head; target_*_rate: its speed
    vergence, vergence_due: measured, and required by the target's distance
    off_left, off_right: angle of each line of sight from the target
    face_y, face_z: intersection of the gaze with the face, from the tip of the nose
    face_off: angle of the person's face away from the robot
    lid, lower_lid: the wider opening of the upper and of the lower lids, 0 shut .. 1 open
    shift: the target's event count; mode: index in MODES
    turn, turn_number: state of conversation as an index in turns.STATES, and its number
    off_yaw, off_pitch: the gaze from the partner's face; face_edge: extent of that face there
    """

    t: float
    gaze_yaw: float
    gaze_pitch: float
    head_yaw: float
    head_pitch: float
    head_roll: float
    eye_pitch: float
    target_yaw: float
    target_pitch: float
    target_yaw_rate: float
    target_pitch_rate: float
    vergence: float
    vergence_due: float
    off_left: float
    off_right: float
    face_y: float
    face_z: float
    face_off: float
    on_face: float
    lid: float
    lower_lid: float
    phase: float
    is_face: float
    idle: float
    eye_limited: float
    shift: float
    mode: float
    turn: float
    turn_number: float
    off_yaw: float
    off_pitch: float
    face_edge: float


@dataclass(frozen=True)
class GazeTrace:
    """Trace of a whole run: columns (one value per tick), and events in the order of their start.

    asked_blinks: blinks as commanded by the models; kinds: seconds per kind of target
    joints: joints of the rig, and which of them are estimated
    reactions_s: latencies of reactions to things that came into view
    ideal_servos: whether the servos were a lag without bytes, which says nothing about servos
    """

    rows: Floats
    saccades: tuple[SaccadeEvent, ...]
    fixations: tuple[FixationEvent, ...]
    blinks: tuple[BlinkEvent, ...]
    asked_blinks: tuple[BlinkEvent, ...] = ()
    kinds: dict[str, float] = field(default_factory=dict)
    joints: JointBasis = JointBasis()
    reactions_s: tuple[float, ...] = ()
    ideal_servos: bool = False

    def column(self, name: str) -> Floats:
        """Return a column of Row by its name."""
        return np.asarray(self.rows[:, TraceRow._fields.index(name)])

    def columns(self, *names: str) -> Floats:
        """Return columns (n, k) by their names."""
        return self.rows[:, [TraceRow._fields.index(name) for name in names]]

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
        modes = self.column("mode")
        return MODES[int(np.bincount(modes.astype(int)).argmax())] if len(modes) else "none"

    def turns(self) -> TurnTrace:
        """Return the turns of conversation, and the gaze from the partner's face."""
        return TurnTrace(
            self.column("t"), self.column("turn"), self.column("turn_number"),
            self.columns("off_yaw", "off_pitch"), self.column("face_edge"),
        )  # fmt: skip

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
        self._events = EventDetector()
        self._flat = array("d")
        self._asked_lids = array("d")
        self._new, self._reactions_s = ReactionFinder(), list[float]()
        self._kinds: defaultdict[str, float] = defaultdict(float)
        self._mode = 0
        self._last_s: float | None = None
        self._names: tuple[str, ...] = ()
        self._estimated: dict[str, None] = {}

    def update(self, tick: Tick) -> None:
        """Add a tick; time while a user has stopped the robot does not count."""
        for command in tick.commands:
            if isinstance(command, Ask) and command.menu == "conversation":
                self._mode = MODES.index(command.choice) if command.choice in MODES else self._mode
        self._events.update(tick)
        latency_s = self._new.update(tick)
        if latency_s is not None:
            self._reactions_s.append(latency_s)
        self._names = tick.guard_result.joints
        self._estimated.update(dict.fromkeys(estimated_joints(tick)))
        if self._last_s is not None:
            self._kinds[tick.target.kind] += tick.t_s - self._last_s
        self._last_s = tick.t_s
        if not tick.stopped:
            turn = tick.conversation.state
            self._flat.extend(trace_row(tick, self._mode if turn == "idle" else _TURNS))
            gaze = tick.gaze
            lid = wider_opening(gaze.lid_left, gaze.lid_right, self._names, UPPER)
            pitch = 0.5 * (gaze.eye_left_rad[1] + gaze.eye_right_rad[1])
            self._asked_lids.extend((lid, degrees(pitch)))

    def trace(self) -> GazeTrace:
        """Return the trace of all added ticks."""
        rows = np.array(self._flat).reshape(-1, len(TraceRow._fields))
        t_s, lid, pitch = (
            rows[:, TraceRow._fields.index(name)] for name in ("t", "lid", "eye_pitch")
        )
        return GazeTrace(
            rows,
            tuple(self._events.saccades),
            tuple(self._events.fixations),
            blinks_of(t_s, lid, pitch),
            blinks_of(t_s, *np.array(self._asked_lids).reshape(-1, 2).T),
            dict(self._kinds),
            JointBasis(order_joints(self._names), order_joints(self._estimated)),
            tuple(self._reactions_s),
            self._ideal_servos,
        )


def trace_row(tick: Tick, mode: int) -> TraceRow:
    """Return the columns of one tick."""
    pose, target, names = tick.pose, tick.target, tick.guard_result.joints
    head, left, right = pose.p_world_head_m, pose.p_world_eye_left_m, pose.p_world_eye_right_m
    sight_left, sight_right = line_of_sight(pose, True), line_of_sight(pose, False)
    way = cyclopean_direction(tick)
    moved = scale(target.v_world_m_s, min(max(0.0, tick.t_s - target.at_s), _LONGEST_FORESEEN_S))
    point = add(target.p_world_m, moved)
    rel = sub(point, head)
    yaw, pitch = yaw_pitch(way)
    at_yaw, at_pitch = yaw_pitch(rel)
    yaw_rate, pitch_rate = _rates(rel, target.v_world_m_s)
    x, y, _ = rotate_back(pose.R_world_head, rel)
    half = 0.5 * norm(sub(left, right))
    eye_left, eye_right = pose.eye_left_rad, pose.eye_right_rad
    turned = head_in_space(pose)
    return TraceRow(
        tick.t_s, degrees(yaw), degrees(pitch),
        degrees(turned[0]), degrees(turned[1]), degrees(turned[2]),
        degrees(0.5 * (eye_left[1] + eye_right[1])),
        degrees(at_yaw), degrees(at_pitch), degrees(yaw_rate), degrees(pitch_rate),
        degrees(eye_right[0] - eye_left[0]), degrees(atan2(y + half, x) - atan2(y - half, x)),
        degrees(angle_between(sight_left, sub(point, left))),
        degrees(angle_between(sight_right, sub(point, right))),
        *_face_gaze(tick, way),
        wider_opening(pose.lid_left, pose.lid_right, names, UPPER),
        wider_opening(pose.lower_left, pose.lower_right, names, LOWER),
        PHASES.index(tick.gaze.phase),
        float(target.kind == "face"), float(target.kind in _IDLE),
        float(any("eye" in limited.axis for limited in tick.gaze.limited)), target.shift, mode,
        STATES.index(tick.conversation.state), tick.conversation.number,
        *_off_partner(tick, (yaw, pitch)),
    )  # fmt: skip


def _off_partner(tick: Tick, gaze_rad: tuple[float, float]) -> tuple[float, float, float]:
    """Return yaw and pitch of the gaze from the partner's face, and its extent; nan if unknown."""
    now = tick.conversation
    wanted = now.partner if now.partner is not None else tick.target.id
    for face in tick.percept.faces if tick.percept is not None and now.state != "idle" else ():
        if face.id == wanted:
            rel = sub(face.p_world_m, tick.pose.p_world_head_m)
            at_yaw, at_pitch = yaw_pitch(rel)
            yaw, pitch = gaze_rad[0] - at_yaw, gaze_rad[1] - at_pitch
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


class _FaceGaze(NamedTuple):
    """The gaze at a face: where it meets the face, its turn from the robot, whether it is on it."""

    y: float = nan
    z: float = nan
    off_deg: float = nan
    on_face: float = 0.0


def _face_gaze(tick: Tick, way: Vec3) -> _FaceGaze:
    """Return the gaze at the target's face, or else at the first one."""
    percept, head = tick.percept, tick.pose.p_world_head_m
    if percept is None or not percept.faces:
        return _FaceGaze()
    face = next((one for one in percept.faces if one.id == tick.target.id), percept.faces[0])
    since_s = min(max(0.0, tick.t_s - percept.captured_s), _LONGEST_FORESEEN_S)
    nose = add(face.p_world_m, scale(face.v_world_m_s, since_s))
    R = face.R_world_face
    ahead = R[0][0], R[1][0], R[2][0]
    centre = add(nose, scale(ahead, PLANE_M))
    meets = None
    if dot(way, sub(centre, head)) > 0.0:
        meets = gaze_point_on_face(head, way, centre, R)
    return _FaceGaze(
        *(meets or (nan, nan)),
        degrees(angle_between(ahead, sub(head, face.p_world_m))),
        float(miss_distance_m(way, sub(nose, head)) <= NEAR_FACE_M),
    )
