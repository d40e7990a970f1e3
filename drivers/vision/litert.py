"""Networks of MediaPipe that find boxes with points from anchors, run by LiteRT."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_stderr
from gazerig.drivers.errors import ModelFileError, extra_hint
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


def confidences(scores: Floats) -> NDArray[np.float64]:
    """Return scores of a network as confidences, 0..1."""
    sure: NDArray[np.float64] = 1.0 / (
        1.0 + np.exp(-np.clip(scores, -50.0, 50.0).astype(np.float64))
    )
    return sure


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
