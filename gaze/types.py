"""Values that flow through the gaze models.

Frames (REP-103): ``world`` at the neck base, x forward, y left, z up; ``head`` midway
between the eyes with the same axes. Yaw + left, pitch + up, roll + right ear down.
Radians, metres, seconds. ``R_world_head`` maps head coordinates to world coordinates.

Single points are plain tuples of floats, which in a 5 ms tick are several times
cheaper than three-element arrays; only sets of bodies are arrays.
"""

from typing import Literal, NamedTuple, Protocol

import numpy as np
from msgspec import Struct, field, structs
from numpy.typing import NDArray

from gazerig.gaze.angles import Angles2 as Angles2
from gazerig.gaze.angles import Angles3 as Angles3
from gazerig.gaze.angles import Mat3 as Mat3
from gazerig.gaze.angles import Vec3 as Vec3

Floats = NDArray[np.float64]


def vec(row: Floats) -> Vec3:
    """Return an array of three numbers as a tuple."""
    x, y, z = row.tolist()
    return (x, y, z)


FIRST_THING = 1_000_001
"""Id of the first hand or thing: the ids of people count from 1, and each id is of one body."""


def body_name(kind: str, id: int) -> str:
    """Return the name of a body in messages: its kind and its number among people or things."""
    return kind if id < 0 else f"{kind} {id - FIRST_THING + 1 if id >= FIRST_THING else id}"


Phase = Literal["fixate", "saccade", "pursue"]
TurnState = Literal["idle", "listening", "thinking", "speaking", "interrupted"]
"""What the head does in a conversation; interrupted: it listens, after an interruption of its own
turn.
"""

# The eight face parts in the order of the transition matrix (Nakamoto & Tsuruno, eq 1);
# left and right are the owner's own.
PARTS = ("DN", "FL", "LE", "M", "N", "FR", "RE", "UP")
PART_NAMES = {
    "DN": "chin",
    "FL": "left side",
    "LE": "left eye",
    "M": "mouth",
    "N": "nose",
    "FR": "right side",
    "RE": "right eye",
    "UP": "forehead",
}


class Bodies(Struct, frozen=True, gc=False):
    """Possible targets of the gaze, one row per body.

    ids:       stable identity of each body; of people from 1, of hands and things from FIRST_THING
    kinds:     "face", "hand", "thing", ... as perception named it
    p_world_m: (n, 3) positions of the centres
    v_world_m_s: (n, 3) velocities
    w_world_rad_s: (n, 3) angular velocities
    radius_m:  (n,) half the size
    v_cov:     (n, 3, 3) covariance of the velocity, None where unknown
    cut_off:   ids of those at the edge of the picture or outside it
    lifeless:  ids of the faces that have not moved for seconds, or are on a screen
    """

    ids: tuple[int, ...] = ()
    kinds: tuple[str, ...] = ()
    p_world_m: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    v_world_m_s: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    w_world_rad_s: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    radius_m: Floats = field(default_factory=lambda: np.zeros(0))
    v_cov: Floats | None = None
    cut_off: tuple[int, ...] = ()
    lifeless: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Give arrays without rows their columns, which a recording does not have."""
        if not self.ids:
            for name in ("p_world_m", "v_world_m_s", "w_world_rad_s"):
                structs.force_setattr(self, name, np.zeros((0, 3)))

    def __len__(self) -> int:
        """Return the number of bodies."""
        return len(self.ids)

    def rows(self) -> "BodyRows":
        """Return the bodies as plain numbers."""
        columns = self.p_world_m, self.v_world_m_s, self.w_world_rad_s
        return BodyRows(self.ids, self.kinds, *([*map(tuple, one.tolist())] for one in columns))


class BodyRows(NamedTuple):
    """Bodies as plain numbers, for the few that there usually are; fields as in ``Bodies``."""

    ids: tuple[int, ...]
    kinds: tuple[str, ...]
    p_world_m: list[Vec3]
    v_world_m_s: list[Vec3]
    w_world_rad_s: list[Vec3]


class Face(Struct, frozen=True, gc=False):
    """One person's face in the world.

    id:            stable identity, equal to the id of its row in Bodies
    p_world_m:     face centre, the nose (Nakamoto & Tsuruno 4.4.2)
    v_world_m_s:   velocity of the centre
    R_world_face:  face axes in the world: x out of the face, y to the owner's left, z up
    parts_world_m: the eight parts in the order of PARTS
    confidence:    0..1 of the detector
    distance_from: source of the distance: "camera", its depth; "face size", an adult's or the
        learned one of this person; "" if unknown
    along_sd_m:    standard deviation of the position along the view
    off_head_rad:  angle between the person's gaze and the direction to the robot's head; None in
        recordings without it
    looks_at_head: whether the person looks at the robot's head (gaze at robot: one side of mutual
        gaze); None if that is too uncertain
    gaze_world:    direction of the gaze of the eyes; None if the detector does not find it
    eye_opening: opening of the lids divided by the usual one, 0 is shut; None if not found
    mouth_opening_m: gap between the lips, at an adult's size; None if not found
    speaks:        whether the mouth moves like that of a speaking person; None if not found
    has_moved:     whether the face has moved since it came into view, which a picture does not
    """

    id: int
    p_world_m: Vec3
    v_world_m_s: Vec3
    R_world_face: Mat3
    parts_world_m: tuple[Vec3, ...]
    confidence: float
    distance_from: str = ""
    along_sd_m: float = 0.0
    off_head_rad: float | None = None
    looks_at_head: bool | None = None
    gaze_world: Vec3 | None = None
    eye_opening: float | None = None
    mouth_opening_m: float | None = None
    speaks: bool | None = None
    has_moved: bool = False


class Percept(Struct, frozen=True, gc=False):
    """Contents of one frame, in the world by the head pose at its time of capture.

    scene: number of cuts before this frame; after a cut earlier bodies no longer exist
    """

    captured_s: float
    bodies: Bodies = field(default_factory=Bodies)
    faces: tuple[Face, ...] = ()
    scene: int = 0

    def age_s(self, t_s: float) -> float:
        """Return the age of the frame at ``t_s``."""
        return t_s - self.captured_s


ORDERED = "puppet"
"""Kind of a target commanded by a person or a program: the gaze rests exactly on that point."""
AWAY = "away"
"""Kind of a target next to a face during a look away from it."""
SEARCH = "search"
"""Kind of a target at a possible place of a lost person."""


class Salience(Struct, frozen=True, gc=False):
    """Salience of one body, term by term (Mitake et al., eq 1 and the rules).

    translation, looming, rotation: the three terms of eq 1; onset: of a recent entry into view
    rule:     constant of the rule that points at it, 0 without one
    habituation: factor 0..1 of habituation, inhibition of return, and of a face that looks
        elsewhere
    total:    the compared amount of attention
    """

    id: int
    kind: str
    translation: float = 0.0
    looming: float = 0.0
    rotation: float = 0.0
    onset: float = 0.0
    rule: float = 0.0
    habituation: float = 1.0
    total: float = 0.0


class Target(Struct, frozen=True, gc=False):
    """Target of the gaze, with its reason.

    p_world_m, v_world_m_s: the point and its velocity, as at ``at_s``
    kind:     "face", "hand", "thing", "idle", ...
    id:       body or face id, -1 without one
    salience: amount of attention A (Mitake et al., eq 1 or the rule's constant)
    top_down: whether a rule chose it
    part:     face part code if the target is a face
    shift:    increases whenever another object or part is chosen: the saccade's event flag
    why:      reason as text
    centre_world_m: goal of the head, e.g. the face's centre; None: the point itself
    plan:     choice of the action planner (gazerig.gaze.attention.action_planner) with its reason;
        "" without one
    saliences: saliences of the winner and of the next three, highest first
    is_lost:  whether it is not visible and the gaze is on its last position
    urgent:   whether the head comes along at once: a speaker, an addressed partner, a person who
        has just appeared, or a body cut off by the picture's edge
    """

    p_world_m: Vec3
    v_world_m_s: Vec3
    at_s: float
    kind: str
    id: int
    salience: float
    top_down: bool
    part: str | None
    shift: int
    why: str
    centre_world_m: Vec3 | None = None
    plan: str = ""
    saliences: tuple[Salience, ...] = ()
    is_lost: bool = False
    urgent: bool = False


class GazeState(Struct, frozen=True, gc=False):
    """Measured position of head and eyes.

    head_rad, head_rate_rad_s: (yaw, pitch, roll) of the neck and their rates
    eye_left_rad, eye_right_rad: (yaw, pitch) in the head
    R_world_head, p_world_head_m: pose of the head frame
    p_world_eye_left_m, p_world_eye_right_m: centres of rotation of the eyes
    lid_left, lid_right: opening of the upper lids, 0 shut .. 1 open
    lower_left, lower_right: opening of the lower lids
    """

    head_rad: Angles3
    head_rate_rad_s: Angles3
    eye_left_rad: Angles2
    eye_right_rad: Angles2
    R_world_head: Mat3
    p_world_head_m: Vec3
    p_world_eye_left_m: Vec3
    p_world_eye_right_m: Vec3
    lid_left: float
    lid_right: float
    lower_left: float = 1.0
    lower_right: float = 1.0


class LimitedAngle(Struct, frozen=True, gc=False):
    """An angle clipped by a range, in radians: requested, and executed.

    axis: "left eye yaw", "right eye pitch", "head yaw", "head pitch"
    """

    axis: str
    asked_rad: float
    done_rad: float
    reason: str


class GazeCommand(Struct, frozen=True, gc=False):
    """The commands of the gaze models for this tick.

    head_rad: (yaw, pitch, roll); eye_left_rad, eye_right_rad: (yaw, pitch) in the head
    lid_left, lid_right: opening of the upper lids, 0 shut .. 1 open
    phase:    phase of the eye movement; blink: whether a blink is in progress
    gaze_point_world_m: point at which both eyes are aimed now
    saccades, fixations, blinks: counts since the reset
    lower_left, lower_right: opening of the lower lids, 0 shut .. 1 open
    limited:  limits that keep the eyes from the gaze point, empty without any
    """

    head_rad: Angles3
    eye_left_rad: Angles2
    eye_right_rad: Angles2
    lid_left: float
    lid_right: float
    phase: Phase
    blink: bool
    gaze_point_world_m: Vec3
    saccades: int
    fixations: int
    blinks: int
    lower_left: float = 1.0
    lower_right: float = 1.0
    limited: tuple[LimitedAngle, ...] = ()


class HeadGeometry(Protocol):
    """Kinematics that the oculomotor models need (gazerig.robot.model.kinematics)."""

    def head_pose(self, head_rad: Angles3) -> tuple[Mat3, Vec3]:
        """Return R_world_head and p_world_head_m for angles of the neck."""
        ...

    def neck_angles_to(self, p_world_m: Vec3) -> Angles2:
        """Return the neck yaw and pitch that point the head's x axis through a point."""
        ...

    def eye_angles_to(
        self, p_world_m: Vec3, R_world_head: Mat3, p_world_head_m: Vec3
    ) -> tuple[Angles2, Angles2]:
        """Return the left and right eye angles that fixate a point from a head pose."""
        ...

    def convergence_rad(self, distance_m: float) -> float:
        """Return the angle by which each eye turns in for a point straight ahead."""
        ...
