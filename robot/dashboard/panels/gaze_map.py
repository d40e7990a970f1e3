"""Where on the face that is looked at the gaze has been: a heat map that fills as the rig runs."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.angles import add, rotate, scale, unit
from gazerig.gaze.types import Floats
from gazerig.robot.analysis.gaze_on_face import on_face
from gazerig.robot.analysis.heatmap_face import HEIGHT_PX, PX_PER_M, WIDTH_PX, draw_face, on_canvas
from gazerig.robot.model.types import Snapshot

SHRINK = 3
"""The map is so many times smaller than the drawn face."""

WIDE_PX, HIGH_PX = WIDTH_PX // SHRINK, HEIGHT_PX // SHRINK

_PLANE_M = -0.028
"""The plane between the nose tip and the eyes and mouth, along the face's own x axis."""
_SPREAD_M = 0.0085
"""Half a degree seen from a metre away: what is seen sharply."""
_LONGEST_GAP_S = 0.2
_LONGEST_FORESEEN_S = 0.3
_FAINT, _PLAIN, _COVER = 0.02, 0.45, 0.82

Image = NDArray[np.uint8]


class GazeMap:
    """Gathers time on a face's plane.

    seconds: how long the gaze was on the map
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self._time: Floats = np.zeros((HIGH_PX, WIDE_PX))
        self._last_s: float | None = None

    def update(self, snapshot: Snapshot) -> None:
        """Add the time since the last snapshot where a face is looked at and no eye jumps."""
        last_s, self._last_s = self._last_s, snapshot.t_s
        if last_s is None or not 0.0 < snapshot.t_s - last_s <= _LONGEST_GAP_S:
            return
        point = gaze_on_face(snapshot)
        if point is None:
            return
        column, row = (on_canvas(np.array([point]))[0] / SHRINK).astype(int).tolist()
        if 0 <= column < WIDE_PX and 0 <= row < HIGH_PX:
            self._time[row, column] += snapshot.t_s - last_s
            self.seconds += snapshot.t_s - last_s

    def image(self) -> Image:
        """Return the map over a drawn face, RGB (HIGH_PX, WIDE_PX, 3): yellow is where most was."""
        blurred = cv2.GaussianBlur(self._time, (0, 0), _SPREAD_M * PX_PER_M / SHRINK)
        top = float(blurred.max())
        share = blurred / top if top > 0.0 else blurred
        colours = cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_PLASMA)
        cover = _COVER * np.clip((share - _FAINT) / (_PLAIN - _FAINT), 0.0, 1.0) ** 0.7
        mixed = _face() * (1.0 - cover[..., None]) + colours * cover[..., None]
        return np.ascontiguousarray(np.rint(mixed).astype(np.uint8)[..., ::-1])


def gaze_on_face(snapshot: Snapshot) -> tuple[float, float] | None:
    """Return where the measured gaze meets the face it is meant for, (y, z) in that face's frame.

    None while the eyes jump, where no face is the target, or where the gaze misses its plane.
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
    return on_face(snapshot.p_world_head_m, way, plane, face.R_world_face)


@cache
def _face() -> Image:
    """Draw the face once, small."""
    small = cv2.resize(draw_face(), (WIDE_PX, HIGH_PX), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)
