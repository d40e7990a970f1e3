"""What the page is made of: shapes, words, traces, and the picture with what was found."""

import math

import cv2
import numpy as np
import pytest

from drivers.types import DetectedFace, Detections, MovingBlob
from robot.page import MESSAGE_BYTES
from robot.page_mesh import Mesh, cap, ellipsoid, lid, ring, turned
from robot.page_panel import Traces, status
from robot.page_people import fixated_part
from robot.page_picture import PICTURE_WIDTH_PX, draw_detections, encode
from robot.types import SeenFace, Snapshot

AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def snapshot(
    t_s: float = 0.0,
    measured_rad: tuple[float, ...] = (0.0,) * 9,
    reasons: tuple[str, ...] = (),
) -> Snapshot:
    return Snapshot(
        t_s=t_s,
        measured_rad=measured_rad,
        wish_rad=measured_rad,
        R_world_head=AHEAD,
        p_world_head_m=(0.03, 0.0, 0.14),
        p_world_eyes_m=((0.03, 0.031, 0.14), (0.03, -0.031, 0.14)),
        gaze_world=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        lids=(0.8, 0.8),
        p_world_target_m=(1.0, 0.0, 0.14),
        target_name="face <3>",
        why="the rule 'person' pulls",
        phase="pursue",
        level="limited" if reasons else "ok",
        reasons=reasons,
        faces=(),
        bodies=(),
        rate_hz=199.7,
        health="3 lost",
    )


def camera_picture() -> tuple[np.ndarray, Detections]:
    picture = np.full((480, 640, 3), 90, np.uint8)
    landmarks = np.array(((300.0, 195), (360, 195), (330, 225), (305, 260), (355, 260)))
    faces = (DetectedFace((258.0, 125.0, 144.0, 190.0), landmarks, 0.98),)
    blobs = (MovingBlob(7, "hand", (0.35, 0.1, 0.8), 0.06),)
    return picture, Detections(1.0, 1, 640, 480, faces, blobs, picture)


def test_status_tells_target_reason_and_guard_and_runs_no_markup() -> None:
    words = status(snapshot(reasons=tuple(f"joint {n}: too fast" for n in range(6))))
    for word in ("face &lt;3&gt;", "pursue", "guard: limited", "200 Hz", "3 lost"):
        assert word in words
    assert "the rule &#x27;person&#x27; pulls" in words
    assert "joint 3: too fast" in words
    assert "joint 4" not in words
    assert "and 2 more" in words
    assert "too fast" not in status(snapshot())


def test_traces_keep_ten_seconds_and_start_anew_with_the_clock() -> None:
    traces = Traces()
    for tick in range(1500):
        traces.add(snapshot(0.01 * tick, (0.1, 0.0, 0.3, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0)))
    ago_s, eye_deg, head_deg = traces.columns()
    assert 990 <= len(ago_s) <= 1010
    assert ago_s[0] == pytest.approx(-10.0, abs=0.02)
    assert ago_s[-1] == 0.0
    assert np.allclose(eye_deg, math.degrees(0.2))
    assert np.allclose(head_deg, math.degrees(0.2))
    traces.add(snapshot(0.0))
    assert len(traces.columns()[0]) == 1


def test_the_part_on_the_target_is_the_fixated_one() -> None:
    parts_m = tuple((0.9, 0.03 * row, 0.25) for row in range(8))
    face = SeenFace(3, (0.9, 0.1, 0.25), AHEAD, parts_m)
    for row, (x, y, z) in enumerate(parts_m):
        assert fixated_part(face, (x + 0.01, y, z)) == row
    assert fixated_part(face, (0.5, 0.1, 0.25)) is None


def volume(mesh: Mesh) -> float:
    """Signed volume: positive when every triangle is counter-clockwise seen from outside."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def test_closed_shapes_have_their_volume_and_look_outwards() -> None:
    ball = 4.0 / 3.0 * math.pi
    assert volume(cap(1.0, math.pi, 40)) == pytest.approx(ball, rel=0.02)
    assert volume(ellipsoid((1.0, 2.0, 3.0), rings=41)) == pytest.approx(6.0 * ball, rel=0.02)
    assert volume(ring(1.0, 0.1)) == pytest.approx(2.0 * math.pi**2 * 0.01, rel=0.05)
    cylinder = turned([(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)])
    assert volume(cylinder) == pytest.approx(2.0 * math.pi, rel=0.02)


def test_lid_sweeps_upwards_from_its_edge() -> None:
    vertices = lid(1.0, math.pi / 2).vertices
    assert np.allclose(np.linalg.norm(vertices, axis=1), 1.0)
    assert vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert vertices[:, 0].min() == pytest.approx(0.0, abs=1e-9)


def test_detections_are_drawn_small_and_into_a_copy() -> None:
    picture, detections = camera_picture()
    before = picture.copy()
    drawn = draw_detections(picture, detections, (500.0, 100.0), focal_px=300.0)
    assert drawn.shape == (240, PICTURE_WIDTH_PX, 3)
    assert np.array_equal(picture, before)
    plain = draw_detections(picture, Detections(1.0, 1, 640, 480), None, focal_px=300.0)
    changed = np.abs(drawn.astype(int) - plain).sum(axis=2) > 60
    # Face box, left edge; a landmark; the blob at 320 + 300 * 0.35 / 0.8; the gaze point.
    for x_px, y_px in ((129, 110), (150, 97), (226, 150), (250, 50)):
        assert changed[y_px - 12 : y_px + 13, x_px - 12 : x_px + 13].any()
    assert not changed[200:, :].any()


def test_no_picture_is_a_dark_ground_and_what_is_behind_is_not_drawn() -> None:
    behind = Detections(1.0, 1, 320, 240, blobs=(MovingBlob(1, "thing", (0.0, 0.0, -1.0), 0.1),))
    drawn = draw_detections(None, behind, None, focal_px=300.0)
    assert drawn.shape == (240, 320, 3)
    assert len(np.unique(drawn)) == 1
    far_out = draw_detections(None, Detections(1.0, 1, 320, 240), (1e12, -1e12), focal_px=300.0)
    assert np.array_equal(far_out, drawn)


def test_encoded_picture_is_a_jpeg_that_fits_a_message() -> None:
    noise = np.random.default_rng(1).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    jpeg = encode(noise)
    assert len(jpeg) < MESSAGE_BYTES
    assert cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR).shape == noise.shape
