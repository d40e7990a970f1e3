"""A turning head in a still room detects no moving body; and it detects a moving one."""

from collections.abc import Callable
from dataclasses import astuple

import numpy as np
import pytest
from numpy.typing import NDArray
from reviewed import assert_reviewed
from seeing.moving_room import FIELD_RAD, FOCAL_PX, HEIGHT, WIDTH, Board, Pose, frame, rotation

from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.detector import MotionDetector
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.model.intrinsics import rays

LENS = intrinsics_of_view(FIELD_RAD, WIDTH, HEIGHT)
DT_S = 1 / 30
LEVER_M = np.array([0.0, -0.05, 0.08])
"""From the neck's axis to the lens, as in the pictures: still things near it pass the wall."""
WALL = Board((0.0, 0.0, 3.0), (6.0, 3.0), 0)
WALKER = Board((-0.3, 0.1, 2.0), (0.25, 0.25), 1, speed_m_s=-1.0)
"""Moves to the right at 1 m/s."""

PIXELS = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1)
WAYS = rays(PIXELS.reshape(-1, 2), LENS).reshape(HEIGHT, WIDTH, 3)
WAYS /= WAYS[..., 2:]

Array = NDArray[np.float64]


def pose(yaw_deg: float) -> Pose:
    return Pose(yaw_deg, 0.2 * yaw_deg)


def depth(R: Array, boards: tuple[Board, ...], t_s: float, rng: np.random.Generator) -> Array:
    """Return distances along the optical axis, with holes."""
    ways = WAYS @ R.T
    p = R @ LEVER_M
    out = np.full((HEIGHT, WIDTH), np.inf)
    for board in boards:
        centre = board.at(t_s)
        z = (centre[2] - p[2]) / ways[..., 2]
        at = p + z[..., None] * ways
        inside = (np.abs(at[..., :2] - centre[:2]) <= board.half_m).all(axis=-1)
        out = np.where(inside, np.minimum(z, out), out)
    out[rng.random(out.shape) < 0.05] = 0.0
    return out


def ramp(speed_deg_s: float) -> Callable[[float], float]:
    """Return a turn that takes 100 ms to get going; the middle of it looks straight ahead."""

    def yaw_deg(t_s: float) -> float:
        since = max(0.0, t_s - 2 * DT_S)
        way = since**2 / 0.2 if since < 0.1 else since - 0.05
        return speed_deg_s * (way - 0.1)

    return yaw_deg


def watch(
    yaw_deg: Callable[[float], float],
    *boards: Board,
    gain: float = 0.98,
    lag_s: float = 0.010,
    known: bool = True,
    depth_known: bool = False,
    count: int = 10,
) -> tuple[list[tuple[MovingBlob, ...]], list[str]]:
    """Turn the head, give the joints' angles to the detector, and return its detections."""
    rng = np.random.default_rng(9)
    detector = MotionDetector(MotionParams())

    def joints(t_s: float) -> Array:
        return rotation(pose(gain * yaw_deg(t_s - lag_s)))

    found, silent = [], []
    for k in range(count):
        t_s = k * DT_S
        seen_from = pose(yaw_deg(t_s))
        now, before = joints(t_s), joints(t_s - DT_S)
        found.append(
            detector.find(
                frame(seen_from, t_s, (WALL, *boards), rng).image,
                t_s,
                LENS,
                np.transpose(now) @ before if known else None,
                depth(rotation(seen_from), (WALL, *boards), t_s, rng) if depth_known else None,
            )
        )
        silent.append(detector.no_result_reason)
    return found, silent


@pytest.mark.parametrize(
    ("speed_deg_s", "gain", "lag_s"),
    [(0, 0.98, 0.01), (20, 0.98, 0.01), (60, 0.98, 0.01), (150, 0.98, 0.01), (150, 1.0, 0.0)],
)
def test_a_turning_head_in_a_still_room_sees_nothing_move(speed_deg_s, gain, lag_s):
    found, silent = watch(ramp(speed_deg_s), gain=gain, lag_s=lag_s)
    assert not any(found)
    assert silent.count("") >= 6


@pytest.mark.parametrize(
    ("speed_deg_s", "known"), [(0, False), (20, True), (60, True), (60, False)]
)
def test_somebody_who_walks_is_seen_while_the_head_turns(speed_deg_s, known):
    found, _ = watch(ramp(speed_deg_s), WALKER, known=known)
    assert all(len(blobs) == 1 for blobs in found[2:])
    blobs = [blobs[0] for blobs in found[2:]]
    assert len({blob.id for blob in blobs}) == 1
    flow = np.median([blob.flow_px_s for blob in blobs], axis=0)
    assert flow == pytest.approx((FOCAL_PX / 2.0, 0.0), abs=0.1 * FOCAL_PX / 2.0)


@pytest.mark.parametrize("known", [True, False])
def test_a_thing_comes_in_at_the_side_of_a_camera_whose_turn_is_known(known):
    found, _ = watch(
        ramp(20.0), Board((1.2, 0.1, 2.0), (0.25, 0.25), 1, speed_m_s=1.0), known=known
    )
    assert any(blob.from_side for blobs in found[5:] for blob in blobs) is known


@pytest.mark.parametrize("known", [True, False])
def test_every_number_of_a_walker_is_as_it_was_reviewed(known):
    found, silent = watch(ramp(30.0), WALKER, known=known, depth_known=True, count=4)
    rows = [[x for x in astuple(blob)[2:] if x is not None] for blob in found[-1]]
    assert_reviewed(f"walker-{known}", [np.hstack(row).tolist() for row in rows])
    assert silent[:2] == ["first frame", ""]


def test_nothing_is_said_during_a_fast_turn_and_the_walker_keeps_his_number():
    def glance(t_s: float) -> float:
        return 20.0 * float(np.clip((t_s - 0.2) / 0.08, 0.0, 1.0))

    found, silent = watch(glance, WALKER, count=16)
    assert "the camera turns too fast" in silent
    for blobs, why in zip(found, silent, strict=True):
        assert not (blobs and why)
    ids = {blob.id for blobs in found for blob in blobs}
    assert len(ids) == 1 and found[5] and found[-1]
