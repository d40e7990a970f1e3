"""Networks of MediaPipe that find boxes with points from anchors, run by LiteRT."""

from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_stderr
from gazerig.drivers.errors import ModelFileError, extra_hint
from gazerig.drivers.types import ImageArray
from gazerig.drivers.vision.face.preprocess import as_bgr, crop_square
from gazerig.drivers.vision.model_files import ModelFile

Floats = NDArray[np.float32]


class Network(Protocol):
    """A network that can be run."""

    def __call__(self, square: Floats) -> tuple[Floats, Floats]:
        """Return boxes with points and scores of an RGB square, one row per anchor.

        Shapes are (2254, 12) and (2254,) for people, from values of -1..1, and (2016, 18) and
        (2016,) for palms, from values of 0..1.
        """


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
    ) -> tuple[NDArray[np.float64], list[float]]:
        """Return what has at least this confidence, the most certain first.

        Args:
            image: The frame.
            box: The square (left, top, right, bottom), pixel edges.
            least: Smallest confidence.

        Returns:
            Points (n, points, 2) in pixels of the frame, of which the first is the centre of the
            thing's box; and confidences.
        """
        part, where = crop_square(as_bgr(image), box, self._side_px)
        rgb = cv2.cvtColor(part, cv2.COLOR_BGR2RGB).astype(np.float32)
        boxes, scores = self._network(rgb / self._grey_levels + self._black)
        sure = 1.0 / (1.0 + np.exp(-np.clip(scores, -50.0, 50.0).astype(np.float64)))
        rows = np.argsort(-sure, kind="stable")[: int((sure >= least).sum())]
        # The third and fourth number are the size of the box.
        numbers = np.delete(boxes[rows], (2, 3), axis=1)
        pairs = numbers.reshape(len(rows), boxes.shape[1] // 2 - 1, 2) / self._side_px
        points = (pairs + self._anchors[rows][:, None]) * (where[2] - where[0]) + where[:2] - 0.5
        return points, sure[rows].tolist()


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
