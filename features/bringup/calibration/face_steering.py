"""Gaze that a person steers over their own face: chooses the target instead of attention.

The target is one part of the nearest face, placed again with the face's full pose at every
tick, so the person may move while judging. Everything after it is as always: oculomotor
model, guard, servos.
"""

from math import degrees, inf

from gazerig.features.bringup.calibration.face_calibration import (
    FaceCalibration,
    Key,
    apply_key,
    point_world_m,
)
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.attention.top_down import TopDown
from gazerig.gaze.types import Face, GazeState, Percept, Target, Vec3
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.gaze_error import gaze_error

AIMED_DEG = 1.0
"""Largest gaze error at which the eyes look at the part."""

STALE_S = 0.4
"""No face is seen in an image older than this."""

WAIT_S = 1.5
"""Time for which an Enter waits for moving eyes."""

_LOST_S = 5.0
_STILL: Vec3 = (0.0, 0.0, 0.0)
# The head turns to the face as far as it can, which leaves the eyes their whole range.
_PULL = 1.0


class FaceSteering:
    """A gazerig.robot.control.loop.Chooser whose choices come from keys.

    state: progress of the calibration
    face: the face that is looked at, None while none is seen
    error_deg: angle of the worse eye from the part, as measured, or of the mean line of sight
        of eyes that share one linkage for yaw; inf while unknown

    Args:
        state: where to start.
        top_down: the behaviours, of which none is active.
        rest_world_m: where to look while no face is seen.
        converges: each eye has a yaw joint of its own.
    """

    def __init__(
        self,
        state: FaceCalibration,
        top_down: TopDown,
        rest_world_m: Vec3,
        converges: bool = True,
    ) -> None:
        self._converges = converges
        self.top_down = top_down
        self._begin = state
        self._rest = rest_world_m
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Reset."""
        self.state = self._begin
        self.face: Face | None = None
        self.error_deg = inf
        self._identity: object = None
        self._shift = 0
        self._lost_at = self._rest
        self._seen_s = -inf
        self._entered_s: float | None = None

    @property
    def is_aimed(self) -> bool:
        """Return whether both eyes are on the part and no key is waiting."""
        return self.face is not None and self._entered_s is None and self.error_deg <= AIMED_DEG

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Target:
        """Return the part that is due as target, or where to wait while no face is seen."""
        followed, self.face = self.face.id if self.face is not None else None, None
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
            # At the last face, and after a while straight ahead.
            lost = t_s - self._seen_s > _LOST_S
            p = self._rest if lost else self._lost_at
            self._count(("rest", lost))
            return Target(
                p, _STILL, t_s, "rest", -1, _PULL, True, None, self._shift, "no face seen"
            )
        self._seen_s = t_s
        place = self.state.place_mm(part)
        p = self._lost_at = point_world_m(place, face.p_world_m, face.R_world_face)
        self._count((face.id, part, place))
        why = f"steered to this part of face {face.id}"
        return Target(
            p, face.v_world_m_s, percept.captured_s, "part", face.id, _PULL, True, part,
            self._shift, why, face.p_world_m,
        )  # fmt: skip

    def press(self, key: Key, t_s: float) -> str | None:
        """Apply a key; return why that is impossible.

        An Enter counts as soon as the eyes are on the part, see ``update``.
        """
        if key != "end" and self.face is None:
            return "no face is seen: keys wait until one is"
        if key == "enter":
            self._entered_s = t_s
            return None
        self._entered_s = None
        self.state = apply_key(self.state, key)
        self.error_deg = inf
        return None

    def update(self, tick: Tick) -> str | None:
        """Measure the gaze; return why a waiting Enter was dropped."""
        self.error_deg = self._gaze_error_deg(tick)
        if tick.target.kind != "part" or tick.gaze.phase == "saccade":
            self.error_deg = inf
        if self._entered_s is None:
            return None
        if self.error_deg <= AIMED_DEG:
            self._entered_s = None
            self.state = apply_key(self.state, "enter")
            self.error_deg = inf
        elif tick.t_s - self._entered_s > WAIT_S:
            self._entered_s = None
            off = self._gaze_error_deg(tick)
            return (
                f"not taken: the eyes are {off:.1f} deg off the point, as far as they can turn; "
                "come before the robot, nearer to where its head points"
            )
        return None

    def _gaze_error_deg(self, tick: Tick) -> float:
        """Return the angle of the gaze from the part, as far as the eyes can meet it."""
        return degrees(gaze_error(tick.target.p_world_m, tick.pose, self._converges).whole)

    def _count(self, identity: object) -> None:
        """Count a shift whenever another point is looked at."""
        self._shift += identity != self._identity
        self._identity = identity
