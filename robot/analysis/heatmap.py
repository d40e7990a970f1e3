"""Heat map of the gaze on a face, as an image (Nakamoto & Tsuruno 4.3, figs 8 and 9).

Gaze points are in the face's own frame, y to the owner's left and z up, in metres from the tip of
the nose. Each point is weighted by its duration and spread by a Gaussian as wide as the area of
sharp vision at a distance of one metre; yellow marks the longest gaze.

The plain frontal face is drawn to scale, so that a gaze point is on the intended part. On the
canvas y, to the owner's left, points right and z points up, as an opposite viewer sees the face.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.drivers.files.file_output import write_file
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.gaze.types import PART_NAMES, PARTS, Floats
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M, PARTS_FACE_M

WIDTH_PX, HEIGHT_PX = 720, 860
PX_PER_M = 3000.0
# Position of the tip of the nose.
_NOSE_PX = (WIDTH_PX / 2.0, 480.0)

Image = NDArray[np.uint8]
_PAPER, _SKIN, _SHADE = (243, 244, 245), (226, 230, 234), (205, 210, 216)
_INK, _HAIR, _IRIS = (120, 124, 130), (150, 153, 158), (110, 114, 120)
# Factor by which it is drawn larger before it is scaled down, for smooth edges.
_FINE = 3
_Colour = tuple[int, int, int]


def canvas_pixels(points_face_m: Floats) -> Floats:
    """Return the pixels (column, row) of (n, 2) points (y, z) of the face frame."""
    return np.asarray(points_face_m) * (PX_PER_M, -PX_PER_M) + _NOSE_PX


class _Pen:
    """Draws shapes given in millimetres of the face frame on a fine canvas."""

    def __init__(self) -> None:
        size = (HEIGHT_PX * _FINE, WIDTH_PX * _FINE, 3)
        self.canvas: NDArray[np.uint8] = np.full(size, _PAPER, np.uint8)

    def fill_outline(self, yz_mm: Sequence[tuple[float, float]], fill: _Colour) -> None:
        """Fill a closed, smooth outline through points."""
        cv2.fillPoly(self.canvas, [self._pixels(_spline(yz_mm, closed=True))], fill, cv2.LINE_AA)

    def draw_line(
        self, yz_mm: Sequence[tuple[float, float]], width_mm: float, ink: _Colour
    ) -> None:
        """Draw a smooth line through points."""
        wide = max(1, round(width_mm * 1e-3 * PX_PER_M * _FINE))
        path = self._pixels(_spline(yz_mm, closed=False))
        cv2.polylines(self.canvas, [path], False, ink, wide, cv2.LINE_AA)

    def draw_both_sides(
        self, yz_mm: Sequence[tuple[float, float]], width_mm: float, ink: _Colour
    ) -> None:
        """Draw a line and its mirror image."""
        self.draw_line(yz_mm, width_mm, ink)
        self.draw_line([(-y, z) for y, z in yz_mm], width_mm, ink)

    def fill_disc(self, y_mm: float, z_mm: float, radius_mm: float, fill: _Colour) -> None:
        """Fill a circle."""
        (centre,) = self._pixels(np.array([(y_mm, z_mm)]))
        radius = round(radius_mm * 1e-3 * PX_PER_M * _FINE)
        cv2.circle(self.canvas, (int(centre[0]), int(centre[1])), radius, fill, -1, cv2.LINE_AA)

    def _pixels(self, yz_mm: Floats) -> NDArray[np.int32]:
        fine = canvas_pixels(yz_mm * 1e-3) * _FINE
        return np.rint(fine).astype(np.int32)


def draw_face() -> NDArray[np.uint8]:
    """Draw the face on a canvas of HEIGHT_PX by WIDTH_PX."""
    pen = _Pen()
    _draw_head(pen)
    for side in (-1.0, 1.0):
        _draw_eye(pen, side)
    _draw_nose_and_mouth(pen)
    small = cv2.resize(pen.canvas, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)


def _draw_head(pen: _Pen) -> None:
    """Draw shoulders, neck, hair, ears, and the oval of the face."""
    pen.fill_outline(
        _close_with_mirror_image(
            [(0, -112), (34, -112), (58, -122), (100, -132), (124, -170), (0, -200)]
        ),
        _SHADE,
    )
    pen.fill_outline(
        _close_with_mirror_image([(0, -60), (33, -60), (35, -100), (42, -118), (0, -128)]), _SKIN
    )
    pen.draw_line([(-34, -84), (-18, -98), (0, -102), (18, -98), (34, -84)], 1.2, _SHADE)
    pen.fill_outline(
        _close_with_mirror_image(
            [(0, 141), (45, 134), (72, 108), (80, 70), (77, 30), (70, 18), (0, 20)]
        ),
        _HAIR,
    )
    for side in (-1.0, 1.0):
        ear = [(70, 30), (79, 36), (84, 22), (80, -2), (74, -16), (68, -14)]
        pen.fill_outline([(side * y, z) for y, z in ear], _SKIN)
    oval = [(0, 114), (36, 109), (60, 88), (70, 55), (72, 20), (70, -12), (62, -50)]
    oval += [(44, -84), (20, -104), (0, -107)]
    pen.fill_outline(_close_with_mirror_image(oval), _SKIN)
    fringe = [(0, 141), (45, 134), (72, 108), (79, 60), (71, 44), (64, 76), (46, 98), (0, 106)]
    pen.fill_outline(_close_with_mirror_image(fringe), _HAIR)


def _draw_eye(pen: _Pen, side: float) -> None:
    """Draw an eye with its brow, at the measured position of the pupil."""
    _, y0, z0 = (1e3 * metres for metres in PARTS_FACE_M["LE"])

    def at(y: float, z: float) -> tuple[float, float]:
        return side * (y0 + y), z0 + z

    white = [at(*p) for p in ((-15, -1.5), (-8, 4.5), (0, 6.5), (8, 5), (15, 0), (7, -5), (-6, -5))]
    pen.fill_outline(white, (250, 250, 251))
    pen.fill_disc(side * y0, z0, 5.8, _IRIS)
    pen.fill_disc(side * y0, z0, 2.6, (70, 72, 76))
    pen.fill_disc(side * y0 + 1.8, z0 + 2.2, 1.1, (250, 250, 251))
    pen.draw_line([at(-16, -2.5), at(-8, 4.8), at(0, 6.8), at(8, 5.3), at(16, 0.5)], 1.5, _INK)
    pen.draw_line([at(-13, -3), at(-6, -5.2), at(7, -5.2), at(14, -1)], 0.6, _INK)
    pen.draw_line([at(-16, 13), at(-4, 18.5), at(8, 19), at(20, 13)], 3.2, _HAIR)


def _draw_nose_and_mouth(pen: _Pen) -> None:
    pen.draw_both_sides([(8, 30), (7, 12), (9, 2)], 0.6, _SHADE)
    pen.draw_both_sides([(15, 1), (18, -5), (14, -9), (9, -8)], 1.0, _INK)
    pen.draw_line([(-7, -9), (0, -11.5), (7, -9)], 1.0, _INK)
    pen.fill_outline(
        [(-25, -36), (-10, -31), (0, -33), (10, -31), (25, -36), (12, -44), (0, -46), (-12, -44)],
        (196, 200, 212),
    )
    pen.draw_line([(-26, -36), (-10, -37), (0, -38), (10, -37), (26, -36)], 1.2, _INK)
    pen.draw_line([(-9, -60), (0, -62), (9, -60)], 0.7, _SHADE)


def _close_with_mirror_image(half: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Close the left half of an outline with its mirror image."""
    return [*half, *((-y, z) for y, z in reversed(half) if y != 0.0)]


def _spline(points: Sequence[tuple[float, float]], closed: bool) -> Floats:
    """Return a Catmull-Rom curve through points, (m, 2)."""
    p = np.asarray(points, dtype=float)
    first, last = (p[-1:], p[:2]) if closed else (p[:1], p[-1:])
    p = np.concatenate([first, p, last])
    t = np.linspace(0.0, 1.0, 16, endpoint=False)[None, :, None]
    a, b, c, d = (p[k : len(p) - 3 + k, None] for k in range(4))
    curve = 0.5 * (
        2.0 * b + (c - a) * t + (2.0 * a - 5.0 * b + 4.0 * c - d) * t**2
        + (3.0 * b - a - 3.0 * c + d) * t**3
    )  # fmt: skip
    out: Floats = np.concatenate([curve.reshape(-1, 2), p[-2:-1]])
    return out


_PANEL_PX = 300
_LEGEND_PAPER, _LEGEND_INK, _SOFT, _BAR = (
    (255, 255, 255),
    (60, 60, 62),
    (130, 130, 134),
    (168, 122, 84),
)
_SCALE_TOP, _SCALE_HIGH, _ROWS_TOP, _ROW_PX = 96, 260, 448, 38


def add_legend(
    image: Image, most_s_cm2: float, total_s: float, shares: Mapping[str, float]
) -> Image:
    """Return the image with a panel to its right.

    most_s_cm2: value at the top of the colour scale
    shares: shares of the time, by part code and "elsewhere"
    """
    panel: Image = np.full((image.shape[0], _PANEL_PX, 3), _LEGEND_PAPER, np.uint8)
    _draw_scale(panel, most_s_cm2, total_s)
    _draw_text(panel, "share of the time", (28, _ROWS_TOP - 22), 0.55, _LEGEND_INK)
    ordered = sorted(shares.items(), key=lambda item: (item[0] == "elsewhere", -item[1]))
    largest = max(shares.values())
    for row, (part, share) in enumerate(ordered):
        top = _ROWS_TOP + row * _ROW_PX
        _draw_text(panel, PART_NAMES.get(part, part), (28, top + 12), 0.48, _LEGEND_INK)
        figure = f"{100.0 * share:.1f} %"
        (wide, _), _ = cv2.getTextSize(figure, cv2.FONT_HERSHEY_SIMPLEX, 0.48, 1)
        _draw_text(panel, figure, (264 - wide, top + 12), 0.48, _LEGEND_INK)
        wide = round(236 * share / largest) if largest > 0.0 else 0
        cv2.rectangle(panel, (28, top + 18), (264, top + 24), (238, 238, 240), -1)
        if wide > 0:
            cv2.rectangle(panel, (28, top + 18), (28 + wide, top + 24), _BAR, -1)
    note = (28, _ROWS_TOP + len(ordered) * _ROW_PX + 20)
    _draw_text(panel, "left and right: the face's own", note, 0.42, _SOFT)
    return np.hstack([image, panel])


def _draw_scale(panel: Image, most_s_cm2: float, total_s: float) -> None:
    _draw_text(panel, f"{total_s:.0f} s of gaze", (28, 40), 0.6, _LEGEND_INK)
    _draw_text(panel, "seconds per square cm", (28, 70), 0.5, _SOFT)
    ramp = np.linspace(255, 0, _SCALE_HIGH).astype(np.uint8)[:, None].repeat(34, axis=1)
    bottom = _SCALE_TOP + _SCALE_HIGH
    panel[_SCALE_TOP:bottom, 28:62] = cv2.applyColorMap(ramp, cv2.COLORMAP_PLASMA)
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        row = round(bottom - share * _SCALE_HIGH)
        cv2.line(panel, (62, row), (70, row), _SOFT, 1)
        _draw_text(panel, f"{share * most_s_cm2:.2g}", (78, row + 5), 0.48, _LEGEND_INK)


def _draw_text(
    panel: Image, text: str, at: tuple[int, int], size: float, ink: tuple[int, int, int]
) -> None:
    cv2.putText(panel, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, ink, 1, cv2.LINE_AA)


# A gaze point counts for the nearest part within this distance.
_NEAR_M = 0.03
# Half a degree at a distance of one metre.
_SPREAD_M = 0.0085
# Below the first fraction of the highest value nothing is painted; above the second, most of it.
_FAINT, _PLAIN = 0.02, 0.45
_COVER = 0.82
_LARGEST = 100_000_000  # size limit of a photograph, bytes


def share_per_part(points_face_m: ArrayLike, seconds: ArrayLike) -> dict[str, float]:
    """Return the share of time on each part, and "elsewhere"; they sum to 1.

    points_face_m: (n, 2) y, z; seconds: (n,)

    Raises:
        ValueError: the total time is zero, or shapes or numbers are not valid.
    """
    points, times = _check_points(points_face_m, seconds)
    centres = np.array([PARTS_FACE_M[part][1:] for part in PARTS])
    apart = np.linalg.norm(points[:, None] - centres[None], axis=2)
    nearest = np.where(apart.min(axis=1) <= _NEAR_M, apart.argmin(axis=1), len(PARTS))
    total = np.bincount(nearest, weights=times, minlength=len(PARTS) + 1) / times.sum()
    return dict(zip((*PARTS, "elsewhere"), total.tolist(), strict=True))


def write_heatmap(
    points_face_m: ArrayLike,
    seconds: ArrayLike,
    out: Path,
    image: Path | None = None,
    force: bool = False,
) -> dict[str, float]:
    """Write the heat map as a PNG over a drawn face or a photograph; return the shares.

    points_face_m: (n, 2) y, z; seconds: (n,) duration at each
    image: a frontal photograph of one face; force: replace an existing file

    Raises:
        SetupError: the image has no face, or a file cannot be read or written.
        ValueError: as in ``share_per_part``.
    """
    points, times = _check_points(points_face_m, seconds)
    shares = share_per_part(points, times)
    canvas = draw_face() if image is None else align_face(image)
    per_m2 = density_s_m2(points, times)
    # Blended over the canvas: from transparent through purple and orange to yellow.
    top = float(per_m2.max())
    share = per_m2 / top if top > 0.0 else per_m2
    colours = cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_PLASMA)
    cover = _COVER * np.clip((share - _FAINT) / (_PLAIN - _FAINT), 0.0, 1.0) ** 0.7
    mixed = canvas * (1.0 - cover[..., None]) + colours * cover[..., None]
    painted = np.asarray(np.rint(mixed), dtype=np.uint8)
    whole = add_legend(painted, top / 1e4, float(times.sum()), shares)
    ok, data = cv2.imencode(".png", whole)
    if not ok:
        raise SetupError(f"{out}: the image cannot be written as PNG")
    write_file(out, data.tobytes(), force)
    return shares


def density_s_m2(points_face_m: Floats, seconds: Floats) -> Floats:
    """Return seconds per square metre for every pixel of the canvas, (HEIGHT_PX, WIDTH_PX)."""
    columns, rows = np.rint(canvas_pixels(points_face_m)).astype(int).T
    inside = (columns >= 0) & (columns < WIDTH_PX) & (rows >= 0) & (rows < HEIGHT_PX)
    time = np.zeros((HEIGHT_PX, WIDTH_PX))
    np.add.at(time, (rows[inside], columns[inside]), seconds[inside])
    sigma = _SPREAD_M * PX_PER_M
    spread = cv2.GaussianBlur(time, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
    return np.asarray(spread, dtype=np.float64) * PX_PER_M**2


def align_face(photo: Path) -> Image:
    """Align the largest face of a photograph with the canvas, by its eyes and mouth.

    Raises:
        SetupError: the photograph cannot be read, or no face is found in it.
    """
    try:
        data = np.frombuffer(read_limited(photo, _LARGEST), np.uint8)
    except OSError as error:
        raise SetupError(
            f"{photo}: is no image that can be read ({error.strerror}); give a JPEG or PNG"
        ) from None
    try:
        image = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    except cv2.error:  # larger than the limit for images
        image = None
    if image is None:
        raise SetupError(f"{photo}: is no image that can be read; give a JPEG or PNG")
    faces = face_detector(FaceDetectorParams()).find(np.asarray(image, dtype=np.uint8))
    if not faces:
        raise SetupError(f"{photo}: no face found; give an image of one face from its front")
    flat = [0, 1, 3, 4]  # not the nose, which is in front of the plane
    there = faces[0].landmarks_px[flat]
    here = canvas_pixels(LANDMARKS_FACE_M[flat, 1:])
    ones = np.ones((len(flat), 1))
    affine = np.linalg.lstsq(np.hstack([there, ones]), here, rcond=None)[0].T
    size = (WIDTH_PX, HEIGHT_PX)
    shown = cv2.warpAffine(
        image, affine, size, flags=cv2.INTER_AREA, borderMode=cv2.BORDER_REPLICATE
    )
    # Pale and grey, so that only the map has colours.
    grey = cv2.cvtColor(cv2.cvtColor(shown, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return np.asarray(cv2.addWeighted(grey, 0.8, grey, 0.0, 40.0), dtype=np.uint8)


def _check_points(points_face_m: ArrayLike, seconds: ArrayLike) -> tuple[Floats, Floats]:
    points, times = np.asarray(points_face_m, float), np.asarray(seconds, float)
    if points.ndim != 2 or points.shape[1:] != (2,) or times.shape != (len(points),):
        raise ValueError(f"wanted (n, 2) points and (n,) times, not {points.shape}, {times.shape}")
    if not np.isfinite(points).all() or not np.isfinite(times).all() or (times < 0.0).any():
        raise ValueError("points and times must be finite, and no time below 0")
    if times.sum() <= 0.0:
        raise ValueError("the gaze was never on a face: there is nothing to map")
    return points, times
