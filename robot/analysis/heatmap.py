"""Where on a face a person has looked, as an image (Nakamoto & Tsuruno 4.3, figs 8 and 9).

Gaze points are in the face's own frame, y to the owner's left and z up, in metres from the
tip of the nose. Each is spread by a bell as wide as what is
seen sharply from a metre away and weighted by its time; yellow marks the longest gaze.
"""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.drivers.files.file_output import write_file
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.gaze.types import PARTS, Floats
from gazerig.robot.analysis.heatmap_face import HEIGHT_PX, PX_PER_M, WIDTH_PX, draw_face, on_canvas
from gazerig.robot.analysis.heatmap_legend import with_legend
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M, PARTS_FACE_M

Image = NDArray[np.uint8]

# A gaze point counts for the nearest part within this distance.
_NEAR_M = 0.03
# Half a degree seen from a metre away.
_SPREAD_M = 0.0085
# Below this share of the highest value nothing is painted; from the next on, most of it is.
_FAINT, _PLAIN = 0.02, 0.45
_COVER = 0.82
_LARGEST = 100_000_000  # bytes of a photograph


def share_per_part(points_face_m: ArrayLike, seconds: ArrayLike) -> dict[str, float]:
    """Return the share of time on each part, and "elsewhere"; they sum to 1.

    points_face_m: (n, 2) y, z; seconds: (n,)

    Raises:
        ValueError: there is no time at all, or shapes or numbers are not as they should be.
    """
    points, times = _checked(points_face_m, seconds)
    centres = np.array([PARTS_FACE_M[part][1:] for part in PARTS])
    apart = np.linalg.norm(points[:, None] - centres[None], axis=2)
    nearest = np.where(apart.min(axis=1) <= _NEAR_M, apart.argmin(axis=1), len(PARTS))
    total = np.bincount(nearest, weights=times, minlength=len(PARTS) + 1) / times.sum()
    return dict(zip((*PARTS, "elsewhere"), total.tolist(), strict=True))


def heatmap(
    points_face_m: ArrayLike,
    seconds: ArrayLike,
    out: Path,
    image: Path | None = None,
    force: bool = False,
) -> dict[str, float]:
    """Write the heat map as a PNG over a drawn face or a face image; give the shares.

    points_face_m: (n, 2) y, z; seconds: (n,) time on each
    image: a photograph of one face from its front; force: replace a file that is there

    Raises:
        SetupError: no face in the image, or a file cannot be read or written.
        ValueError: as of ``share_per_part``.
    """
    points, times = _checked(points_face_m, seconds)
    shares = share_per_part(points, times)
    canvas = draw_face() if image is None else face_from(image)
    per_m2 = density_s_m2(points, times)
    painted = _painted(canvas, per_m2)
    whole = with_legend(painted, float(per_m2.max()) / 1e4, float(times.sum()), shares)
    ok, data = cv2.imencode(".png", whole)
    if not ok:
        raise SetupError(f"{out}: the image cannot be written as PNG")
    write_file(out, data.tobytes(), force)
    return shares


def density_s_m2(points_face_m: Floats, seconds: Floats) -> Floats:
    """Return seconds per square metre for every pixel of the canvas, (HEIGHT_PX, WIDTH_PX)."""
    columns, rows = np.rint(on_canvas(points_face_m)).astype(int).T
    inside = (columns >= 0) & (columns < WIDTH_PX) & (rows >= 0) & (rows < HEIGHT_PX)
    time = np.zeros((HEIGHT_PX, WIDTH_PX))
    np.add.at(time, (rows[inside], columns[inside]), seconds[inside])
    sigma = _SPREAD_M * PX_PER_M
    spread = cv2.GaussianBlur(time, (0, 0), sigma, borderType=cv2.BORDER_CONSTANT)
    return np.asarray(spread, dtype=np.float64) * PX_PER_M**2


def face_from(photo: Path) -> Image:
    """Bring the largest face of a photograph to the canvas, by its eyes and mouth.

    Raises:
        SetupError: it cannot be read, or no face is found in it.
    """
    try:
        data = np.frombuffer(read_limited(photo, _LARGEST), np.uint8)
    except OSError as error:
        raise SetupError(
            f"{photo}: is no image that can be read ({error.strerror}); give a JPEG or PNG"
        ) from None
    try:
        image = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    except cv2.error:  # larger than an image may be
        image = None
    if image is None:
        raise SetupError(f"{photo}: is no image that can be read; give a JPEG or PNG")
    faces = face_detector(FaceDetectorParams()).find(np.asarray(image, dtype=np.uint8))
    if not faces:
        raise SetupError(f"{photo}: no face found; give an image of one face from its front")
    flat = [0, 1, 3, 4]  # without the nose, which is in front of the plane
    there = faces[0].landmarks_px[flat]
    here = on_canvas(LANDMARKS_FACE_M[flat, 1:])
    ones = np.ones((len(flat), 1))
    affine = np.linalg.lstsq(np.hstack([there, ones]), here, rcond=None)[0].T
    size = (WIDTH_PX, HEIGHT_PX)
    shown = cv2.warpAffine(
        image, affine, size, flags=cv2.INTER_AREA, borderMode=cv2.BORDER_REPLICATE
    )
    # Pale and grey, so that the colours of the map are the only ones.
    grey = cv2.cvtColor(cv2.cvtColor(shown, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    return np.asarray(cv2.addWeighted(grey, 0.8, grey, 0.0, 40.0), dtype=np.uint8)


def _painted(canvas: Image, density: Floats) -> Image:
    """Lay the map over the canvas: from nothing over purple and orange to yellow."""
    top = float(density.max())
    share = density / top if top > 0.0 else density
    colours = cv2.applyColorMap((255.0 * share).astype(np.uint8), cv2.COLORMAP_PLASMA)
    cover = _COVER * np.clip((share - _FAINT) / (_PLAIN - _FAINT), 0.0, 1.0) ** 0.7
    mixed = canvas * (1.0 - cover[..., None]) + colours * cover[..., None]
    return np.asarray(np.rint(mixed), dtype=np.uint8)


def _checked(points_face_m: ArrayLike, seconds: ArrayLike) -> tuple[Floats, Floats]:
    points, times = np.asarray(points_face_m, float), np.asarray(seconds, float)
    if points.ndim != 2 or points.shape[1:] != (2,) or times.shape != (len(points),):
        raise ValueError(f"wanted (n, 2) points and (n,) times, not {points.shape}, {times.shape}")
    if not np.isfinite(points).all() or not np.isfinite(times).all() or (times < 0.0).any():
        raise ValueError("points and times must be finite, and no time below 0")
    if times.sum() <= 0.0:
        raise ValueError("the gaze was never on a face: there is nothing to map")
    return points, times
