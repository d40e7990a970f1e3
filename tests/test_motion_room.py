"""A turning head in a still room detects no moving body; and it detects a moving one."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.detector import MotionDetector, relative_rotation
from gazerig.drivers.vision.motion.params import MotionParams

WIDTH, HEIGHT, FOCAL = 320, 240, 233.0
LENS = Intrinsics(fx_px=FOCAL, fy_px=FOCAL, cx_px=(WIDTH - 1) / 2, cy_px=(HEIGHT - 1) / 2)
K = np.array([[FOCAL, 0, LENS.cx_px], [0, FOCAL, LENS.cy_px], [0, 0, 1]])
DT_S = 1 / 30
LEVER_M = np.array([0.0, -0.05, 0.10])
"""From the neck's axis to the lens: still things near it move past the wall."""
WALL_M = 3.0

Array = NDArray[np.float64]
Boards = Callable[[float], list[tuple[Array, float]]]
"""Time to (centre, half side) of square boards that face down the z axis."""


def textured(rng: np.random.Generator, height: int, width: int) -> Array:
    """Make blobs of several sizes, so that there is something to see from near and far."""
    out = np.zeros((height, width))
    for sigma in (1.2, 4.0, 12.0):
        grain = cv2.GaussianBlur(rng.standard_normal((height, width)), (0, 0), sigma)
        out += grain / grain.std()
    return np.clip(128 + 50 * out / out.std(), 0, 255)


RNG = np.random.default_rng(5)
WALL, BOARD = textured(RNG, 700, 1400), textured(RNG, 160, 160)


def turned(yaw_deg: float, pitch_deg: float) -> Array:
    """Return R_world_camera (optical axes), turned right and up."""
    a, b = np.radians(yaw_deg), np.radians(pitch_deg)
    yaw = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    pitch = np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    return yaw @ pitch


def painted(picture: Array, texture: Array, centre: Array, half: Array, R: Array) -> Array:
    """Paint an upright textured board into what the camera sees."""
    signs = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    seen = (centre + signs * half - R @ LEVER_M) @ R
    if seen[:, 2].min() < 0.05:
        return picture
    corners = seen @ K.T
    rows, columns = texture.shape
    source = np.array([(0, 0), (columns - 1, 0), (columns - 1, rows - 1), (0, rows - 1)])
    H = cv2.getPerspectiveTransform(
        source.astype(np.float32), (corners[:, :2] / corners[:, 2:]).astype(np.float32)
    )
    cover = cv2.warpPerspective(np.ones_like(texture), H, (WIDTH, HEIGHT))
    return picture * (1 - cover) + cv2.warpPerspective(texture, H, (WIDTH, HEIGHT)) * cover


def picture(R: Array, boards: list[tuple[Array, float]], rng: np.random.Generator) -> NDArray:
    """Return what the camera sees, with the noise of a small sensor."""
    out = np.full((HEIGHT, WIDTH), 128.0)
    out = painted(out, WALL, np.array([0, 0, WALL_M]), np.array([6.0, 3.0, 0.0]), R)
    for centre, half in sorted(boards, key=lambda board: -board[0][2]):
        out = painted(out, BOARD, centre, np.array([half, half, 0.0]), R)
    return np.clip(out + rng.normal(0, 2, out.shape), 0, 255).astype(np.uint8)


def depth(R: Array, boards: list[tuple[Array, float]], rng: np.random.Generator) -> Array:
    """Return distances along the optical axis, with holes."""
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    rays = np.stack(((x - K[0, 2]) / FOCAL, (y - K[1, 2]) / FOCAL, np.ones(x.shape)), -1) @ R.T
    p = R @ LEVER_M
    out = (WALL_M - p[2]) / rays[..., 2]
    for centre, half in boards:
        z = (centre[2] - p[2]) / rays[..., 2]
        at = p + z[..., None] * rays
        out = np.where((np.abs(at[..., :2] - centre[:2]) <= half).all(axis=-1), z, out)
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
    boards: Boards = lambda t_s: [],
    gain: float = 0.98,
    lag_s: float = 0.010,
    known: bool = True,
    depth_known: bool = False,
    light: float = 0.0,
    count: int = 10,
    params: MotionParams | None = None,
) -> tuple[list[tuple[MovingBlob, ...]], list[str]]:
    """Turn the head, give the joints' angles to the detector, and return its detections."""
    rng = np.random.default_rng(9)
    detector = MotionDetector(params or MotionParams())

    def joints(t_s: float) -> Array:
        yaw = gain * yaw_deg(t_s - lag_s)
        return turned(yaw, 0.2 * yaw)

    found, silent = [], []
    for k in range(count):
        t_s = k * DT_S
        R = turned(yaw_deg(t_s), 0.2 * yaw_deg(t_s))
        now, before = joints(t_s), joints(t_s - DT_S)
        seen = picture(R, boards(t_s), rng)
        seen = np.clip(seen * (1 + light * np.sin(2.0 * k)), 0, 255).astype(np.uint8)
        found.append(
            detector.find(
                seen,
                t_s,
                LENS,
                relative_rotation(now, before) if known else None,
                depth(R, boards(t_s), rng) if depth_known else None,
                now.T @ (before - now) @ LEVER_M if depth_known else None,
            )
        )
        silent.append(detector.report.no_result_reason)
    return found, silent


def still(x: float, y: float, z: float, half: float) -> Boards:
    return lambda t_s: [(np.array([x, y, z]), half)]


def walker(t_s: float) -> list[tuple[Array, float]]:
    """Somebody who walks to the right at 1 m/s, 2 m away."""
    return [(np.array([-0.3 + t_s, 0.1, 2.0]), 0.25)]


@pytest.mark.parametrize("speed_deg_s", [0, 20, 60, 120, 300])
@pytest.mark.parametrize(("gain", "lag_s"), [(1.0, 0.0), (0.98, 0.010)])
def test_a_turning_head_in_a_still_room_sees_nothing_move(
    speed_deg_s: float, gain: float, lag_s: float
) -> None:
    params = MotionParams(max_turn_deg_s=1000.0)  # not saved by silence
    found, silent = watch(ramp(speed_deg_s), gain=gain, lag_s=lag_s, params=params)
    assert not any(found)
    assert silent.count("") >= 6


def test_nor_what_stands_close_where_its_depth_is_known() -> None:
    close = still(0.1, 0.1, 0.5, 0.1)
    plain, _ = watch(ramp(20.0), close)
    assert any(plain)  # without depth the lens's own motion cannot be removed
    with_depth, _ = watch(ramp(20.0), close, depth_known=True)
    assert not any(with_depth)


@pytest.mark.parametrize("speed_deg_s", [0, 20, 60])
@pytest.mark.parametrize("known", [True, False])
def test_somebody_who_walks_is_seen_while_the_head_turns(speed_deg_s: float, known: bool) -> None:
    found, _ = watch(ramp(speed_deg_s), walker, known=known)
    assert all(len(blobs) == 1 for blobs in found[2:])
    blobs = [blobs[0] for blobs in found[2:]]
    assert len({blob.id for blob in blobs}) == 1
    flow = np.median([blob.flow_px_s for blob in blobs], axis=0)
    assert flow == pytest.approx((FOCAL / 2.0, 0.0), abs=0.1 * FOCAL / 2.0)


def test_with_depth_place_and_velocity_are_metric() -> None:
    found, _ = watch(ramp(20.0), walker, depth_known=True)
    blob = found[-1][0]
    R = turned(ramp(20.0)(9 * DT_S), 0.2 * ramp(20.0)(9 * DT_S))
    assert blob.depth_known and blob.depth_sd_m < 0.05 and blob.v_camera_m_s is not None
    p = R @ blob.p_camera_m + R @ LEVER_M
    assert p == pytest.approx(walker(9 * DT_S)[0][0], abs=0.06)
    assert R @ blob.v_camera_m_s == pytest.approx((1.0, 0.0, 0.0), abs=0.1)


def test_nothing_is_said_during_a_fast_turn_and_the_walker_keeps_his_number() -> None:
    def glance(t_s: float) -> float:
        return 20.0 * float(np.clip((t_s - 0.2) / 0.08, 0.0, 1.0))

    found, silent = watch(glance, walker, count=16)
    assert "the camera turns too fast" in silent
    for blobs, why in zip(found, silent, strict=True):
        assert not (blobs and why)
    ids = {blob.id for blobs in found for blob in blobs}
    assert len(ids) == 1 and found[5] and found[-1]
