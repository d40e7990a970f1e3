"""A face detector of one's own: upright patches of the colour of skin.

Shows: gazerig.open(detector=...): any object with a method ``find``.
Run:   python examples/own_detector.py            finds the visitor of a drawn scene
       python examples/own_detector.py my.yaml 0  your own head, through webcam 0
"""

import sys

import cv2
import numpy as np

import gazerig
from gazerig.drivers.types import DetectedFace, ImageArray

# Right eye, left eye, nose, right and left corner of the mouth: shares of a face's box.
LANDMARKS = np.array([(0.3, 0.3), (0.7, 0.3), (0.5, 0.52), (0.35, 0.68), (0.65, 0.68)])


class Skin:
    """Finds a face in every upright patch of skin above a neck."""

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return the faces in a BGR image, the largest first."""
        skin = cv2.inRange(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), (0, 40, 120), (22, 180, 255))
        _, _, stats, _ = cv2.connectedComponentsWithStats(skin)
        found = [(x, y, w, 1.4 * w) for x, y, w, h, _ in stats[1:] if w > 20 and h > 1.3 * w]
        return tuple(_face(*box) for box in sorted(found, key=lambda box: -box[2]))


def _face(x: float, y: float, width: float, height: float) -> DetectedFace:
    landmarks = LANDMARKS * (width, height) + (x, y)
    return DetectedFace((float(x), float(y), float(width), height), landmarks, 0.9)


if __name__ == "__main__":
    opened = (
        gazerig.open(sys.argv[1], camera=int(sys.argv[2]), detector=Skin())
        if sys.argv[2:]
        else gazerig.open("desk", fast=True, detector=Skin())
    )
    with opened as head:
        for state in head.states(rate_hz=4.0, seconds=4.0):
            print(f"{len(state.people)} seen, looks at {state.gaze.target}")
