"""People who walk in a square, against a mask that knows nothing of flow."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.vision.motion.detector import MotionDetector
from gazerig.drivers.vision.motion.params import MotionParams

FILM = Path(__file__).parents[2] / "shared" / "media" / "vtest.avi"
RATE_HZ, LEARN, LOOK = 10.0, 40, 40
BEGIN = 210


@pytest.mark.skipif(not FILM.exists(), reason=f"no film at {FILM}")
def test_what_moves_lies_on_people_who_walk() -> None:
    film = cv2.VideoCapture(str(FILM))
    ground = cv2.createBackgroundSubtractorMOG2(detectShadows=True)
    detector = MotionDetector(MotionParams())
    speck, near = np.ones((3, 3), np.uint8), np.ones((11, 11), np.uint8)
    on = reported = peopled = noticed = 0
    for k in range(BEGIN + LOOK):
        good = film.grab()
        assert good
        if k < BEGIN - LEARN * 5 or (k < BEGIN and k % 5):
            continue
        _, picture = film.retrieve()
        moving = (ground.apply(picture) == 255).astype(np.uint8)
        if k < BEGIN:
            continue
        height, width = picture.shape[:2]
        lens = Intrinsics(
            fx_px=0.73 * width, fy_px=0.73 * width, cx_px=(width - 1) / 2, cy_px=(height - 1) / 2
        )
        blobs = detector.find(picture, k / RATE_HZ, lens, np.eye(3))
        if k < BEGIN + RATE_HZ:
            continue
        mask = cv2.dilate(cv2.morphologyEx(moving, cv2.MORPH_OPEN, speck), near)
        centres = [blob.centre_px for blob in blobs if blob.centre_px is not None]
        on += sum(int(mask[round(y), round(x)]) for x, y in centres)
        reported += len(centres)
        peopled += int(mask.sum() > 4000)
        noticed += int(mask.sum() > 4000 and bool(centres))
    film.release()
    assert reported > 2 * LOOK
    assert on >= 0.95 * reported
    assert noticed >= 0.98 * peopled > 0
