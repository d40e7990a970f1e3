"""Disc of light or shade that fades out."""

from math import pi

import numpy as np

from gazerig.robot.description.mesh import turned
from gazerig.robot.description.paint import Painted, plain


def glow(inner: tuple[int, int, int, int], rings: int = 20) -> Painted:
    """Return a flat disc of radius 1, facing up, that fades out from its middle."""
    radius = np.linspace(1.0, 0.0, rings)
    mesh = turned([(r, 0.0) for r in radius.tolist()])
    alpha = np.repeat(
        (0.5 + 0.5 * np.cos(pi * radius)) ** 1.3 * inner[3], len(mesh.vertices) // rings
    )
    colours = np.column_stack((plain(mesh, inner[:3]), alpha))
    return Painted(mesh, colours, np.tile((0.0, 0.0, 1.0), (len(mesh.vertices), 1)))
