"""Networks of MediaPipe that find boxes with points from anchors, run by LiteRT."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_stderr
from gazerig.drivers.errors import ModelFileError, extra_hint
from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.face.preprocess import crop_square
from gazerig.drivers.vision.model_files import ModelFile

Floats = NDArray[np.float32]


Network = Callable[[Floats], tuple[Floats, Floats]]
"""Returns boxes with points and scores of an RGB square, one row per anchor.

Shapes are (2254, 12) and (2254,) for people, from values of -1..1, and (2016, 18) and (2016,) for
palms, from values of 0..1.
"""
# Intersection over union above which two boxes are the same thing: MediaPipe's value.
_SAME = 0.3


def load_network(file: ModelFile) -> Network:
    """Return a network.

    Raises:
        FileNotFoundError: the user has no file for it.
        ModelFileError: the file or LiteRT cannot be used.
    """
    content = file.read()
    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError as error:
        raise ModelFileError(extra_hint("ai-edge-litert", "people", error)) from error
    with quiet_stderr():  # LiteRT prints a banner
        net = Interpreter(model_content=content, num_threads=1)
        net.allocate_tensors()
    (given,), (boxes, scores) = net.get_input_details(), net.get_output_details()

    def run(square: Floats) -> tuple[Floats, Floats]:
        net.set_tensor(given["index"], square[np.newaxis])
        net.invoke()
        return net.get_tensor(boxes["index"])[0], net.get_tensor(scores["index"])[0, :, 0]

    return run


class PointSearch:
    """Search of a square of an image for things with points.

    Args:
        network: The network.
        side_px: Side of the square that it expects.
        cells: Cells of its anchors: size in pixels, and anchors per cell.
        grey_levels: Grey levels per unit of its input.
        black: Its input for black.
    """

    def __init__(
        self,
        network: Network,
        side_px: int,
        cells: tuple[tuple[int, int], ...],
        grey_levels: float,
        black: float,
    ) -> None:
        self._network, self._side_px = network, side_px
        self._anchors = anchors(side_px, cells)
        self._grey_levels, self._black = np.float32(grey_levels), np.float32(black)

    def search(
        self, image: ImageArray, box: NDArray[np.float64], least: float
    ) -> list[tuple[NDArray[np.float64], float]]:
        """Return points and confidence of what has at least this confidence, the surest first.

        The points (n, 2) are in pixels of the frame; the first is the centre of the thing's box. Of
        things whose boxes overlap, one is returned.

        Args:
            image: The frame.
            box: The square (left, top, right, bottom), pixel edges.
            least: Smallest confidence.
        """
        part, where = crop_square(image, box, self._side_px)
        rgb = cv2.cvtColor(part, cv2.COLOR_BGR2RGB).astype(np.float32)
        numbers, scores = self._network(rgb / self._grey_levels + self._black)
        sure = 1.0 / (1.0 + np.exp(-np.clip(scores, -50.0, 50.0).astype(np.float64)))
        # Pairs: centre and size of the box, then the other points.
        pairs = numbers.reshape(len(numbers), -1, 2).astype(np.float64) / self._side_px
        size = pairs[:, 1].copy()
        pairs += self._anchors[:, None]
        rects = np.hstack([pairs[:, 0] - size / 2.0, size])
        rows = cv2.dnn.NMSBoxes(rects, sure, least, _SAME)  # type: ignore[arg-type]
        points = np.delete(pairs, 1, axis=1) * (where[2] - where[0]) + where[:2] - 0.5
        return [(points[row], float(sure[row])) for row in rows if np.isfinite(points[row]).all()]


def anchors(side_px: int, cells: tuple[tuple[int, int], ...]) -> NDArray[np.float64]:
    """Return the anchors (n, 2) of boxes and points, as shares of the square's side.

    cells: size of a cell in pixels, and anchors per cell
    """
    levels = []
    for cell, count in cells:
        across = (np.arange(side_px // cell) + 0.5) * cell / side_px
        y, x = np.meshgrid(across, across, indexing="ij")
        levels.append(np.column_stack([x.ravel(), y.ravel()]).repeat(count, axis=0))
    return np.concatenate(levels)
