"""Heat map of the gaze on the faces that the rig fixates, accumulated during the run."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.angles import add, rotate, scale, unit
from gazerig.gaze.types import Floats
from gazerig.robot.analysis.gaze_on_face import gaze_point_on_face
from gazerig.robot.analysis.heatmap import HEIGHT_PX, PX_PER_M, WIDTH_PX, canvas_pixels, draw_face
from gazerig.robot.model.types import Snapshot

SHRINK = 3
"""Factor by which the map is smaller than the drawn face."""

WIDE_PX, HIGH_PX = WIDTH_PX // SHRINK, HEIGHT_PX // SHRINK

_PLANE_M = -0.028
"""x coordinate in the face's frame of a plane between nose tip and eyes, m."""
_SPREAD_M = 0.0085
"""Width of half a degree, about the size of the fovea, at 1 m, in m."""
_LONGEST_GAP_S = 0.2
_LONGEST_FORESEEN_S = 0.3
_FAINT, _PLAIN, _COVER = 0.02, 0.45, 0.82

Image = NDArray[np.uint8]


class GazeMap:
    """Accumulates gaze time on the plane of a face.

    Attributes:
        seconds: Total time on the map, s.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self._time: Floats = np.zeros((HIGH_PX, WIDE_PX))
        self._last_s: float | None = None

    def update(self, snapshot: Snapshot) -> None:
        """Add the time since the last snapshot if a face is the target, except during saccades."""
        last_s, self._last_s = self._last_s, snapshot.t_s
        if last_s is None or not 0.0 < snapshot.t_s - last_s <= _LONGEST_GAP_S:
            return
        point = gaze_on_face(snapshot)
        if point is None:
            return
        column, row = (canvas_pixels(np.array([point]))[0] / SHRINK).astype(int).tolist()
        if 0 <= column < WIDE_PX and 0 <= row < HIGH_PX:
            self._time[row, column] += snapshot.t_s - last_s
            self.seconds += snapshot.t_s - last_s

    def image(self) -> Image:
        """Return the map over a drawn face, RGB (HIGH_PX, WIDE_PX, 3); the maximum is yellow."""
        blurred = cv2.GaussianBlur(self._time, (0, 0), _SPREAD_M * PX_PER_M / SHRINK)
        top = float(blurred.max())
        share = blurred / top if top > 0.0 else blurred
        colours = cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_PLASMA)
        cover = _COVER * np.clip((share - _FAINT) / (_PLAIN - _FAINT), 0.0, 1.0) ** 0.7
        mixed = _face() * (1.0 - cover[..., None]) + colours * cover[..., None]
        return np.ascontiguousarray(np.rint(mixed).astype(np.uint8)[..., ::-1])


def gaze_on_face(snapshot: Snapshot) -> tuple[float, float] | None:
    """Return the point of the measured gaze on its target face, (y, z) in the face's frame, m.

    None during a saccade or blink, without a target face, or if the gaze misses its plane.
    """
    if snapshot.target_kind != "face" or snapshot.phase in ("saccade", "blink"):
        return None
    face = next((face for face in snapshot.faces if face.id == snapshot.target_id), None)
    if face is None:
        return None
    since_s = min(max(0.0, snapshot.frame_age_s or 0.0), _LONGEST_FORESEEN_S)
    centre = add(face.p_world_m, scale(face.v_world_m_s, since_s))
    plane = add(centre, rotate(face.R_world_face, (_PLANE_M, 0.0, 0.0)))
    way = unit(add(*snapshot.gaze_world))
    return gaze_point_on_face(snapshot.p_world_head_m, way, plane, face.R_world_face)


@cache
def _face() -> Image:
    """Return the drawn face in the size of the map."""
    small = cv2.resize(draw_face(), (WIDE_PX, HIGH_PX), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)
