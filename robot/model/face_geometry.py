"""Canonical adult face: positions of its parts and landmarks.

Face frame: origin at the tip of the nose, x out of the face, y to the person's left, z up, in m.
"""

import numpy as np

from gazerig.gaze.types import Floats, Vec3

# A canonical adult face. The distance between the pupils is Mitake et al. table 1; the
# heights and the mouth are the proportions of averaged frontal photographs at that
# distance, the depths those of an average profile, all rounded to millimetres.


PUPIL_DISTANCE_M = 0.0619


_PUPIL = (-0.033, PUPIL_DISTANCE_M / 2, 0.035)


_MOUTH_CORNER = (-0.029, 0.0255, -0.036)


# Centres of the parts between which the gaze moves (Nakamoto & Tsuruno 3.2.2).
PARTS_FACE_M: dict[str, Vec3] = {
    "DN": (-0.018, 0.0, -0.080),
    "FL": (-0.055, 0.058, -0.005),
    "LE": _PUPIL,
    "M": (-0.016, 0.0, -0.036),
    "N": (0.0, 0.0, 0.0),
    "FR": (-0.055, -0.058, -0.005),
    "RE": (_PUPIL[0], -_PUPIL[1], _PUPIL[2]),
    "UP": (-0.026, 0.0, 0.078),
}


LANDMARKS_FACE_M: Floats = np.array(
    [
        PARTS_FACE_M["RE"],
        PARTS_FACE_M["LE"],
        PARTS_FACE_M["N"],
        (_MOUTH_CORNER[0], -_MOUTH_CORNER[1], _MOUTH_CORNER[2]),
        _MOUTH_CORNER,
    ]
)
"""(5, 3) right eye, left eye, nose tip, right and left mouth corner, as in DetectedFace."""


EYES_TO_MOUTH_M = _PUPIL[2] - _MOUTH_CORNER[2]
