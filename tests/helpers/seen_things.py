"""A rig that sees a face, a hand or a thing, and a ball."""

import numpy as np
from page_feed import shown
from shown_page import FACE

from gazerig.gaze.types import Bodies, Percept
from gazerig.robot.dashboard.feed.rig_feed import ShownHead


def seen(kind: str) -> ShownHead:
    """Return a rig that sees a face, number 3, a body of a kind, 7, and a thing, 8."""
    places, still = np.array(((0.6, 0.2, 0.1), (0.6, -0.2, 0.1))), np.zeros((2, 3))
    bodies = Bodies((7, 8), (kind, "thing"), places, still, still, np.array((0.06, 0.05)))
    return shown(percept=Percept(1.0, bodies, (FACE,)))
