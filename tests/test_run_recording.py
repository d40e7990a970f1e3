"""Recordings of runs: every tick is read back bit for bit, and reading errors have a reason."""

import base64
import json
from collections import Counter
from collections.abc import Iterable
from datetime import datetime
from math import inf, nan
from pathlib import Path
from typing import Any

import cv2
import jsonschema
import msgspec
import numpy as np
import pytest
from desk import GAZE_JOINTS
from mcap.reader import make_reader
from recorded_run import (
    STARTED,
    Recorded,
    exact,
    handed_over,
    info_for,
)

from gazerig.config.load import load
from gazerig.config.save_text import params_text
from gazerig.config.schema import Rig, load_rig, load_walk
from gazerig.drivers.types import Detections
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.scanpath.scanpath import Walk
from gazerig.gaze.types import Bodies, Face, Percept
from gazerig.robot.control.loop import Tick
from gazerig.robot.model.commands import Ask, Jog, LookAt, Resume, Stop, Tune
from gazerig.robot.model.control_source import ControlState, TrackState
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import tick_record as moments
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import FramePicker
from gazerig.robot.recording.run_info import (
    RunEnd,
    RunInfo,
    as_text,
    read_run_end,
    read_run_info,
)
from gazerig.robot.recording.viewer_messages import orientation


def picked_s(rate_hz: float, times_s: Iterable[float]) -> list[float]:
    """Return the times of the frames that are picked of these."""
    picker, picture = FramePicker(rate_hz), np.zeros((2, 2, 3), np.uint8)
    return [
        at_s
        for number, at_s in enumerate(times_s, 1)
        if picker.is_due(Detections(at_s, number, 2, 2, image=picture))
    ]


def test_every_tick_comes_back_bit_for_bit(recorded: Recorded) -> None:
    # A new field must be recorded too: add it to TickRow, as_json and from_json.
    # Ticks of parking are never recorded.
    assert Tick._fields == (
        "t_s", "joints", "pose", "detections", "percept", "target", "gaze", "desired_rad",
        "guard_result", "events", "commands", "stopped", "controlled_by", "client_control",
            "tracks", "parking", "conversation",
    )  # fmt: skip
    back = list(RunRecording(recorded.path).ticks())
    assert len(back) == len(recorded.ticks) == 299
    for was, now in zip(recorded.ticks, back, strict=True):
        assert exact(now) == exact(was)
        assert now.detections is None
        assert type(now.joints.missing) is tuple and type(now.guard_result.reasons) is tuple
    assert {type(order) for tick in back for order in tick.commands} == {
        Ask, LookAt, Jog, Stop, Resume, Tune
    }  # fmt: skip
    assert any(tick.stopped for tick in back)


def test_what_entered_the_run_beside_the_ticks_is_kept(recorded: Recorded) -> None:
    kept = list(RunRecording(recorded.path).moments())
    engaged, measured = kept[0].before
    assert engaged == moments.TorqueEnabled(recorded.goals_rad)
    assert isinstance(measured, moments.MeasuredJoints) and measured.t_s == 0.0
    assert measured.joints.position_rad[6] == pytest.approx(-0.21, abs=0.01)
    times = [0.0, *(tick.t_s for tick in recorded.ticks)]
    assert [m.dt_s for m in kept] == [b - a for a, b in zip(times, times[1:], strict=False)]
    # The resumption has new goals.
    more = {n: [type(one).__name__ for one in m.before] for n, m in enumerate(kept) if m.before}
    assert more == {0: ["TorqueEnabled", "MeasuredJoints"], 141: ["TorqueEnabled"]}


def test_info_and_end(recorded: Recorded) -> None:
    recording = RunRecording(recorded.path)
    assert recording.info == recorded.info
    assert recording.whole and recording.note == ""
    assert recording.duration_s == pytest.approx(1.49, abs=1e-6)
    assert recording.end.stopped_by == "seconds" and recording.end.ran_s == 1.5
    assert len(recording.end.tx_sha256) == 64
    assert recorded.said.startswith("299 ticks, 6 frames (0.")
    assert recorded.said.endswith(f"recorded in {recorded.path}")
    assert recording.info.versions["numpy"] == np.__version__


def test_the_configuration_in_it_is_the_one_that_ran(recorded: Recorded, tmp_path: Path) -> None:
    file = tmp_path / "whole.yaml"
    file.write_text(RunRecording(recorded.path).info.config_yaml)
    assert repr(load(file, Rig)) == repr(load_rig("desk"))
    file.write_text(RunRecording(recorded.path).info.walk_yaml)
    walk = load(file, Walk)
    assert repr(walk) == repr(load_walk(load_rig("desk").gaze.scanpath.transition_matrix))
    assert walk.start == "N"
    character = load_rig("desk", "shy")
    file.write_text(params_text(character))
    assert repr(load(file, Rig)) == repr(character)


def test_pictures_come_at_their_rate_with_their_exposure(recorded: Recorded) -> None:
    found = list(RunRecording(recorded.path).frames())
    times = [at_s for at_s, _ in found]
    assert times[0] == recorded.ticks[0].t_s - 0.03
    assert np.diff(times) == pytest.approx([0.25] * 5, abs=0.051)
    pixels = cv2.imdecode(np.frombuffer(found[1][1], np.uint8), cv2.IMREAD_COLOR)
    assert pixels is not None and pixels.shape[:2] == (40, 60)


def test_health_comes_once_a_second(recorded: Recorded) -> None:
    found = list(RunRecording(recorded.path).health())
    assert len(found) == 2
    assert found[1]["tx_bytes"] > found[0]["tx_bytes"] > 0
    assert len(found[1]["temperature_c"]) == len(GAZE_JOINTS) and found[1]["lost_ticks"] == 0
    for at_s, one in zip((0.0, 1.0), found, strict=True):
        tick = next(t for t in recorded.ticks if t.t_s - recorded.ticks[0].t_s > at_s - 1e-6)
        assert one["load"] == list(tick.joints.load)
    assert found[0]["load"] != found[1]["load"]


def test_other_programs_open_it(recorded: Recorded) -> None:
    with recorded.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert {s.name for s in summary.schemas.values()} >= {
            "foxglove.CompressedImage", "foxglove.FrameTransforms", "foxglove.JointStates",
            "foxglove.Log", "foxglove.SceneUpdate", "gazerig.Tick", "gazerig.Percept",
        }  # fmt: skip
        assert all(s.encoding == "jsonschema" for s in summary.schemas.values())
        assert all(chunk.compression == "zstd" for chunk in summary.chunk_indexes)
        schemas = {c.topic: json.loads(summary.schemas[c.schema_id].data)
                   for c in summary.channels.values()}  # fmt: skip
        seen: dict[str, Any] = {}
        count: Counter[str] = Counter()
        for _, channel, message in reader.iter_messages():
            assert channel.message_encoding == "json"
            count[channel.topic] += 1
            assert message.sequence == count[channel.topic]  # a missing one is detectable
            data = seen[channel.topic] = json.loads(message.data)
            free = {"additionalProperties": channel.topic == fmt.ORDER}  # its fields vary
            jsonschema.validate(data, {**free, **schemas[channel.topic]})
            if channel.topic == fmt.TICK:
                since_s = data["t_s"] - recorded.ticks[0].t_s
                wall_s = datetime.fromisoformat(STARTED).timestamp() + since_s
                assert message.log_time / 1e9 == pytest.approx(wall_s, abs=1e-6)
    assert set(seen) == set(fmt.SCHEMAS) - {fmt.DESCRIPTION}
    assert base64.b64decode(seen[fmt.FRAME]["data"])[:2] == b"\xff\xd8"
    states = {one["name"]: one["position"] for one in seen[fmt.JOINT_STATES]["joints"]}
    assert tuple(states) == GAZE_JOINTS
    frames = {one["child_frame_id"] for one in seen[fmt.TRANSFORMS]["transforms"]}
    assert frames == {"head", "left_eye", "right_eye"}


def sent_to_viewers(recorded: Recorded, topic: str) -> list[tuple[Tick, dict[str, Any]]]:
    """Return the messages of a topic, each with the tick that it is of."""
    start_ns = datetime.fromisoformat(STARTED).timestamp() * 1e9
    of = {round(1e3 * (t.t_s - recorded.ticks[0].t_s)): t for t in recorded.ticks}
    with recorded.path.open("rb") as file:
        return [
            (of[round((message.log_time - start_ns) / 1e6)], json.loads(message.data))
            for _, _, message in make_reader(file).iter_messages([topic])
        ]


def vector(of: dict[str, float]) -> list[float]:
    return [of[axis] for axis in "xyz"]


def test_a_viewer_sees_head_and_eyes_as_they_stand_in_space(recorded: Recorded) -> None:
    from scipy.spatial.transform import Rotation

    turned = 0.0
    for tick, data in sent_to_viewers(recorded, fmt.TRANSFORMS):
        frames = {one["child_frame_id"]: one for one in data["transforms"]}
        ahead = {}
        for name, one in frames.items():
            assert one["parent_frame_id"] == "world"
            quaternion = [one["rotation"][axis] for axis in "xyzw"]
            ahead[name] = Rotation.from_quat(quaternion).apply((1.0, 0.0, 0.0))
        pose = tick.pose
        assert ahead["head"] == pytest.approx(np.array(pose.R_world_head)[:, 0])
        for left, name in ((True, "left_eye"), (False, "right_eye")):
            assert ahead[name] == pytest.approx(line_of_sight(pose, left))
        assert vector(frames["head"]["translation"]) == pytest.approx(pose.p_world_head_m)
        places = pose.p_world_eye_left_m, pose.p_world_eye_right_m
        for name, place in zip(("left_eye", "right_eye"), places, strict=True):
            assert vector(frames[name]["translation"]) == pytest.approx(place)
        turned = max(turned, abs(ahead["left_eye"] @ ahead["head"] - 1.0), abs(pose.head_rad[0]))
    assert turned > 0.05  # the frames differ


def test_leads_and_tracks_come_back(recorded: Recorded) -> None:
    track = TrackState(2, "nod", 0.5, 1.0, owns=("jaw",), who="somebody", since_s=3.5)
    lead = ControlState(4, True, False, 0.01, "", "pointer", "somebody", "look", ("neck_yaw",), 1.5)
    tick = recorded.ticks[-1]._replace(client_control=lead, tracks=(track,), percept=None)
    data = msgspec.json.decode(msgspec.json.encode(moments.as_json(handed_over(tick)[1])))
    back = moments.from_json(data, {}).tick
    assert (back.client_control, back.tracks) == (lead, (track,))


@pytest.mark.parametrize("odd", [0.25, nan, -inf])
def test_any_percept_comes_back(recorded: Recorded, odd: float) -> None:
    face = Face(3, (odd, 0.0, 1.0), (0.0,) * 3, ((1.0, 0.0, 0.0),) * 3, ((odd,) * 3,) * 8, 0.5)
    bodies = Bodies((3, 9), ("face", "hand"), *(np.full((2, 3), odd),) * 3, np.array([odd, 1.0]),
                    np.full((2, 6, 6), odd))  # fmt: skip
    for percept in (Percept(odd, bodies, (face,)), Percept(1.0, scene=4)):
        (handed,), row = handed_over(recorded.ticks[-1]._replace(percept=percept))
        data = msgspec.json.decode(msgspec.json.encode(moments.percept_as_json(handed)))
        number, back = moments.percept_from_json(data)
        assert number == row[2] == 1 and repr(back) == repr(percept)
        assert back.bodies.p_world_m.shape == percept.bodies.p_world_m.shape


def test_info_of_another_version_is_read_as_far_as_it_is_known() -> None:
    info = RunInfo("desk", "robot", "a: 1\n", 0, 200.0, STARTED)
    assert read_run_info({**as_text(info), "what_comes_later": "5"}) == info
    assert read_run_end({"lost": "3"}) == RunEnd(lost=3)
    with pytest.raises(ValueError, match="config_yaml"):
        read_run_info({"rig": '"desk"'})


@pytest.mark.parametrize(
    ("name", "nonsense"),
    [
        *(("seed", value) for value in ("-1", "1.5", "true", "null")),
        *(("rate_hz", value) for value in ("0", "1e9", "NaN", '"200"')),
        *(("pictures_hz", value) for value in ("-1", "Infinity")), ("mock", "1"), ("fast", '"no"'),
        ("rig", "5"), ("scene", "[]"), ("versions", "[]"), ("started_utc", '"yesterday"'),
        ("eyes", "{"),
    ],
)  # fmt: skip
def test_a_beginning_that_no_run_has_is_refused(name: str, nonsense: str) -> None:
    text = as_text(info_for())
    assert read_run_info(text).seed == 7
    with pytest.raises(ValueError, match="."):
        read_run_info({**text, name: nonsense})


def test_a_rotation_as_a_quaternion() -> None:
    turned = orientation(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    assert turned == pytest.approx({"x": 0.0, "y": 0.0, "z": 0.5**0.5, "w": 0.5**0.5})


def test_a_late_frame_does_not_delay_those_that_follow() -> None:
    camera = (k / 100.0 for k in range(200) if not 40 <= k < 45 and not 100 <= k < 170)
    wanted = [0.0, 0.2, 0.45, 0.6, 0.8, 1.7, 1.9]  # after a long gap the count starts again
    assert picked_s(5.0, camera) == pytest.approx(wanted)
