"""Things without number and empty pictures cost no more than what may be reported."""

from types import ModuleType

import cv2
import numpy as np

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.vision.motion import clustering, detector
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.perception.motion_source import MotionSource


def counted(monkeypatch, module: ModuleType, name: str) -> list[object]:
    """Let a function of a module note each of its calls; return the list that grows."""
    calls: list[object] = []
    function = getattr(module, name)

    def noted(*args: object) -> object:
        calls.append(name)
        return function(*args)

    monkeypatch.setattr(module, name, noted)
    return calls


def test_a_hundred_things_cost_no_more_than_may_be_reported(monkeypatch):
    measured = counted(monkeypatch, detector, "patch_motion")
    source, most = MotionSource(MotionParams(), None, 1.2, None), clustering.MOST_BLOBS
    grain = np.random.default_rng(0).standard_normal((2, 400, 700))
    ground, cover = (
        np.clip(128 + 400 * cv2.GaussianBlur(one, (0, 0), 3.0), 0, 255).astype(np.uint8)
        for one in grain
    )
    for k in range(4):
        image = ground[:, :640].copy()
        for y, x in np.ndindex(8, 12):
            window = np.s_[50 * y : 50 * y + 20, 50 * x + 4 * k : 50 * x + 4 * k + 20]
            image[window] = cover[50 * y : 50 * y + 20, 50 * x : 50 * x + 20]
        assert len(source(Shot(k / 30, k + 1, image))) <= most
    assert 0 < len(measured) <= 3 * most, "three pairs of frames"


def test_a_film_of_one_colour_holds_nothing(monkeypatch):
    measured = counted(monkeypatch, detector, "patch_motion")
    source = MotionSource(MotionParams(), None, 1.2, None)
    for k, level in enumerate((90, 90, 93, 200)):
        assert not source(Shot(k / 30, k + 1, np.full((400, 640), level, np.uint8)))
    assert not measured
