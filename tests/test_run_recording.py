"""Recordings of runs: every tick is read back bit for bit, and reading errors have a reason."""

import base64
import json
from collections import Counter
from collections.abc import Iterable
from math import inf, nan
from pathlib import Path
from typing import Any

import cv2
import jsonschema
import numpy as np
import pytest
from desk import GAZE_JOINTS
from mcap.reader import make_reader
from msgspec.structs import replace
from recorded_run import (
    STARTED,
    Recorded,
    exact,
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
from gazerig.robot.control.tick import MeasuredJoints, TorqueEnabled
from gazerig.robot.model.commands import Ask, Jog, LookAt, Resume, Stop, Tune
from gazerig.robot.model.control_source import ControlState, TrackState
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import FramePicker, Recorder
from gazerig.robot.recording.run_info import RunInfo, as_text, read_text


def picked_s(rate_hz: float, times_s: Iterable[float]) -> list[float]:
    """Return the times of the frames that are picked of these."""
    picker, picture = FramePicker(rate_hz), np.zeros((2, 2, 3), np.uint8)
    return [
        at_s
        for number, at_s in enumerate(times_s, 1)
        if picker.is_due(Detections(at_s, number, 2, 2, image=picture))
    ]


def test_every_tick_comes_back_bit_for_bit(recorded: Recorded) -> None:
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
    assert engaged == TorqueEnabled(recorded.goals_rad)
    assert isinstance(measured, MeasuredJoints) and measured.t_s == 0.0
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


def test_other_programs_open_it(recorded: Recorded) -> None:
    with recorded.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert {s.name for s in summary.schemas.values()} >= {
            "foxglove.CompressedImage", "foxglove.FrameTransforms", "foxglove.JointStates",
            "foxglove.Log", "foxglove.SceneUpdate", "gazerig.Tick",
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
            jsonschema.validate(data, {"additionalProperties": False, **schemas[channel.topic]})
            if channel.topic == fmt.TICK:
                since_s = data["tick"]["t_s"] - recorded.ticks[0].t_s
                wall_s = STARTED.timestamp() + since_s
                assert message.log_time / 1e9 == pytest.approx(wall_s, abs=1e-6)
    assert set(seen) == set(fmt.TYPES) - {fmt.DESCRIPTION}
    pixels = cv2.imdecode(
        np.frombuffer(base64.b64decode(seen[fmt.FRAME]["data"]), np.uint8), cv2.IMREAD_COLOR
    )
    assert pixels is not None and pixels.shape[:2] == (40, 60)
    assert count[fmt.FRAME] == 6 and count[fmt.HEALTH] == 2
    assert seen[fmt.HEALTH]["tx_bytes"] > 0 and seen[fmt.HEALTH]["lost_ticks"] == 0
    states = {one["name"]: one["position"] for one in seen[fmt.JOINT_STATES]["joints"]}
    assert tuple(states) == GAZE_JOINTS
    frames = {one["child_frame_id"] for one in seen[fmt.TRANSFORMS]["transforms"]}
    assert frames == {"head", "left_eye", "right_eye"}


def sent_to_viewers(recorded: Recorded, topic: str) -> list[tuple[Tick, dict[str, Any]]]:
    """Return the messages of a topic, each with the tick that it is of."""
    start_ns = STARTED.timestamp() * 1e9
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


@pytest.mark.parametrize("odd", [0.25, nan, -inf])
def test_any_tick_comes_back(recorded: Recorded, odd: float, tmp_path: Path) -> None:
    track = TrackState(2, "nod", 0.5, 1.0, owns=("jaw",), who="somebody", since_s=3.5)
    lead = ControlState(4, True, False, odd, "", "pointer", "somebody", "look", ("neck_yaw",), 1.5)
    face = Face(3, (odd, 0.0, 1.0), (0.0,) * 3, ((1.0, 0.0, 0.0),) * 3, ((odd,) * 3,) * 8, 0.5)
    bodies = Bodies((3, 9), ("face", "hand"), *(np.full((2, 3), odd),) * 3, np.array([odd, 1.0]),
                    np.full((2, 6, 6), odd))  # fmt: skip
    ticks = [
        replace(
            recorded.ticks[-1],
            client_control=lead,
            tracks=(track,),
            percept=percept,
            detections=None,
        )
        for percept in (Percept(odd, bodies, (face,)), Percept(1.0, scene=4), None)
    ]
    recorder = Recorder(tmp_path / "odd.mcap", recorded.info, patient=True)
    recorder.open()
    for tick in ticks:
        recorder.record(tick)
    recorder.close()
    assert list(map(repr, RunRecording(tmp_path / "odd.mcap").ticks())) == list(map(repr, ticks))


@pytest.mark.parametrize(
    ("name", "nonsense"),
    [
        ("seed", -1),
        ("rate_hz", 1e9),
        ("mock", 1),
        ("started_utc", "yesterday"),
    ],
)
def test_a_beginning_that_no_run_has_is_refused(name: str, nonsense: object) -> None:
    ((key, text),) = as_text(info_for()).items()
    assert read_text({key: text}, RunInfo) == info_for()
    wrong = json.dumps({**json.loads(text), name: nonsense})
    with pytest.raises(ValueError, match=name):
        read_text({key: wrong}, RunInfo)


def test_a_late_frame_does_not_delay_those_that_follow() -> None:
    camera = (k / 100.0 for k in range(200) if not 40 <= k < 45 and not 100 <= k < 170)
    wanted = [0.0, 0.2, 0.45, 0.6, 0.8, 1.7, 1.9]  # after a long gap the count starts again
    assert picked_s(5.0, camera) == pytest.approx(wanted)
