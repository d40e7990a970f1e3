"""A smile is no nod: pitch of laughing faces from five points.

Faces are those of a calm and of a laughing person as a dense mesh measured them in photos (hopper,
astronaut), and all between and somewhat beyond, of people who differ; turned by up to 30 deg,
projected, and found with the usual errors of the face nets.
"""

from math import asin, degrees, radians

import numpy as np

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.gaze.angles import rotation
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.face_pose import face_pose

WANTED = {
    "laughing, pitch error, rms, deg": (0.0, 4.5),
    "laughing, pitch error, mean, deg": (-3.0, 3.0),
    "laughing, |r| of pitch error and mouth width": (0.0, 0.25),
    "calm, pitch error, rms, deg": (0.0, 4.5),
}

CAMERA = intrinsics_of_view(radians(65.0), 640, 480)
# Face frame, metres: right eye, left eye, nose, corners of the mouth.
CALM_M = 1e-3 * np.array(
    [(-37.0, -30.95, 31.9), (-37.0, 30.95, 31.9), (0, 0, 0), (-37.0, -25.7, -28.8), (-37.0, 25.7, -28.8)]
)  # fmt: skip
LAUGH_M = 1e-3 * np.array([(0, 0, 0), (0, 0, 0), (0, 0, 0), (-6.6, -7.6, 7.6), (-6.6, 7.6, 7.6)])
# Landmark error of a net: of the distance of the eyes, and pixels.
NET_OF_EYES, NET_PX = 0.03, 0.7
MOST_DEG = 30.0
_FACING = np.array([(0, 1, 0), (0, 0, -1), (-1, 0, 0)], float)


def person(rng: np.random.Generator, laughter: float) -> np.ndarray:
    """Return the five points of a laughing person: 0 calm, 1 as in the photo."""
    face = CALM_M + laughter * LAUGH_M
    face = face * rng.normal(1.0, (0.06, 0.0, 0.05))
    face[3:] *= (1.0, rng.normal(1.0, 0.06), 1.0)
    face[3:, 2] += rng.normal(0.0, 2.5e-3)
    return face


def pitch_errors(laughter: tuple[float, float], count: int, seed: int) -> np.ndarray:
    """Return (n, 2): pitch error in deg, and mouth width over the distance of the eyes."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(count):
        face = person(rng, rng.uniform(*laughter))
        turn = np.radians(rng.uniform(-MOST_DEG, MOST_DEG, 2))
        R = _FACING @ np.array(rotation((turn[0], turn[1], rng.normal(0.0, 0.1))))
        z = rng.uniform(0.4, 1.0)
        seen = project(face @ R.T + z * np.array([*rng.uniform(-0.3, 0.3, 2), 1.0]), CAMERA)
        eyes_px = np.linalg.norm(seen[1] - seen[0])
        seen = seen + rng.normal(0.0, np.hypot(NET_PX, NET_OF_EYES * eyes_px), (5, 2))
        pose = face_pose(seen, CAMERA)
        if pose is None:
            continue
        width = np.linalg.norm(seen[4] - seen[3]) / np.linalg.norm(seen[1] - seen[0])
        rows.append((pitch_deg(pose.R_camera_face) - pitch_deg(R), width))
    return np.array(rows)


def pitch_deg(R_camera_face: object) -> float:
    """Return how far a face looks up in the camera, degrees."""
    return degrees(asin(-np.array(R_camera_face)[1, 0]))


def measure(full: bool) -> dict[str, float]:
    """Return the figures."""
    count = 4000 if full else 600
    laughing, calm = pitch_errors((0.3, 1.4), count, 1), pitch_errors((0.0, 0.2), count, 2)
    off, width = laughing.T
    return {
        "laughing, pitch error, rms, deg": np.sqrt(np.mean(off**2)),
        "laughing, pitch error, mean, deg": off.mean(),
        "laughing, |r| of pitch error and mouth width": abs(np.corrcoef(off, width)[0, 1]),
        "calm, pitch error, rms, deg": np.sqrt(np.mean(calm[:, 0] ** 2)),
    }
