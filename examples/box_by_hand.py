"""Moves the opponent of a boxing world by your own hand in front of a webcam.

Shows: an order to a head in another program, 20 times a second; the detector of palms.
Run:   python examples/box_by_hand.py 0         through webcam 0, next to a running
       gazerig run --mock --world boxing        (once before: gazerig models fetch hands)
"""

import sys
import time

import cv2
import numpy as np

import gazerig
from gazerig.drivers.types import DetectedFace, DetectedPalm
from gazerig.drivers.vision.body_detector import BodyDetector
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.robot.model.commands import OPPONENT_BOX_M

# Height of a face's box and length of a palm; focal length of a usual webcam over its width.
FACE_M, PALM_M, FOCAL = 0.163, 0.095, 0.9
OPPONENT_FACE_M = np.array((0.92, 0.0, 0.21))


def fist_m(face: DetectedFace, palm: DetectedPalm, width_px: int) -> list[float]:
    """Return the point of the fist, as far from the opponent's face as the palm from yours."""
    x, y, width, height = face.box_px
    focal_px = FOCAL * width_px
    face_m, palm_m = focal_px * FACE_M / height, focal_px * PALM_M / palm.size_px
    across, down = palm.centre_px[0] - x - width / 2.0, palm.centre_px[1] - y - height / 2.0
    # You face the camera as the opponent faces the head: your right is the head's left.
    off = np.array((palm_m - face_m, -across * palm_m / focal_px, -down * palm_m / focal_px))
    at: list[float] = np.clip(OPPONENT_FACE_M + off, *np.transpose(OPPONENT_BOX_M)).tolist()
    return at


def box(head: gazerig.Head, camera: cv2.VideoCapture, detector: BodyDetector) -> None:
    """Move the opponent's fist to the palm that is held out farthest, until the camera ends."""
    while (frame := camera.read())[0]:
        image = np.asarray(frame[1], np.uint8)
        faces = detector.find(image)
        palms = detector.palms(image, time.monotonic(), faces, ())
        if faces and palms:
            palm = max(palms, key=lambda one: one.size_px)
            head.move_opponent(*fist_m(faces[0], palm, image.shape[1]))


if __name__ == "__main__":
    hands = face_detector(FaceDetectorParams(people_hz=0.0, hands_hz=20.0))
    if not isinstance(hands, BodyDetector):
        sys.exit("no detector of palms: gazerig models fetch hands")
    with gazerig.connect(who="box_by_hand.py") as opened:
        box(opened, cv2.VideoCapture(int(sys.argv[1])), hands)
