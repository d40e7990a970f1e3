"""Elements of the page: shapes, words, traces, and the picture with its detections."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from html import escape
from typing import TypeVar, cast

import cv2
import numpy as np
import pytest
import viser
from desk import GAZE_JOINTS
from present import present
from shown_page import SNAPSHOT
from six_joints import ESTIMATED_RAD, SIX, TELLS_NOTHING, WISH_RAD, of_six

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import BusHealth, DetectedFace, Detections, MovingBlob
from gazerig.gaze.angles import rotation
from gazerig.gaze.types import PARTS, Salience
from gazerig.robot.app.rig_description import shape_of
from gazerig.robot.control.tick_text import health_text
from gazerig.robot.dashboard.feed.camera_overlay import (
    FARTHEST_M,
    IMAGE_WIDTH_PX,
    NEAREST_M,
    background,
    depth_image,
    draw_detections,
    encode,
)
from gazerig.robot.dashboard.feed.live_feed import News, OverlayChoices
from gazerig.robot.dashboard.feed.page_process import (
    MESSAGE_BYTES,
)
from gazerig.robot.dashboard.page_view import PageView
from gazerig.robot.dashboard.panels.attention_panel import reason_text, salience_bars, target_text
from gazerig.robot.dashboard.panels.event_timeline import STRIP_S, Timeline
from gazerig.robot.dashboard.panels.joint_charts import (
    GROUPS,
    MOST_POINTS,
    ChartGroup,
    JointCharts,
    JointSeries,
    chart_groups,
    mean_deg,
)
from gazerig.robot.dashboard.panels.panel import PanelView
from gazerig.robot.dashboard.panels.servo_health import (
    NO_FEEDBACK,
    alarms,
    group_reasons,
    guard_text,
    health_table,
    no_data_text,
    no_feedback_note,
    servo_table,
    strain_of_heat,
    strain_of_load,
    strain_of_voltage,
)
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.view.head_view import lid_edges
from gazerig.robot.dashboard.view.overlays import OverlayPanel, field_edge
from gazerig.robot.dashboard.view.people import fixated_part
from gazerig.robot.dashboard.view.scene_node import pitch_up, rotation_to
from gazerig.robot.dashboard.widgets.widget import Html, Widget
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.description.mesh import Mesh, cap, ellipsoid, lathe, lid, ring
from gazerig.robot.model.control_source import ControlSource
from gazerig.robot.model.frames import quaternion
from gazerig.robot.model.types import GAZE_JOINTS as EVERY_JOINT
from gazerig.robot.model.types import (
    CommandedPose,
    LoopFigures,
    SeenBlink,
    SeenCamera,
    SeenFace,
    SeenSaccade,
    ServoLimits,
    Servos,
    Snapshot,
    Trail,
)

LENS = Intrinsics(300.0, 300.0, 319.5, 239.5)
Terms = tuple[float, float, float, float, float]
AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def snapshot(
    t_s: float = 0.0, measured_rad: tuple[float, ...] = (0.0,) * 9, reasons: tuple[str, ...] = ()
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
        assert word in target_text(shot)
    for word in ("guard: limited", "3 lost", "too &lt;fast&gt; (joint 0, +5)"):
        assert word in health_table(shot)
    assert "too" not in health_table(snapshot()) and alarms(snapshot()) == ""


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
    assert reason_text(shot) == said and escape(said) in target_text(shot)
    led = replace(shot, control_source=ControlSource("person", "ann", "look at 1 0 0"))
    assert reason_text(led) == shot.why


def test_why_a_planner_chose_is_said_with_it() -> None:
    first = Salience(3, "hand", 0.0, 0.0, 0.0, 0.0, 0.8, 1.0, 0.8)
    shot = replace(
        snapshot(), saliences=(first,), behaviour="planned", plan="guard: hand 3 arrives in 0.20 s"
    )
    assert (
        reason_text(shot)
        == "because the behaviour guard asks for it (0.80): hand 3 arrives in 0.20 s"
    )
    assert "behaviour: planned" in target_text(shot) and "plan: guard" in target_text(shot)


def test_equal_reasons_are_said_once() -> None:
    assert group_reasons(("a: hot", "b: too fast", "c: too fast")) == "hot (a), too fast (b, +1)"
    assert group_reasons(()) == ""


def test_a_short_limit_moves_nothing_on_the_page() -> None:
    limited = snapshot(reasons=tuple(f"joint {n}: too fast" for n in range(9)))
    assert guard_text(limited).count("<div") == guard_text(snapshot()).count("<div")
    assert alarms(limited) == ""


def test_what_holds_says_why_joint_by_joint() -> None:
    shot = replace(snapshot(reasons=tuple(f"joint {n}: hot" for n in range(6))), level="hold")
    held = alarms(shot)
    assert "joint 3: hot" in held and "joint 4" not in held and "and 2 more" in held
    assert "joint 5: hot" in health_table(shot)


def test_what_stands_still_shouts() -> None:
    stopped = replace(snapshot(), stopped="somebody pressed <STOP>", level="torque_off")
    assert "somebody pressed &lt;STOP&gt;" in health_table(
        stopped
    ) and "guard: stopped" in health_table(stopped)
    assert alarms(stopped) == ""  # it is shown next to the stop button, once
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
    eyes = chart_groups(GAZE_JOINTS)["yaw"][0]
    assert mean_deg(angles_deg, eyes, GAZE_JOINTS).tolist() == [[0.0, 0.0, 3.0]] * 2
    named = {name for groups in GROUPS.values() for group in groups for name in group.joints}
    assert named == set(EVERY_JOINT)


def test_traces_are_of_the_joints_that_are_there() -> None:
    desk = {
        name: [len(group.joints) for group in groups]
        for name, groups in chart_groups(GAZE_JOINTS).items()
    }
    assert desk == {
        "yaw": [2, 1, 2], "pitch": [2, 1, 2], "left eye": [1, 1, 1], "right eye": [1, 1, 1],
        "neck": [1, 1, 1],
    }  # fmt: skip
    six = chart_groups(SIX)
    assert tuple(six) == ("yaw", "pitch", "left eye", "right eye")
    assert [group.joints for group in six["yaw"]] == [
        ("eyes_pan",),
        ("left_upper_lid", "right_upper_lid"),
        ("left_lower_lid", "right_lower_lid"),
    ]
    assert six["left eye"][0] == ChartGroup("both eyes, yaw, + left", ("eyes_pan",))
    assert six["right eye"][-1].joints == ("right_lower_lid",)
    assert chart_groups(()) == {}
    mixed = chart_groups(("left_eye_pan", "right_eye_pan", "eyes_tilt"))
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
    assert no_feedback_note(snapshot()) == ""
    said = "6 of 6 joints without feedback: shown where they should be"
    assert said in no_feedback_note(of_six(snapshot())) and said in health_table(of_six(snapshot()))
    assert "2 of 6 joints" in no_feedback_note(of_six(snapshot(), SIX[:2]))
    assert "anywhere" not in no_feedback_note(of_six(snapshot()))
    limp = of_six(snapshot())
    limp = replace(limp, servos=limp.servos._replace(torque=(True,) + (False,) * 5))
    assert "5 without torque: may be anywhere" in no_feedback_note(limp)
    limp = replace(limp, servos=limp.servos._replace(torque=(False,) * 6))
    assert "all without torque: may be anywhere" in no_feedback_note(limp)


def turn(q: tuple[float, float, float, float], v: tuple[float, float, float]) -> np.ndarray:
    """Turn a vector by a quaternion, by two products."""
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
        assert np.allclose(turn(rotation_to((x, y, z)), (1.0, 0.0, 0.0)), (x, y, z))
        assert turn(rotation_to((x, y, z)), (0.0, 1.0, 0.0))[2] == pytest.approx(0.0, abs=1e-12)
        R = rotation(tuple(dice.uniform(-3.0, 3.0, 3)))
        for axis in AHEAD:
            assert np.allclose(turn(quaternion(R), axis), np.array(R) @ axis, atol=1e-7)
    assert np.allclose(turn(pitch_up(0.3), (1.0, 0.0, 0.0)), (math.cos(0.3), 0.0, math.sin(0.3)))


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
    cylinder = lathe([(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)])
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
    assert background(found, depth=False) is picture
    reported = background(found, depth=True)
    assert reported is not None and reported.shape == (480, IMAGE_WIDTH_PX, 3)
    assert (np.abs(reported.astype(int) - 90).max(axis=2) > 60)[450:].any()  # words at the foot
    assert not (np.abs(reported.astype(int) - 90).max(axis=2) > 60)[:430].any()
    deep = replace(found, depth_m=np.full((480, 640), 1.0, np.float32))
    shown = background(deep, depth=True)
    assert shown is not None and len(np.unique(shown[:430].reshape(-1, 3), axis=0)) == 1


# --- The strip that fills as the rig runs


FACING = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def looking(t_s: float, name: str = "face 1: nose", part: str | None = "N") -> Snapshot:
    """A head at the origin that looks straight at a face a metre away."""
    face = SeenFace(1, (1.0, 0.0, 0.0), FACING, tuple((1.0, 0.0, 0.0) for _ in PARTS))
    return Snapshot(
        t_s=t_s, measured_rad=(0.0,) * 9, desired_rad=(0.0,) * 9, R_world_head=AHEAD,
        p_world_head_m=(0.0, 0.0, 0.0), p_world_eyes_m=((0.0, 0.03, 0.0), (0.0, -0.03, 0.0)),
        gaze_world=((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), lids=(0.8, 0.8),
        p_world_target_m=(1.0, 0.0, 0.0), target_name=name, why="", phase="fixate", level="ok",
        reasons=(), faces=(face,), bodies=(), rate_hz=200.0, health="",
        target_kind=name.split()[0], target_id=1, target_part=part, joints=GAZE_JOINTS,
    )  # fmt: skip


# --- the strip of the last half minute --------------------------------------------------


def test_stretches_join_end_to_end_and_are_forgotten() -> None:
    timeline = Timeline()
    for k in range(1000):
        t_s = 0.05 * k
        timeline.update(looking(t_s, "face 1: nose" if t_s < 40.0 else "hand <7>", None))
    (face, hand) = timeline.intervals("target")
    assert face == (0.0, pytest.approx(39.95), "face 1")
    assert hand == (pytest.approx(39.95), pytest.approx(49.95), "hand <7>")
    for k in range(1000, 1700):
        timeline.update(looking(0.05 * k, "hand <7>", None))
    assert [what for _, _, what in timeline.intervals("target")] == ["hand <7>"]


def test_strip_shows_targets_saccades_blinks_and_the_guard_and_runs_no_markup() -> None:
    timeline = Timeline()
    timeline.update(looking(0.0, "hand <7>", None))
    timeline.update(replace(looking(10.0, "hand <7>", None), worst="hold"))
    jump, shut = SeenSaccade(4.0, 0.05, 12.0), SeenBlink(6.0, 0.3)
    timeline.update(replace(looking(20.0), events=(jump, shut)))
    drawn = timeline.drawing()
    for said in ("hand &lt;7&gt;", "12.0 deg, 50 ms", "blink, 300 ms", "<title>hold</title>"):
        assert said in drawn
    assert "hand <7>" not in drawn
    assert all(0.0 <= float(x) <= 320.0 for x in re.findall(r"<rect x='([-\d.]+)'", drawn))


def test_what_is_older_than_the_strip_is_not_drawn() -> None:
    timeline = Timeline()
    timeline.update(replace(looking(0.0), events=(SeenBlink(0.0, 0.31),)))
    assert "310 ms" in timeline.drawing()
    timeline.update(looking(STRIP_S + 0.1))
    assert "310 ms" not in timeline.drawing()


def test_strip_says_when_somebody_stopped_the_rig_and_starts_anew_with_the_clock() -> None:
    timeline = Timeline()
    timeline.update(looking(50.0))
    timeline.update(replace(looking(51.0), stopped="space bar"))
    assert [what for _, _, what in timeline.intervals("guard")] == ["ok", "stopped"]
    timeline.update(looking(0.0))
    assert timeline.intervals("guard") == ((0.0, 0.0, "ok"),)


# --- the eyes' field --------------------------------------------------------------------


def test_the_edge_of_the_field_lies_at_its_limits() -> None:
    edge = field_edge((100.0, 60.0, 60.0, 75.0), left=True)
    away = np.degrees(np.arccos(edge[:, 0] / np.linalg.norm(edge, axis=1)))
    left, above, right, below = (away[i] for i in (0, 18, 36, 54))
    assert (left, above, right, below) == pytest.approx((100.0, 60.0, 60.0, 75.0))
    mirrored = field_edge((100.0, 60.0, 60.0, 75.0), left=False)
    assert np.allclose(mirrored[[0, 18, 36]], edge[[36, 18, 0]] * (1.0, -1.0, 1.0))


# --- The health of servos, loop and picture in words and colours, and the reason of the gaze


LIMITS = ServoLimits((55.0,) * 9, (65.0,) * 9, (3.8,) * 9, (6.7,) * 9, (0.5,) * 9)
WELL = Servos(
    (30.0,) * 9, (5.0,) * 9, (0.1,) * 9, (True,) * 9, ("",) * 9, (0.0,) * 9, (0,) * 9, LIMITS
)
REST = (0.0,) * 9
T = TypeVar("T")


def healthy(t_s: float = 1.0) -> Snapshot:
    eyes = ((0.03, 0.031, 0.14), (0.03, -0.031, 0.14))
    sight = ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    return Snapshot(
        t_s=t_s, measured_rad=REST, desired_rad=REST, R_world_head=AHEAD,
        p_world_head_m=(0.03, 0.0, 0.14), p_world_eyes_m=eyes, gaze_world=sight, lids=(0.8, 0.8),
        p_world_target_m=(1.0, 0.0, 0.14), target_name="thing <4>", why="slide <0.4>",
        phase="pursue", level="ok", reasons=(), faces=(), bodies=(), rate_hz=200.0,
        health="bus ok", behaviour="wait", servos=WELL,
        timing=LoopFigures(200.0, 0.04, 0.21, 0.9, 0, 3, 5.0), frame_age_s=0.06,
        commanded_pose=CommandedPose(AHEAD, (0.03, 0.0, 0.14), eyes, sight, (0.8, 0.8)),
        camera=SeenCamera(AHEAD, (0.05, 0.0, 0.18), 1.2, 1.6), field_deg=(100.0, 60.0, 60.0, 75.0),
        trail=(Trail(t_s, REST, REST, REST),),
        events=(SeenSaccade(0.5, 0.05, 5.0), SeenBlink(0.2, 0.3)),
        joints=GAZE_JOINTS,
    )  # fmt: skip


def put(column: tuple[float | None, ...], i: int, value: float | None) -> tuple[float | None, ...]:
    return (*column[:i], value, *column[i + 1 :])


@pytest.mark.parametrize(
    ("celsius", "strain"), [(54.9, ""), (55.0, "near"), (65.0, "over"), (None, "")]
)
def test_heat_is_told_by_what_the_guard_does(celsius: float | None, strain: str) -> None:
    assert strain_of_heat(WELL._replace(temperature_c=put(REST, 2, celsius)), 2) == strain


@pytest.mark.parametrize(("load", "strain"), [(0.5, ""), (-0.51, "near"), (-0.95, "over")])
def test_load_is_told_by_its_size(load: float, strain: str) -> None:
    assert strain_of_load(WELL._replace(load=(load,) * 9), 0) == strain


@pytest.mark.parametrize(("volts", "strain"), [(3.7, "near"), (3.8, ""), (6.8, "near"), (None, "")])
def test_voltage_is_told_by_both_ends(volts: float | None, strain: str) -> None:
    assert strain_of_voltage(WELL._replace(voltage_v=put(REST, 1, volts)), 1) == strain


def test_without_limits_nothing_is_coloured() -> None:
    hot = WELL._replace(temperature_c=(90.0,) * 9, limits=None)
    assert strain_of_heat(hot, 0) == ""
    assert strained(servo_table(hot, GAZE_JOINTS)) == 0


def strained(html: str) -> int:
    """Number of coloured figures."""
    return html.count("<td class='near'>") + html.count("<td class='over'>")


def test_a_healthy_rig_has_no_alarm_and_every_joint_a_row() -> None:
    table = servo_table(WELL, GAZE_JOINTS)
    assert table.count("<tr") == 10
    assert strained(table) == 0 and "class='fault'" not in table
    assert "neck roll" in table and "+10 %" in table


def test_faults_and_silence_are_said_beside_the_joint() -> None:
    fault = ("", "overload <1>") + ("",) * 7
    table = servo_table(
        WELL._replace(fault=fault, age_s=(0.0, 0.0, 1.25) + (0.0,) * 6), GAZE_JOINTS
    )
    assert "left eye tilt<div class='fault'>" in table and "overload &lt;1&gt;" in table
    assert "right eye pan<div class='fault'>" in table and "silent for 1.2 s" in table
    assert "torque off" in servo_table(WELL._replace(torque=(False,) * 9), GAZE_JOINTS)
    assert "no data of the servos" in servo_table(Servos(), ())


def test_what_was_not_measured_is_a_dash_and_no_zero() -> None:
    unread = WELL._replace(temperature_c=(None,) * 9, voltage_v=(None,) * 9, unanswered=())
    assert servo_table(unread, GAZE_JOINTS).count(">-</td>") == 27


def test_a_servo_that_tells_nothing_has_no_figures() -> None:
    table = servo_table(TELLS_NOTHING, SIX, SIX)
    assert table.count(f">{NO_FEEDBACK}</td>") == 6 and "not noticed" in table
    assert " %" not in table and ">-</td>" not in table  # a load of 0 is none that was measured
    assert "eyes pan" in table and "neck" not in table
    assert NO_FEEDBACK not in servo_table(WELL, GAZE_JOINTS)


def test_only_the_joints_nobody_measures_are_without_figures() -> None:
    table = servo_table(WELL, GAZE_JOINTS, ("left_upper_lid",))
    assert table.count(f">{NO_FEEDBACK}</td>") == 1 and table.count("+10 %") == 8
    silent = servo_table(WELL._replace(age_s=(1.25,) * 9), GAZE_JOINTS, GAZE_JOINTS)
    assert silent.count("silent for 1.2 s") == 9  # a lost board is reported as well


def test_loop_figures_are_told_and_coloured_when_late() -> None:
    said = health_table(healthy())
    for words in ("200.0 Hz", "0.04 ms", "0.21 ms", "0.90 ms", "3 slots overrun", "60 ms</b> old"):
        assert words in said
    assert strained(said) == 0
    late = replace(healthy(), timing=LoopFigures(200.0, 0.1, 2.0, 4.0, 2, 2, 5.0))
    assert strained(health_table(late)) == 2
    assert "no frame yet" in health_table(replace(healthy(), frame_age_s=None))


def test_the_winner_comes_first_term_by_term_and_runs_no_markup() -> None:
    tugs = (
        Salience(4, "thing", 0.41, 0.0, 0.0, 0.0, 0.0, 1.0, 0.41),
        Salience(1, "<b>", 0.02, 0.0, 0.0, 0.0, 0.5, 0.6, 0.3),
    )
    shot = replace(healthy(), saliences=tugs, character="shy", conversation="listen")
    said = salience_bars(shot)
    assert said.index("thing 4") < said.index("&lt;b&gt; 1")
    assert "translation 0.41" in said and "translation 0.02 rule 0.50" in said
    assert "looming 0.00</div>" not in said
    assert "0.60 &times;&ensp;0.30" in said
    named = target_text(shot)
    for words in ("thing &lt;4&gt;", "because it moves", "behaviour: wait", "character: shy",
                  "conversation: listen"):  # fmt: skip
        assert words in named
    assert "wanders" in salience_bars(healthy()) and "slide &lt;0.4&gt;" in target_text(healthy())


def as_it_is(shot: Snapshot) -> Snapshot:
    return shot


# --- on a page --------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server():
    made = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield made
    made.stop()


def watched() -> tuple[Widgets, PanelView]:
    """Panels that a browser shows."""
    widgets = Widgets()
    panel = PanelView(widgets)
    widgets.join("a browser", lambda: None)
    return widgets, panel


def words_of(widgets: Widgets) -> str:
    """Everything that is written in the panels, in whatever drawer."""
    every = widgets._widgets.values()
    titles = [str(one.props.get("title", "")) for one in every if type(one) is Widget]
    return " ".join([one.content for one in every if isinstance(one, Html)] + titles)


@pytest.mark.parametrize(("made", "last"), [(as_it_is, "neck roll"), (of_six, "right lower lid")])
def test_panel_takes_snapshots_and_fills_its_tabs(
    made: Callable[[Snapshot], Snapshot], last: str
) -> None:
    widgets, panel = watched()
    shots = tuple(made(healthy(0.04 * k)) for k in range(51))
    for shot in shots:
        panel.update((shot,))
        panel.show()
    said = words_of(widgets)
    for words in (
        "thing &lt;4&gt;", "49 saccades", last, "the last 30 seconds", "bus ok",
    ):  # fmt: skip
        assert words in said
    charts = panel.traces.charts
    assert len(charts) == 3
    assert all(len(cast("list[float]", chart.props["x"])) > 40 for chart in charts)
    panel.update((made(healthy(0.0)),))
    for _ in range(26):
        panel.show()
    again = words_of(widgets)
    assert "49 saccades" not in again and "1 saccades" in again
    panel.silence.content = no_data_text()
    assert "the rig has sent nothing" in panel.silence.content
    panel.update((made(healthy(0.1)),))
    assert panel.silence.content == ""


def test_what_nobody_measured_is_drawn_and_named_otherwise() -> None:
    _, panel = watched()
    view = panel.traces

    def shown(t_s: float, estimated: tuple[str, ...]) -> list[bool]:
        shot = of_six(healthy(t_s), estimated)
        panel.update((shot,))
        panel.draw_all()
        panel.show()
        named = [chart.names()[2] == "estimated, not measured" for chart in view.charts]
        lines = [cast("list[list[str]]", chart.props["lines"]) for chart in view.charts]
        assert named == [line[2][1] == "estimated" for line in lines]
        assert named == ["no feedback" in chart.title for chart in view.charts]
        return named

    assert shown(1.0, SIX) == [True, True, True]
    assert "> measured<" not in view.key.content and "estimated" in view.key.content
    assert "no measurements" in panel.estimation_note.content
    before = view.charts
    assert shown(1.1, SIX) == [True, True, True]
    assert view.charts is before  # what stays as it is is not made again
    assert shown(1.2, ("left_lower_lid",)) == [False, False, True]
    assert "> measured<" in view.key.content and "estimated" in view.key.content
    assert panel.estimation_note.content == ""
    assert shown(1.3, ()) == [False, False, False]
    assert "estimated" not in view.key.content


class Nobody:
    """A stop button and a receiver that accept all messages."""

    def tell(self, state: Mapping[str, object]) -> None:
        self.reported = dict(state)


def test_who_comes_late_sees_all_panels_as_they_are_now(server: viser.ViserServer) -> None:
    button = Nobody()
    widgets = Widgets()
    view = PageView(server, widgets, Outbox(None), button.tell)  # type: ignore[arg-type]
    view.show(News((replace(healthy(1.0), target_name="the first"),), None, ended=False))
    for k in range(20):  # no one looks
        view.show(News((healthy(1.1 + 0.1 * k),), None, ended=False))
    last = replace(of_six(healthy(4.0)), target_name="the last", stopped="a test")
    view.show(News((last,), None, ended=False))
    known = {"stopped": "a test", "silent": False, "without_feedback": 6}
    assert button.reported.items() >= known.items()
    panel = view._panel
    widgets.join("a browser", lambda: None)
    view.show(News((), None, ended=False))
    assert "the last" in panel.winner.content and NO_FEEDBACK in panel.health.content
    assert len(panel.traces.charts) == 3 and "no feedback" in panel.traces.charts[0].title


def test_the_menu_of_traces_is_that_of_the_rig() -> None:
    traces = JointSeries()
    view = JointCharts(Widgets().panel("watch"))
    traces.add(healthy(1.0))
    view.show(traces)
    assert view.what.options == ("yaw", "pitch", "left eye", "right eye", "neck")
    view.what.value = "neck"
    view.show(traces)
    assert "neck, roll" in view.charts[-1].title
    traces.add(of_six(healthy(2.0)))
    view.show(traces)
    assert view.what.options == ("yaw", "pitch", "left eye", "right eye")
    assert view.what.value == "yaw" and "lower lids" in view.charts[-1].title
    view.what.value = "left eye"
    view.show(traces)
    titles = " ".join(chart.title for chart in view.charts)
    assert len(view.charts) == 4 and titles.count("both eyes") == 2
    assert "left upper lid" in titles and "left lower lid" in titles


def test_layers_are_seen_where_they_are_wanted(server: viser.ViserServer) -> None:
    view = OverlayPanel(server.scene)

    def seen() -> set[str]:
        nodes = {"ghost": "/ghost", "camera": "/camera", "eyes": "/field_left"}
        handles = server.scene._handle_from_node_name
        return {name for name, node in nodes.items() if node in handles and handles[node].visible}

    edges = lid_edges(shape_of(load_rig("desk")))
    view.show(healthy(), OverlayChoices(ghost=True, camera=True, eyes=True), edges)
    assert seen() == {"ghost", "camera", "eyes"}
    view.show(healthy(), OverlayChoices(ghost=False, camera=True, eyes=False), edges)
    assert seen() == {"camera"}
    view.show(
        replace(healthy(), commanded_pose=None, camera=None, field_deg=None),
        OverlayChoices(eyes=True),
        edges,
    )
    assert seen() == set()


def test_bus_faults_are_told_in_plain_words() -> None:
    errors = {"timeout": 74, "rearmed": 1, "late computer": 0, "pulse": 2}
    said = health_text(BusHealth(0, 0, errors))
    assert said == "bus: pulse 2 times, torque switched on again 1 time, no answer 74 times"
    assert health_text(BusHealth(0, 0, {})) == "bus ok"


def test_the_age_of_the_frame_is_said_once() -> None:
    shot = replace(SNAPSHOT, frame_age_s=0.073, perception="frame 73 ms old | face 1 at 0.94 m")
    said = health_table(shot)
    assert said.count("73 ms") == 1 and "<div>face 1 at 0.94 m</div>" in said
    assert "<div>no face</div>" in health_table(replace(shot, perception="no face"))
    blind = health_table(replace(shot, frame_age_s=None, perception="no frame yet"))
    assert blind.count("no frame yet") == 1
