"""A person's arm in a camera's view: a sleeve from shoulder to elbow, a forearm to the hand.

Two links of true lengths, with the elbow at the bottom; a hand beyond their reach stretches them.
Not drawn: arms that hang down, fingers.
"""

from functools import lru_cache
from math import sqrt

import cv2
import numpy as np

from gazerig.gaze.angles import add, norm, scale, sub, unit
from gazerig.gaze.types import Vec3
from gazerig.sim_mock.cameras.canvas import Bytes, Canvas, Colour, TexturedQuad

UPPER_M, FOREARM_M = 0.30, 0.29
SHOULDER_ASIDE_M, SHOULDER_BELOW_M, SHOULDER_BEHIND_M = 0.19, 0.17, 0.10
_UPPER_WIDTH_M, _FOREARM_WIDTH_M = 0.10, 0.075


def draw_arm(
    canvas: Canvas, p_world_face_m: Vec3, p_world_hand_m: Vec3, sleeve: Colour, skin: Colour
) -> None:
    """Draw the arm from the shoulder on the hand's side to the hand."""
    camera = float(canvas.p_m[0]), float(canvas.p_m[1]), float(canvas.p_m[2])
    shoulder = shoulder_m(p_world_face_m, p_world_hand_m, camera)
    elbow = elbow_m(shoulder, p_world_hand_m)
    _draw_limb(canvas, shoulder, elbow, _UPPER_WIDTH_M, sleeve)
    _draw_limb(canvas, elbow, p_world_hand_m, _FOREARM_WIDTH_M, skin)


def shoulder_m(face: Vec3, hand: Vec3, camera: Vec3) -> Vec3:
    """Return the shoulder on the hand's side of a trunk that faces the camera."""
    away = unit((face[0] - camera[0], face[1] - camera[1], 0.0))
    aside = (-away[1], away[0], 0.0)
    rel = sub(hand, face)
    side = 1.0 if rel[0] * aside[0] + rel[1] * aside[1] > 0.0 else -1.0
    behind = add(face, scale(away, SHOULDER_BEHIND_M))
    return add(behind, add(scale(aside, side * SHOULDER_ASIDE_M), (0.0, 0.0, -SHOULDER_BELOW_M)))


def elbow_m(shoulder: Vec3, hand: Vec3) -> Vec3:
    """Return the elbow: below the line from shoulder to hand, as far as both links allow."""
    way = sub(hand, shoulder)
    far = max(norm(way), 1e-6)
    along = 0.5 * (far + (UPPER_M**2 - FOREARM_M**2) / far)
    if far >= UPPER_M + FOREARM_M:
        along = far * UPPER_M / (UPPER_M + FOREARM_M)
    off = sqrt(max(0.0, UPPER_M**2 - along**2))
    ahead = scale(way, 1.0 / far)
    down = sub((0.0, 0.0, -1.0), scale(ahead, -ahead[2]))
    if far >= UPPER_M + FOREARM_M or norm(down) < 1e-6:
        off = 0.0
    return add(shoulder, add(scale(ahead, along), scale(unit(down), off)))


def _draw_limb(canvas: Canvas, start: Vec3, end: Vec3, width_m: float, colour: Colour) -> None:
    """Draw one link as a patterned strip that faces the camera."""
    way = np.subtract(end, start)
    across = np.cross(way, np.add(start, end) * 0.5 - canvas.p_m)
    length = float(np.linalg.norm(across))
    if length < 1e-9:
        return
    across *= width_m / length
    corner = np.array(start) - 0.5 * across
    canvas.draw_quad(
        TexturedQuad(_to_vec3(corner), _to_vec3(across), _to_vec3(way), _cloth_texture(colour))
    )


@lru_cache(maxsize=16)
def _cloth_texture(colour: Colour) -> Bytes:
    """Return an opaque patterned strip with round ends: (96, 32, 4)."""
    rng = np.random.default_rng(3000 + sum(colour))
    cells = rng.uniform(-22.0, 22.0, (12, 4))
    pattern = cv2.resize(cells, (32, 96), interpolation=cv2.INTER_CUBIC)
    strip = np.zeros((96, 32, 4), np.uint8)
    strip[:, :, :3] = np.clip(np.array(colour) + pattern[:, :, None], 0.0, 255.0)
    opaque = np.zeros((96, 32), np.uint8)
    cv2.rectangle(opaque, (0, 12), (31, 83), 255, -1)
    for y in (14, 81):
        cv2.ellipse(opaque, (16, y), (15, 13), 0.0, 0.0, 360.0, 255, -1)
    strip[:, :, 3] = opaque
    return strip


def _to_vec3(row: np.ndarray) -> Vec3:
    return float(row[0]), float(row[1]), float(row[2])
