"""Heads rendered with truth: photographed people as turned meshes, with eyes that look somewhere.

The shape of each head is the mesh of its photo, its skin the photo; the eyes are drawn: balls whose
centres differ from person to person, iris, pupil and a glint within the lids, of which the upper
follows the gaze. Needs the networks of the mesh, for the shapes.
"""

from functools import cache

import cv2
import numpy as np
from seeing.material import portrait

from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.face.mesh import MeshNetworks

PEOPLE = ("astronaut", "hopper")
FOCAL_PX, WIDTH, HEIGHT = 465.0, 640, 400
_CENTRE = np.array([0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1)])
# Corners of an eye and its lids all round, on the mesh; the second to the eighth are the upper.
_EYES = (
    (33, 133, (33, 246, 161, 160, 159, 158, 157, 173, 133, 155, 154, 153, 145, 144, 163, 7)),
    (362, 263, (362, 398, 384, 385, 386, 387, 388, 466, 263, 249, 390, 373, 374, 380, 381, 382)),
)
_OVAL = [
    10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377,
    152, 148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109,
]  # fmt: skip
# Offset of the mesh's axes below those of a face (eyes above the mouth).
_TILT_RAD = np.radians(6.2)
_PUPILS_M = 0.0619
_BALL_M, _BALL_SD_M, _IRIS_OUT_M = 0.006, 0.0008, 0.0105
_RINGS = ((0.0059, 0.75), (0.0052, 1.0), (0.0022, 0.1))  # radius, brightness: edge, iris, pupil
IRIS_COLOURS = ((84, 105, 126), (154, 126, 84), (49, 63, 84))
_FINER = 4


class Head:
    """One person: vertices in the face frame, and where they are in the photo."""

    def __init__(self, name: str) -> None:
        shown = portrait(name)
        mesh = MeshNetworks().mesh(shown.image, shown.landmarks_px)
        assert mesh is not None
        points = mesh.points.astype(np.float64)
        axes, nose = _axes(points), points[[1, 4]].mean(axis=0)
        eyes = [points[list(eye[:2])].mean(axis=0) for eye in _EYES]
        scale = _PUPILS_M / np.linalg.norm(eyes[1] - eyes[0])
        face = (points - nose) @ axes.T * scale
        middle = face[_OVAL].mean(axis=0)
        rings = [
            middle + (face[_OVAL] - middle) * wider + (behind, 0.0, 0.0)
            for wider, behind in ((1.25, -0.02), (1.6, -0.06))
        ]
        self.vertices_m = np.concatenate([face, *rings])
        self._photo = shown.image
        self._in_photo = (self.vertices_m @ axes / scale + nose)[:, :2].astype(np.float32)
        from scipy.spatial import Delaunay

        self._triangles = Delaunay(self._in_photo).simplices

    def draw(
        self, into: ImageArray, R: np.ndarray, p_m: np.ndarray, stretch: tuple[float, ...]
    ) -> np.ndarray:
        """Draw the head over an image, what is farther first; return its vertices.

        Args:
            into: image of WIDTH x HEIGHT.
            R: R_camera_face.
            p_m: tip of the nose, camera frame.
            stretch: of the face along its axes.
        """
        vertices = self.vertices_m * stretch
        camera = vertices @ R.T + p_m
        there = _pixels(camera).astype(np.float32)
        depth = camera[self._triangles][:, :, 2].mean(axis=1)
        for corners in self._triangles[np.argsort(-depth)]:
            _draw_triangle(into, self._photo, self._in_photo[corners], there[corners])
        return vertices


@cache
def head(name: str) -> Head:
    """Return a head by the name of its portrait."""
    return Head(name)


def rendered(
    name: str,
    R: np.ndarray,
    p_m: np.ndarray,
    gaze: np.ndarray,
    rng: np.random.Generator,
    stretch: tuple[float, ...] = (1.0, 1.0, 1.0),
) -> ImageArray:
    """Return an image of a head whose eyes look somewhere, with the noise of a camera.

    Args:
        name: of the person.
        R: R_camera_face.
        p_m: tip of the nose, camera frame.
        gaze: unit vector along which the eyes look, camera frame.
        rng: of the room behind, the eyes, the light and the noise.
        stretch: of the face along its axes.
    """
    room = rng.integers(60, 180, (HEIGHT // 40, WIDTH // 40, 3), dtype=np.uint8)
    image = np.asarray(cv2.resize(room, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC), np.uint8)
    vertices = head(name).draw(image, R, p_m, stretch)
    colour = np.array(IRIS_COLOURS[rng.integers(len(IRIS_COLOURS))], float)
    for eye in _EYES:
        off_m = rng.normal(0.0, _BALL_SD_M, 3)
        _draw_eye(image, vertices, eye, R, p_m, R.T @ gaze, colour, off_m)
    soft = cv2.GaussianBlur(image, (0, 0), 0.6).astype(float) * rng.uniform(0.6, 1.1)
    return np.clip(soft + rng.normal(0.0, 4.0, soft.shape), 0, 255).astype(np.uint8)


def _axes(points: np.ndarray) -> np.ndarray:
    """Return the axes of a face (rows: out, left, up) from its mesh."""
    left = points[454] - points[234]
    left = left / np.linalg.norm(left)
    up = points[10] - points[152]
    up = up - left * (left @ up)
    up = up / np.linalg.norm(up)
    out = np.cross(left, up)
    cos, sin = np.cos(_TILT_RAD), np.sin(_TILT_RAD)
    return np.array([cos * out + sin * up, left, cos * up - sin * out])


def _pixels(camera_m: np.ndarray) -> np.ndarray:
    return camera_m[..., :2] / camera_m[..., 2:] * FOCAL_PX + _CENTRE


def _draw_triangle(
    into: ImageArray, photo: ImageArray, here: np.ndarray, there: np.ndarray
) -> None:
    if np.linalg.det(np.diff(here, axis=0)) * np.linalg.det(np.diff(there, axis=0)) <= 0.0:
        return  # seen from behind
    x0, y0 = np.maximum(np.floor(there.min(axis=0)).astype(int) - 1, 0)
    x1, y1 = np.minimum(np.ceil(there.max(axis=0)).astype(int) + 2, (WIDTH, HEIGHT))
    if x1 <= x0 or y1 <= y0:
        return
    local = (there - (x0, y0)).astype(np.float32)
    patch = cv2.warpAffine(
        photo, cv2.getAffineTransform(here, local), (int(x1 - x0), int(y1 - y0)),
        borderMode=cv2.BORDER_REFLECT,
    )  # fmt: skip
    mask = np.zeros(patch.shape[:2], np.uint8)
    cv2.fillConvexPoly(mask, np.round(local * 16).astype(np.int32), 1, shift=4)
    into[y0:y1, x0:x1][mask > 0] = patch[mask > 0]


def _draw_eye(
    into: ImageArray,
    vertices: np.ndarray,
    eye: tuple[int, int, tuple[int, ...]],
    R: np.ndarray,
    p_m: np.ndarray,
    gaze: np.ndarray,
    colour: np.ndarray,
    off_m: np.ndarray,
) -> None:
    """Draw what is seen of an eyeball between the lids; gaze and the ball's place in the face."""
    corners = vertices[list(eye[:2])]
    lids = vertices[list(eye[2])].copy()
    lids[1:8, 2] += 0.7 * _IRIS_OUT_M * float(np.clip(np.arcsin(gaze[2]), -0.5, 0.5))
    iris = corners.mean(axis=0) + (-_BALL_M, 0.0, 0.0) + off_m + _IRIS_OUT_M * gaze
    outline = _pixels(lids @ R.T + p_m)
    x0, y0 = np.maximum(np.floor(outline.min(axis=0)).astype(int) - 4, 0)
    x1, y1 = np.minimum(np.ceil(outline.max(axis=0)).astype(int) + 4, (WIDTH, HEIGHT))
    if x1 - x0 < 2 or y1 - y0 < 2:
        return
    part = into[y0:y1, x0:x1]
    fine = cv2.resize(part, None, fx=_FINER, fy=_FINER)

    def fill(canvas: np.ndarray, points_m: np.ndarray, with_colour: tuple[float, ...]) -> None:
        at = ((_pixels(points_m @ R.T + p_m) - (x0, y0) + 0.5) * _FINER - 0.5) * 16
        polygon = np.round(at).astype(np.int32)
        cv2.fillPoly(canvas, [polygon], with_colour, lineType=cv2.LINE_AA, shift=4)

    ball = np.empty_like(fine)
    ball[:] = np.clip(0.45 * part.reshape(-1, 3).mean(axis=0) + 120.0, 0, 225)
    level = np.array((gaze[1], -gaze[0], 0.0))
    across = level / np.linalg.norm(level)
    upright = np.cross(gaze, across)
    angle = np.linspace(0.0, 2.0 * np.pi, 40)[:, np.newaxis]
    ring = np.cos(angle) * across + np.sin(angle) * upright
    for radius, bright in _RINGS:
        fill(ball, iris + radius * ring, tuple(colour * bright))
    fill(ball, iris + (0.001, 0.0015, 0.002) + 0.0008 * ring, (235.0, 235.0, 235.0))
    mask = np.zeros(fine.shape[:2], np.uint8)
    fill(mask, lids, (255.0,))
    shade = cv2.GaussianBlur(mask, (0, 0), _FINER * 0.0012 * FOCAL_PX / p_m[2] + 0.5) / 255.0
    shaded = ball * (0.55 + 0.45 * shade[..., np.newaxis])
    share = mask[..., np.newaxis] / 255.0
    both = (fine * (1.0 - share) + shaded * share).astype(np.uint8)
    part[:] = cv2.resize(both, (int(x1 - x0), int(y1 - y0)), interpolation=cv2.INTER_AREA)
