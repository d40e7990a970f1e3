"""Things without number and empty pictures cost no more than what may be reported."""

from dataclasses import replace
from types import ModuleType

import cv2
import numpy as np
import pytest
from seeing.row_09_identities import SIZE, perception

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import Detections, MovingBlob
from gazerig.drivers.vision.motion import clustering, detector
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.perception.motion_source import MotionSource


def moving(id: int, t_s: float) -> MovingBlob:
    """Return one of the things that move to and fro, as the motion detector gives it."""
    x, v = 0.1 * np.sin(3.0 * t_s + id), 0.3 * np.cos(3.0 * t_s + id)
    row, column = divmod(id, 4)
    p = 0.5 * (column - 1.5) + float(x), 0.6 * (row - 0.5), 2.0
    v_m_s = float(v), 0.0, 0.0
    return MovingBlob(
        id + 1,
        "thing",
        p,
        0.1,
        v_camera_m_s=v_m_s,
        depth_known=False,
        depth_sd_m=1.0,
        box_px=(0.0, 0.0, 60.0, 60.0),
        area_px=2800.0,
        fastest_m=p,
        fastest_m_s=v_m_s,
        thickness_m=0.2,
    )


def counted(monkeypatch: pytest.MonkeyPatch, module: ModuleType, name: str) -> list[object]:
    """Let a function of a module note each of its calls; return the list that grows."""
    calls: list[object] = []
    function = getattr(module, name)

    def noted(*args: object) -> object:
        calls.append(name)
        return function(*args)

    monkeypatch.setattr(module, name, noted)
    return calls


def test_a_hundred_things_cost_no_more_than_may_be_reported(
    monkeypatch: pytest.MonkeyPatch,
):
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


def test_a_film_of_one_colour_holds_nothing(monkeypatch: pytest.MonkeyPatch):
    measured = counted(monkeypatch, detector, "patch_motion")
    source = MotionSource(MotionParams(), None, 1.2, None)
    for k, level in enumerate((90, 90, 93, 200)):
        assert not source(Shot(k / 30, k + 1, np.full((400, 640), level, np.uint8)))
    assert not measured


def test_of_two_thousand_things_the_largest_and_fastest_are_tracked():
    see, poses = perception()
    large = replace(moving(4, 0.0), id=5001)
    for number in range(1, 4):
        small = (moving(k % 8, number / 30) for k in range(2000))
        blobs = tuple(replace(blob, id=k, radius_m=0.01) for k, blob in enumerate(small))
        found = see.see(
            Detections(number / 30, number, *SIZE, faces=(), blobs=(*blobs, large)), poses
        )
    assert found is not None
    assert 1 <= len(found.bodies.ids) <= 3 * 24
    assert found.bodies.radius_m.max() == pytest.approx(large.radius_m)
