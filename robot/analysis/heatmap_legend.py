"""The colour scale of a heat map and the time on each part, next to the image."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import PART_NAMES

Image = NDArray[np.uint8]

_PANEL_PX = 300
_PAPER, _INK, _SOFT, _BAR = (255, 255, 255), (60, 60, 62), (130, 130, 134), (168, 122, 84)
_SCALE_TOP, _SCALE_HIGH, _ROWS_TOP, _ROW_PX = 96, 260, 448, 38


def with_legend(
    image: Image, most_s_cm2: float, total_s: float, shares: Mapping[str, float]
) -> Image:
    """Return the image with a panel to its right.

    most_s_cm2: value at the top of the colour scale
    shares: of the time, per part code and "elsewhere"
    """
    panel: Image = np.full((image.shape[0], _PANEL_PX, 3), _PAPER, np.uint8)
    _scale(panel, most_s_cm2, total_s)
    _write(panel, "share of the time", (28, _ROWS_TOP - 22), 0.55, _INK)
    ordered = sorted(shares.items(), key=lambda item: (item[0] == "elsewhere", -item[1]))
    largest = max(shares.values())
    for row, (part, share) in enumerate(ordered):
        top = _ROWS_TOP + row * _ROW_PX
        _write(panel, PART_NAMES.get(part, part), (28, top + 12), 0.48, _INK)
        figure = f"{100.0 * share:.1f} %"
        (wide, _), _ = cv2.getTextSize(figure, cv2.FONT_HERSHEY_SIMPLEX, 0.48, 1)
        _write(panel, figure, (264 - wide, top + 12), 0.48, _INK)
        wide = round(236 * share / largest) if largest > 0.0 else 0
        cv2.rectangle(panel, (28, top + 18), (264, top + 24), (238, 238, 240), -1)
        if wide > 0:
            cv2.rectangle(panel, (28, top + 18), (28 + wide, top + 24), _BAR, -1)
    note = (28, _ROWS_TOP + len(ordered) * _ROW_PX + 20)
    _write(panel, "left and right: the face's own", note, 0.42, _SOFT)
    return np.hstack([image, panel])


def _scale(panel: Image, most_s_cm2: float, total_s: float) -> None:
    _write(panel, f"{total_s:.0f} s of gaze", (28, 40), 0.6, _INK)
    _write(panel, "seconds per square cm", (28, 70), 0.5, _SOFT)
    ramp = np.linspace(255, 0, _SCALE_HIGH).astype(np.uint8)[:, None].repeat(34, axis=1)
    bottom = _SCALE_TOP + _SCALE_HIGH
    panel[_SCALE_TOP:bottom, 28:62] = cv2.applyColorMap(ramp, cv2.COLORMAP_PLASMA)
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        row = round(bottom - share * _SCALE_HIGH)
        cv2.line(panel, (62, row), (70, row), _SOFT, 1)
        _write(panel, f"{share * most_s_cm2:.2g}", (78, row + 5), 0.48, _INK)


def _write(
    panel: Image, text: str, at: tuple[int, int], size: float, ink: tuple[int, int, int]
) -> None:
    cv2.putText(panel, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, ink, 1, cv2.LINE_AA)
