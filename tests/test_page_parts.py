"""What the page is made of: shapes, words, traces, and the picture with what was found."""

import math
from dataclasses import replace
from html import escape

import cv2
import numpy as np
import pytest
from desk import GAZE_JOINTS
from present import present
from six_joints import ESTIMATED_RAD, SIX, WISH_RAD, of_six

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import DetectedFace, Detections, MovingBlob
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import Salience
from gazerig.robot.dashboard.feed.camera_overlay import (
    FARTHEST_M,
    IMAGE_WIDTH_PX,
    NEAREST_M,
    depth_image,
    draw_detections,
    encode,
    ground,
)
from gazerig.robot.dashboard.feed.page_process import MESSAGE_BYTES, pack, unpack
from gazerig.robot.dashboard.panels.attention_panel import reason, winner
from gazerig.robot.dashboard.panels.joint_charts import (
    GROUPS,
    MOST_POINTS,
    ChartGroup,
    JointSeries,
    groups_of,
    mean_deg,
)
from gazerig.robot.dashboard.panels.servo_health import guard, health
from gazerig.robot.dashboard.panels.status import (
    alarms,
    group_reasons,
    other_heads,
    without_feedback,
)
from gazerig.robot.dashboard.view.people import fixated_part
from gazerig.robot.dashboard.view.scene_node import along, turned_up, upright_along
from gazerig.robot.description.mesh import Mesh, cap, ellipsoid, lid, ring, turned
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.leader import Leader
from gazerig.robot.model.types import GAZE_JOINTS as EVERY_JOINT
from gazerig.robot.model.types import OtherHead, SeenFace, Snapshot, Trail

LENS = Intrinsics(300.0, 300.0, 319.5, 239.5)
Terms = tuple[float, float, float, float, float]
AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def snapshot(
    t_s: float = 0.0,
    measured_rad: tuple[float, ...] = (0.0,) * 9,
    reasons: tuple[str, ...] = (),
) -> Snapshot:
    return Snapshot(
        t_s=t_s,
        measured_rad=measured_rad,
        desired_rad=measured_rad,
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
        joints=GAZE_JOINTS,
    )


def camera_picture() -> tuple[np.ndarray, Detections]:
    picture = np.full((480, 640, 3), 90, np.uint8)
    landmarks = np.array(((300.0, 195), (360, 195), (330, 225), (305, 260), (355, 260)))
    faces = (DetectedFace((258.0, 125.0, 144.0, 190.0), landmarks, 0.98),)
    blobs = (MovingBlob(7, "hand", (0.35, 0.1, 0.8), 0.06),)
    return picture, Detections(1.0, 1, 640, 480, faces, blobs, picture)


def test_target_reason_and_guard_are_told_and_run_no_markup() -> None:
    shot = snapshot(reasons=tuple(f"joint {n}: too <fast>" for n in range(6)))
    for word in ("face &lt;3&gt;", "pursue", "the rule &#x27;person&#x27; pulls"):
        assert word in winner(shot)
    for word in ("guard: limited", "3 lost", "too &lt;fast&gt; (joint 0, +5)"):
        assert word in health(shot)
    assert "too" not in health(snapshot()) and alarms(snapshot()) == ""


def test_what_the_other_heads_do_is_told_and_that_one_is_let_go_is_an_alarm() -> None:
    well, limp = (
        OtherHead("anna", "looks at <1>"),
        OtherHead("bert", "the torque is off: hot", "torque_off"),
    )
    shot = replace(snapshot(), others=(well, limp))
    assert "anna: looks at &lt;1&gt;" in other_heads(shot) and other_heads(snapshot()) == ""
    assert "bert: the torque is off: hot" in alarms(shot) and "anna" not in alarms(shot)
    assert unpack(pack(shot)).others == shot.others


@pytest.mark.parametrize(
    ("terms", "said"),
    [
        ((0.38, 0.0, 0.0, 0.0, 0.0), "because it moves (translation 0.38)"),
        (
            (0.38, 0.0, 0.0, 0.0, 0.5),
            "because it moves (translation 0.38), and the behaviour wait adds 0.50",
        ),
        (
            (0.2, 0.3, 0.001, 0.0, 0.0),
            "because it moves (translation 0.20), comes nearer or goes away (looming 0.30)",
        ),
        ((0.0, 0.0, 0.0, 0.0, 0.5), "because the behaviour wait asks for it (0.50)"),
        ((0.0, 0.0, 0.0, 0.0, 0.0), "the rule 'person' pulls"),
    ],
)
def test_why_it_won_is_said_in_a_plain_sentence(terms: Terms, said: str) -> None:
    first = Salience(3, "face", *terms, 1.0, sum(terms))
    shot = replace(snapshot(), saliences=(first,), behaviour="wait")
    assert reason(shot) == said and escape(said) in winner(shot)
    led = replace(shot, leader=Leader("person", "ann", "look at 1 0 0"))
    assert reason(led) == shot.why


def test_why_a_planner_chose_is_said_with_it() -> None:
    first = Salience(3, "hand", 0.0, 0.0, 0.0, 0.0, 0.8, 1.0, 0.8)
    shot = replace(
        snapshot(), saliences=(first,), behaviour="planned", plan="guard: hand 3 arrives in 0.20 s"
    )
    assert (
        reason(shot) == "because the behaviour guard asks for it (0.80): hand 3 arrives in 0.20 s"
    )
    assert "behaviour: planned" in winner(shot) and "plan: guard" in winner(shot)


def test_equal_reasons_are_said_once() -> None:
    assert group_reasons(("a: hot", "b: too fast", "c: too fast")) == "hot (a), too fast (b, +1)"
    assert group_reasons(()) == ""


def test_a_short_limit_moves_nothing_on_the_page() -> None:
    limited = snapshot(reasons=tuple(f"joint {n}: too fast" for n in range(9)))
    assert guard(limited).count("<div") == guard(snapshot()).count("<div")
    assert alarms(limited) == ""


def test_what_holds_says_why_joint_by_joint() -> None:
    shot = replace(snapshot(reasons=tuple(f"joint {n}: hot" for n in range(6))), level="hold")
    held = alarms(shot)
    assert "joint 3: hot" in held and "joint 4" not in held and "and 2 more" in held
    assert "joint 5: hot" in health(shot)


def test_what_stands_still_shouts() -> None:
    stopped = replace(snapshot(), stopped="somebody pressed <STOP>", level="torque_off")
    assert "somebody pressed &lt;STOP&gt;" in health(stopped) and "guard: stopped" in health(
        stopped
    )
    assert alarms(stopped) == ""  # it is said beside the stop button, once
    held = alarms(replace(snapshot(reasons=("neck_yaw: hot",)), level="hold"))
    assert "class='banner hold'><b>guard: hold" in held and "neck_yaw: hot" in held
    assert "the frame is 2.5 s old" in alarms(replace(snapshot(), frame_age_s=2.5))
    assert "s old" not in alarms(replace(snapshot(), frame_age_s=0.08))


def moving(t_s: float, slope_deg: float = 1.0) -> Snapshot:
    """All joints at t degrees as wished, half as permitted, a quarter as measured."""
    angles = [
        (slope_deg * math.radians(t_s) * share,) * len(GAZE_JOINTS) for share in (1.0, 0.5, 0.25)
    ]
    return replace(snapshot(t_s), trail=(Trail(t_s, *angles),))


def test_traces_keep_half_a_minute_and_start_anew_with_the_clock() -> None:
    traces = JointSeries()
    for tick in range(4500):
        traces.add(moving(0.01 * tick))
    ago_s, angles_deg = traces.table(30.0)
    assert ago_s[0] == pytest.approx(-30.0, abs=0.1)
    assert ago_s[-1] == 0.0
    assert MOST_POINTS / 2 < len(ago_s) <= MOST_POINTS
    assert np.allclose(angles_deg[:, 0, 3], 44.99 + ago_s)
    assert np.allclose(angles_deg[-1, :, 0], (44.99, 22.495, 11.2475))
    assert traces.table(3.0)[0][0] == pytest.approx(-3.0, abs=0.011)
    traces.add(moving(0.0))
    assert len(traces.table(30.0)[0]) == 1


def test_a_group_is_the_mean_of_its_joints() -> None:
    angles_deg = np.zeros((2, 3, len(GAZE_JOINTS)))
    angles_deg[:, 2, GAZE_JOINTS.index("left_eye_pan")] = 4.0
    angles_deg[:, 2, GAZE_JOINTS.index("right_eye_pan")] = 2.0
    eyes = groups_of(GAZE_JOINTS)["yaw"][0]
    assert mean_deg(angles_deg, eyes, GAZE_JOINTS).tolist() == [[0.0, 0.0, 3.0]] * 2
    named = {name for groups in GROUPS.values() for group in groups for name in group.joints}
    assert named == set(EVERY_JOINT)


def test_traces_are_of_the_joints_that_are_there() -> None:
    desk = {
        name: [len(group.joints) for group in groups]
        for name, groups in groups_of(GAZE_JOINTS).items()
    }
    assert desk == {
        "yaw": [2, 1, 2], "pitch": [2, 1, 2], "left eye": [1, 1, 1], "right eye": [1, 1, 1],
        "neck": [1, 1, 1],
    }  # fmt: skip
    six = groups_of(SIX)
    assert tuple(six) == ("yaw", "pitch", "left eye", "right eye")
    assert [group.joints for group in six["yaw"]] == [
        ("eyes_pan",),
        ("left_upper_lid", "right_upper_lid"),
        ("left_lower_lid", "right_lower_lid"),
    ]
    assert six["left eye"][0] == ChartGroup("both eyes, yaw, + left", ("eyes_pan",))
    assert six["right eye"][-1].joints == ("right_lower_lid",)
    assert groups_of(()) == {}
    mixed = groups_of(("left_eye_pan", "right_eye_pan", "eyes_tilt"))
    assert [group.joints for group in mixed["right eye"]] == [("right_eye_pan",), ("eyes_tilt",)]


def test_traces_take_the_joints_of_the_rig_that_is_shown() -> None:
    traces = JointSeries()
    traces.add(moving(1.0))
    traces.add(of_six(snapshot(2.0)))
    ago_s, angles_deg = traces.table(30.0)
    assert traces.joints == SIX and traces.estimated == set(SIX)
    assert len(ago_s) == 1 and angles_deg.shape == (1, 3, 6)
    assert angles_deg[0, 0] == pytest.approx(np.degrees(WISH_RAD))
    assert angles_deg[0, 2] == pytest.approx(np.degrees(ESTIMATED_RAD))


def test_health_says_how_many_joints_nobody_measures() -> None:
    assert without_feedback(snapshot()) == ""
    said = "6 of 6 joints without feedback: shown where they should be"
    assert said in without_feedback(of_six(snapshot())) and said in health(of_six(snapshot()))
    assert "2 of 6 joints" in without_feedback(of_six(snapshot(), SIX[:2]))
    assert "anywhere" not in without_feedback(of_six(snapshot()))
    limp = of_six(snapshot())
    limp = replace(limp, servos=limp.servos._replace(torque=(True,) + (False,) * 5))
    assert "5 without torque: may be anywhere" in without_feedback(limp)
    limp = replace(limp, servos=limp.servos._replace(torque=(False,) * 6))
    assert "all without torque: may be anywhere" in without_feedback(limp)


def turn(q: tuple[float, float, float, float], v: tuple[float, float, float]) -> np.ndarray:
    """Turn a vector by a quaternion, the long way."""
    w, x, y, z = q
    R = np.array((
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    ))  # fmt: skip
    return R @ np.array(v)


def test_turns_lay_axes_where_they_should() -> None:
    dice = np.random.default_rng(3)
    for _ in range(50):
        x, y, z = (v := dice.normal(size=3)) / np.linalg.norm(v)
        assert np.allclose(turn(along((x, y, z)), (1.0, 0.0, 0.0)), (x, y, z))
        assert turn(along((x, y, z)), (0.0, 1.0, 0.0))[2] == pytest.approx(0.0, abs=1e-12)
        assert np.allclose(turn(upright_along((x, y, z)), (0.0, 0.0, 1.0)), (x, y, z))
        R = rotation(tuple(dice.uniform(-3.0, 3.0, 3)))
        for axis in AHEAD:
            assert np.allclose(turn(quaternion(R), axis), np.array(R) @ axis, atol=1e-7)
    assert np.allclose(turn(turned_up(0.3), (1.0, 0.0, 0.0)), (math.cos(0.3), 0.0, math.sin(0.3)))


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
    drawn = draw_detections(picture, detections, (500.0, 100.0), lens=LENS)
    assert drawn.shape == (480, IMAGE_WIDTH_PX, 3)
    assert np.array_equal(picture, before)
    plain = draw_detections(picture, Detections(1.0, 1, 640, 480), None, lens=LENS)
    changed = np.abs(drawn.astype(int) - plain).sum(axis=2) > 60
    # Face box, left edge; a landmark; the blob at 320 + 300 * 0.35 / 0.8; the gaze point.
    for x_px, y_px in ((258, 220), (300, 194), (452, 300), (500, 100)):
        assert changed[y_px - 18 : y_px + 19, x_px - 18 : x_px + 19].any()
    assert not changed[400:, :].any()


def test_no_picture_is_a_dark_ground_and_what_is_behind_is_not_drawn() -> None:
    behind = Detections(1.0, 1, 320, 240, blobs=(MovingBlob(1, "thing", (0.0, 0.0, -1.0), 0.1),))
    drawn = draw_detections(None, behind, None, lens=LENS)
    assert drawn.shape == (240, 320, 3)
    assert len(np.unique(drawn)) == 1
    far_out = draw_detections(None, Detections(1.0, 1, 320, 240), (1e12, -1e12), lens=LENS)
    assert np.array_equal(far_out, drawn)


def test_encoded_picture_is_a_jpeg_that_fits_a_message() -> None:
    noise = np.random.default_rng(1).integers(0, 256, (240, 320, 3), dtype=np.uint8)
    jpeg = encode(noise)
    assert len(jpeg) < MESSAGE_BYTES
    assert (
        present(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)).shape == noise.shape
    )


def test_depth_is_shown_in_colours_near_red_far_blue_unknown_dark() -> None:
    depth_m = np.full((480, 640), 1.0, np.float32)
    depth_m[:, :160], depth_m[:, 160:320], depth_m[:, 480:] = NEAREST_M / 2, np.nan, 2 * FARTHEST_M
    drawn = depth_image(depth_m)
    assert drawn.shape == (480, IMAGE_WIDTH_PX, 3)
    near, unknown, middle, far = (drawn[200, x].astype(int) for x in (80, 240, 400, 600))
    assert near[2] > near[0] + 60 and far[0] > far[2] - 5
    assert len(set(unknown.tolist())) == 1 and unknown[0] < 60
    assert not np.array_equal(middle, near) and not np.array_equal(middle, far)


def test_depth_is_drawn_on_only_where_it_is_wanted_and_there() -> None:
    picture, found = camera_picture()
    assert ground(found, depth=False) is picture
    reported = ground(found, depth=True)
    assert reported is not None and reported.shape == (480, IMAGE_WIDTH_PX, 3)
    assert (np.abs(reported.astype(int) - 90).max(axis=2) > 60)[450:].any()  # words at the foot
    assert not (np.abs(reported.astype(int) - 90).max(axis=2) > 60)[:430].any()
    deep = replace(found, depth_m=np.full((480, 640), 1.0, np.float32))
    shown = ground(deep, depth=True)
    assert shown is not None and len(np.unique(shown[:430].reshape(-1, 3), axis=0)) == 1
