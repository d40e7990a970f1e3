"""Dimensions of a body as fractions of its stature.

Lengths are those of Drillis & Contini (1966), Body segment parameters, fig. 1 (heights of the
joints and breadths as fractions of the stature), as reprinted by Winter, Biomechanics and motor
control of human movement, fig. 4.1. The head is that of gazerig.robot.description.people,
with the eye distance of Mitake et al., table 1; a child's is a little smaller.
"""

from typing import NamedTuple

from gazerig.gaze.types import Vec3

ADULT_M = 1.72
"""Stature at which the head has the size of the canonical face."""


class Measures(NamedTuple):
    """Lengths of one body, m, from its stature.

    head_scale: size of the head relative to the canonical one
    """

    stature_m: float
    head_scale: float
    ankle_m: float
    shank_m: float
    thigh_m: float
    hip_m: float
    half_hips_m: float
    waist_m: float
    shoulder_m: float
    half_shoulders_m: float
    neck_m: float
    upper_arm_m: float
    forearm_m: float
    hand_m: float
    foot_m: float

    @property
    def leg_m(self) -> float:
        """Return the length of a straight leg from hip to ankle."""
        return self.thigh_m + self.shank_m

    @property
    def arm_m(self) -> float:
        """Return the length of a straight arm from shoulder to wrist."""
        return self.upper_arm_m + self.forearm_m

    @property
    def skull_m(self) -> Vec3:
        """Return the joint between skull and spine, from the tip of the nose."""
        x, y, z = SKULL_M
        return self.head_scale * x, y, self.head_scale * z


SKULL_M: Vec3 = (-0.096, 0.0, -0.012)
"""The joint between skull and spine in the face frame of an adult: below the ears."""
_NOSE_BELOW_EYES_M = 0.035


def measures(stature_m: float) -> Measures:
    """Return the measures of a body."""
    h = stature_m
    # A child's head is nearly an adult's: 0.9 of its size at 1.1 m (Farkas 1994, head height).
    scale = 1.0 + 0.16 * (h - ADULT_M) if h < ADULT_M else 1.0 + 0.08 * (h - ADULT_M)
    eyes = 0.936 * h
    skull = eyes - scale * (_NOSE_BELOW_EYES_M - SKULL_M[2])
    return Measures(
        stature_m=h,
        head_scale=scale,
        ankle_m=0.039 * h,
        shank_m=0.246 * h,
        thigh_m=0.245 * h,
        hip_m=0.530 * h,
        half_hips_m=0.052 * h,
        waist_m=0.085 * h,
        shoulder_m=0.818 * h,
        half_shoulders_m=0.101 * h,
        neck_m=skull - 0.838 * h,
        upper_arm_m=0.186 * h,
        forearm_m=0.146 * h,
        hand_m=0.108 * h,
        foot_m=0.152 * h,
    )
