"""Eyes by the rules of Nakamoto & Tsuruno 3.4: turned in shifts, by opposite angles between them.

An eye turns towards its target in a shift alone. While it stands, a turn of the head by (x, y, z)
turns it by (-x, -y, -z), the paper's vestibulo-ocular reflex. An eye that would have to turn beyond
its range, 20 deg in the paper, is not turned at all; the reflex goes on meanwhile.

Opposite angles are the inverse of a turn about one axis only: of a turn by 20 deg of yaw and 10 of
pitch they leave 0.7 deg. The next shift closes that; nothing else does.
"""

from gazerig.gaze.angles import add, norm, rotate, scale, sub, yaw_pitch
from gazerig.gaze.oculomotor.binocular import EyeGeometry, Eyes, SaccadeState, version_of
from gazerig.gaze.types import Angles2, Target, Vec3

_STRAIGHT: Eyes = ((0.0, 0.0), (0.0, 0.0))


class OppositeAngles:
    """Angles of both eyes, tick by tick."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget where eyes and head were; the eyes begin where they are next asked for."""
        self._eyes: Eyes | None = None
        self._head_rad: Angles2 = (0.0, 0.0)

    def fixate(
        self,
        target: Target,
        gaze: Vec3,
        prescribed: Eyes | None,
        saccades: SaccadeState,
        view: EyeGeometry,
        t_s: float,
        dt_s: float,
    ) -> tuple[Eyes, Vec3]:
        """Return the eye angles for the next period, and the point that they fixate.

        gaze: the point fixated so far, or that a shift prescribes
        prescribed: eye angles of a shift; None: the eyes stand
        """
        R, before = view.R_world_head, self._head_rad
        self._head_rad = head = yaw_pitch((R[0][0], R[1][0], R[2][0]))
        wanted = view.eyes_to(gaze) if self._eyes is None else prescribed
        if wanted is not None and view.in_range(wanted) == wanted:
            self._eyes = wanted
            return wanted, gaze
        left, right = self._eyes or _STRAIGHT
        if self._eyes is not None:
            left, right = negated(left, before, head), negated(right, before, head)
        self._eyes = left, right
        ahead = rotate(R, version_of(self._eyes).ahead)
        return self._eyes, add(view.p_head, scale(ahead, norm(sub(target.p_world_m, view.p_head))))


def negated(eye_rad: Angles2, head_before_rad: Angles2, head_rad: Angles2) -> Angles2:
    """Return the eye angles of the rule (-x, -y), literally."""
    return (
        eye_rad[0] - (head_rad[0] - head_before_rad[0]),
        eye_rad[1] - (head_rad[1] - head_before_rad[1]),
    )
