"""Recordings of runs: every tick comes back bit for bit, and what cannot be read says why."""

import base64
import json
import resource
from collections.abc import Callable, Iterator
from datetime import datetime
from math import inf, nan
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import orjson
import pytest
from desk import GAZE_JOINTS
from mcap.reader import make_reader
from mcap.writer import Writer
from typer.testing import CliRunner

from gazerig.config.load import load
from gazerig.config.schema import Rig, load_rig
from gazerig.config.text import rig_text, walk_text
from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import Detections
from gazerig.gaze.scanpath import Walk
from gazerig.gaze.types import Bodies, Face, Percept
from gazerig.robot.app.assemble import RIGS_OWN, Assembly, Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.cli.main import app
from gazerig.robot.cli.terminal import BAD_INPUT, FAULT, _writer
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.dashboard.camera_overlay import encode
from gazerig.robot.model import stop_latch
from gazerig.robot.model.commands import Ask, Command, Jog, LookAt, Resume, Stop, Tune
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import tick_record as moments
from gazerig.robot.recording.frame_encoder import FrameEncoder
from gazerig.robot.recording.read import BadRecording, RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunEnd, RunInfo, as_text, end_of, info_of, versions
from gazerig.robot.recording.viewer_messages import quaternion
from gazerig.robot.recording.writer_process import PIECE_BYTES

STARTED = "2026-01-31T23:59:59.250000+00:00"


def assembly(recorder: Recorder | None = None) -> Assembly:
    options = RunOptions(mock=True, fast=True, seed=7, scene="visitor")
    recorded = Substitutes(body=recorder.recorded) if recorder is not None else RIGS_OWN
    return assemble(load_rig("desk"), options, recorded)


def info_for(pictures_hz: float = 4.0) -> RunInfo:
    rig = load_rig("desk")
    return RunInfo(
        rig="desk",
        profile=rig.profile,
        config_yaml=rig_text(rig),
        walk_yaml=walk_text(rig.gaze.scanpath.transition_matrix),
        seed=7,
        rate_hz=rig.loop.rate_hz,
        started_utc=STARTED,
        scene="visitor",
        eyes="scene visitor",
        mock=True,
        fast=True,
        pictures_hz=pictures_hz,
        versions=versions(),
    )


class Recorded(NamedTuple):
    path: Path
    ticks: list[Tick]
    info: RunInfo
    said: str
    goals_rad: tuple[float, ...]


def record(
    path: Path, seconds: float, at: Callable[[int, Assembly], None] = lambda n, made: None
) -> Recorded:
    """Record a simulated run with a drawn picture in every tenth tick."""
    info = info_for()
    recorder = Recorder(path, info, patient=True)
    recorder.open()
    made = assembly(recorder)
    seen: list[Tick] = []

    def watch(tick: Tick) -> None:
        at(len(seen), made)
        recorder.record(with_picture(tick, len(seen)))
        seen.append(tick)

    made.robot.start(made.clock)
    goals = made.robot._executor.commanded_rad
    stop = recorder.timed(lambda s: "seconds" if s >= seconds - 1e-9 else None)
    count = run(made.robot, made.clock, made.loop, stop, watch)
    made.robot.stop()
    said = recorder.close(count.stopped_by, made.sent_digest())
    made.close()
    assert recorder.events() == () and recorder.lost == 0
    return Recorded(path, seen, info, said, goals)


def with_picture(tick: Tick, number: int) -> Tick:
    if number % 10:
        return tick
    picture = np.full((40, 60, 3), number % 250, np.uint8)
    return tick._replace(detections=Detections(tick.t_s - 0.03, number + 1, 60, 40, image=picture))


def ordered(number: int, made: Assembly) -> None:
    """Ask for one of everything."""
    orders: dict[int, Command] = {
        50: Ask("behaviour", "guard"),
        60: LookAt((1.0, 0.2, 0.3)),
        80: Jog((("neck_yaw", 0.1),)),
        100: Jog(()),
        110: Stop("look at this"),
        140: Resume(),
        160: Tune((("gaze.saccade.profile", "min_jerk"), ("loop.park_s", 3.5))),
    }
    if number in orders:
        made.robot.command(orders[number])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stop_latch, "MIN_HOLD_S", 0.1)  # a shorter run
        return record(tmp_path_factory.mktemp("runs") / "run.mcap", 1.5, ordered)


def exact(tick: Tick) -> str:
    """Write a tick so that two are the same only where every bit is; arrays apart."""
    return repr(tick._replace(detections=None, percept=None))


def test_every_tick_comes_back_bit_for_bit(recorded: Recorded) -> None:
    # A new field must be recorded too: add it to moment.flat, as_json and from_json.
    assert Tick._fields == (
        "t_s", "joints", "pose", "detections", "percept", "target", "gaze", "desired_rad",
        "guard_result", "events", "commands", "stopped", "led",
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


def test_percepts_come_back_and_stay_the_same_object_between_pictures(recorded: Recorded) -> None:
    back = list(RunRecording(recorded.path).ticks())
    assert any(tick.percept is not None and tick.percept.faces for tick in back)
    pairs = list(zip(recorded.ticks, back, strict=True))
    for (was, now), (was_next, now_next) in zip(pairs, pairs[1:], strict=False):
        assert (was.percept is was_next.percept) == (now.percept is now_next.percept)
        assert (was.percept is None) == (now.percept is None)
        if was.percept is not None and now.percept is not None:
            assert repr(now.percept.faces) == repr(was.percept.faces)
            for name in Bodies.__slots__:
                same(getattr(now.percept.bodies, name), getattr(was.percept.bodies, name))


def same(now: object, was: object) -> None:
    if isinstance(was, np.ndarray):
        assert isinstance(now, np.ndarray) and now.dtype == was.dtype and now.shape == was.shape
        assert now.tobytes() == was.tobytes()
    else:
        assert now == was


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
    assert load(file, Walk).start == "FR"
    character = load_rig("desk", "shy")
    file.write_text(rig_text(character))
    assert repr(load(file, Rig)) == repr(character)


def test_pictures_come_at_their_rate_with_their_exposure(recorded: Recorded) -> None:
    found = list(RunRecording(recorded.path).frames())
    times = [at_s for at_s, _ in found]
    assert times[0] == recorded.ticks[0].t_s - 0.03
    assert np.diff(times) == pytest.approx([0.25] * 5, abs=0.051)
    pixels = cv2.imdecode(np.frombuffer(found[1][1], np.uint8), cv2.IMREAD_COLOR)
    assert pixels is not None and pixels.shape[:2] == (40, 60)


def test_no_pictures_where_none_are_asked_for() -> None:
    made = assembly()
    encoder = FrameEncoder(0.0, at_once=True)
    made.robot.start(made.clock)
    encoder.look(with_picture(made.robot.tick(0.005, 0.005), 0))
    assert list(encoder.taken()) == []


def test_a_picture_larger_than_a_message_arrives_whole(tmp_path: Path) -> None:
    made = assembly()
    path = tmp_path / "large.mcap"
    recorder = Recorder(path, info_for(), patient=True)
    recorder.open()
    made.robot.start(made.clock)
    noise = np.random.default_rng(0).integers(0, 255, (900, 1200, 3), np.uint8)
    found = Detections(0.001, 1, 1200, 900, image=noise)
    recorder.record(made.robot.tick(0.005, 0.005)._replace(detections=found))
    recorder.close("seconds")
    ((at_s, jpeg),) = RunRecording(path).frames()
    assert at_s == 0.001 and len(jpeg) > 2 * PIECE_BYTES
    assert jpeg == encode(noise)


def test_pictures_are_encoded_beside_the_loop() -> None:
    made = assembly()
    made.robot.start(made.clock)
    tick = with_picture(made.robot.tick(0.005, 0.005), 0)
    encoder = FrameEncoder(2.0)
    encoder.start()
    encoder.look(tick)
    encoder.look(tick)
    encoder.stop()
    (one,) = encoder.taken()
    assert one[0] == tick.t_s - 0.03 and one[1][:2] == b"\xff\xd8"


def test_health_comes_once_a_second(recorded: Recorded) -> None:
    found = list(RunRecording(recorded.path).health())
    assert len(found) == 2
    assert found[1]["tx_bytes"] > found[0]["tx_bytes"] > 0
    assert len(found[1]["temperature_c"]) == len(GAZE_JOINTS) and found[1]["lost_ticks"] == 0


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
        for _, channel, message in reader.iter_messages():
            assert channel.message_encoding == "json"
            data = seen[channel.topic] = json.loads(message.data)
            assert unexplained(data, schemas[channel.topic]) == []
            if channel.topic == fmt.TICK:
                since_s = data["t_s"] - recorded.ticks[0].t_s
                wall_s = datetime.fromisoformat(STARTED).timestamp() + since_s
                assert message.log_time / 1e9 == pytest.approx(wall_s, abs=1e-6)
    assert set(seen) == set(fmt.SCHEMAS)
    assert base64.b64decode(seen[fmt.FRAME]["data"])[:2] == b"\xff\xd8"
    states = {one["name"]: one["position"] for one in seen[fmt.JOINT_STATES]["joints"]}
    assert tuple(states) == GAZE_JOINTS
    frames = {one["child_frame_id"] for one in seen[fmt.TRANSFORMS]["transforms"]}
    assert frames == {"head", "left_eye", "right_eye"}


def unexplained(data: Any, schema: dict[str, Any], at: str = "") -> list[str]:
    """List what a schema does not explain, or explains as something else."""
    kinds = {"object": dict, "array": list, "string": str, "number": (int, float),
             "integer": int, "boolean": bool, "null": type(None)}  # fmt: skip
    named = schema.get("type", list(kinds))
    allowed = [named] if isinstance(named, str) else named
    if not any(isinstance(data, kinds[kind]) for kind in allowed):  # type: ignore[arg-type]
        return [f"{at}: {type(data).__name__} is no {allowed}"]
    if isinstance(data, list):
        items = schema.get("items", {})
        return [fault for item in data for fault in unexplained(item, items, f"{at}[]")]
    if not isinstance(data, dict):
        return []
    known = schema.get("properties", {})
    free = at.endswith("before[]") or "additionalProperties" in schema or "order" in known
    missing = [f"{at}.{key}: not explained" for key in data if key not in known and not free]
    inner = [(f"{at}.{key}", data[key], known[key]) for key in data if key in known]
    return missing + [fault for name, value, s in inner for fault in unexplained(value, s, name)]


@pytest.mark.parametrize("odd", [nan, inf, -inf, -0.0, 5e-324, 1.7976931348623157e308])
def test_any_float_comes_back(recorded: Recorded, odd: float) -> None:
    tick = recorded.ticks[-1]
    tick = tick._replace(
        joints=tick.joints._replace(measured_s=(odd,) * 9, temperature_c=(None, odd, *(30.0,) * 7)),
        desired_rad=(odd, *tick.desired_rad[1:]),
        target=tick.target._replace(salience=odd),
    )
    values = orjson.loads(orjson.dumps(moments.as_json(moments.flat(tick, None, odd, ()))))
    back = moments.from_json(values, {})
    assert exact(back.tick) == exact(tick)
    assert repr(back.dt_s) == repr(odd)


def test_a_level_in_an_older_recording_has_its_present_name(recorded: Recorded) -> None:
    values = moments.as_json(moments.flat(recorded.ticks[-1], None, 0.005, ()))
    values["verdict"]["level"] = "limp"
    assert moments.from_json(values, {}).tick.guard_result.level == "torque_off"


@pytest.mark.parametrize("odd", [0.25, nan, -inf])
def test_any_percept_comes_back(odd: float) -> None:
    face = Face(3, (odd, 0.0, 1.0), (0.0,) * 3, ((1.0, 0.0, 0.0),) * 3, ((odd,) * 3,) * 8, 0.5)
    bodies = Bodies((3, 9), ("face", "hand"), *(np.full((2, 3), odd),) * 3, np.array([odd, 1.0]),
                    np.full((2, 6, 6), odd))  # fmt: skip
    for percept in (Percept(odd, bodies, (face,)), Percept(1.0)):
        data = orjson.loads(orjson.dumps(moments.percept_as_json(moments.flat_percept(4, percept))))
        number, back = moments.percept_from_json(data)
        assert number == 4 and repr(back) == repr(percept)
        assert back.bodies.p_world_m.shape == percept.bodies.p_world_m.shape


def test_info_of_another_version_is_read_as_far_as_it_is_known() -> None:
    info = RunInfo("desk", "robot", "a: 1\n", 0, 200.0, STARTED)
    assert info_of({**as_text(info), "what_comes_later": "5"}) == info
    assert end_of({"lost": "3"}) == RunEnd(lost=3)
    with pytest.raises(ValueError, match="config_yaml"):
        info_of({"rig": '"desk"'})


def test_a_rotation_as_a_quaternion() -> None:
    turned = quaternion(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    assert turned == pytest.approx({"x": 0.0, "y": 0.0, "z": 0.5**0.5, "w": 0.5**0.5})


# --- what cannot be read


def test_a_recording_cut_anywhere_opens_and_keeps_what_is_whole(
    recorded: Recorded, tmp_path: Path
) -> None:
    data = recorded.path.read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = []
    for share in (0.9, 0.6, 0.4):
        cut.write_bytes(data[: int(share * len(data))])
        recording = RunRecording(cut)
        assert not recording.whole and "was not closed" in recording.note
        assert recording.info == recorded.info
        back = list(recording.ticks())
        for was, now in zip(recorded.ticks, back, strict=False):
            assert exact(now) == exact(was)
        counts.append(len(back))
    assert counts == sorted(counts, reverse=True) and counts[-1] < 299


def test_damage_is_told_in_one_line(recorded: Recorded, tmp_path: Path) -> None:
    data = bytearray(recorded.path.read_bytes())
    data[len(data) // 3] ^= 0xFF
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(data)
    with pytest.raises(BadRecording, match="damaged") as found:
        list(RunRecording(broken).ticks())
    assert "\n" not in str(found.value)


def written(path: Path, profile: str) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile, "test")
        writer.finish()
    return path


def test_what_is_no_recording_of_a_run_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("not at all a recording")
    (tmp_path / "empty").touch()
    wrong = {
        tmp_path / "nothing": "no recording at .*nothing: check the path",
        tmp_path: "is not a file",
        tmp_path / "text": "is no recording: make one with gazerig run --record",
        tmp_path / "empty": "is no recording",
        written(tmp_path / "camera", "gazerig-camera-1"): "a recording of a camera, not of a run",
        written(tmp_path / "newer", "gazerig-run-9"): "of format 9, .* up to 1: update gazerig",
        written(tmp_path / "other", "ros2"): r"no recording of gazerig \(its profile is 'ros2'\)",
        written(tmp_path / "bare", "gazerig-run-1"): "nothing of the run is in it",
    }
    for path, words in wrong.items():
        with pytest.raises(SetupError, match=words) as found:
            RunRecording(path)
        assert "\n" not in str(found.value)


def test_a_file_is_not_written_over_unasked(tmp_path: Path) -> None:
    there = tmp_path / "there.mcap"
    there.write_text("precious")
    with pytest.raises(SetupError, match="is there already: choose another name or --force"):
        refused = Recorder(there, info_for())
        refused.open()
    refused.close()
    assert there.read_text() == "precious"
    with pytest.raises(SetupError, match="cannot write .*: choose a folder"):
        Recorder(tmp_path / "no" / "r", info_for()).open()


# --- what goes wrong while it runs


def test_a_run_that_never_began_leaves_no_file(tmp_path: Path) -> None:
    path = tmp_path / "never.mcap"
    recorder = Recorder(path, info_for())
    recorder.open()
    assert recorder.close("fault") == f"nothing was recorded: {path} is not made"
    assert not path.exists()


@pytest.fixture
def small_disk() -> Iterator[None]:
    """Let no file grow beyond 60 kB, as on a disk that is nearly full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_ends_the_recording_and_not_the_run(small_disk: None, tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    recorder = Recorder(path, info_for(), patient=True)
    recorder.open()
    made = assembly(recorder)
    made.robot.start(made.clock)
    said: list[str] = []
    goes_on = 0
    for number in range(1, 2001):
        made.clock.sleep_until(0.005 * number)
        recorder.record(made.robot.tick(0.005 * number, 0.005))
        said += recorder.events()
        goes_on += bool(said)
        if goes_on == 100:
            break
    last = recorder.close("seconds")
    said += recorder.events()
    assert goes_on == 100
    assert said == ["recording stopped (File too large); the run goes on without it"]
    assert last == f"recording in {path} is not whole: File too large"
    recording = RunRecording(path)
    assert not recording.whole
    assert path.stat().st_size <= 60_000
    list(recording.ticks())  # what is there is not damaged


def test_a_run_whose_recording_stopped_is_a_fault(small_disk: None, tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    words = ["run", "--mock", "--fast", "--seconds", "5", "--record", str(path)]
    made = CliRunner().invoke(app, words)
    _writer.flush(20.0)
    assert made.exit_code == FAULT, made.output
    assert made.exception is None or isinstance(made.exception, SystemExit)


def test_an_older_recording_stays_until_a_run_has_begun(tmp_path: Path) -> None:
    path = tmp_path / "older.mcap"
    path.write_bytes(b"older")
    path.chmod(0o600)
    recorder = Recorder(path, info_for(), over=True)
    recorder.open()
    assert path.read_bytes() == b"older"
    assert recorder.close("it could not start") == f"nothing was recorded: {path} is as it was"
    assert [one.name for one in tmp_path.iterdir()] == ["older.mcap"]

    recorder = Recorder(path, info_for(), over=True)
    recorder.open()
    recorder.begin()
    assert path.read_bytes() != b"older" and path.stat().st_mode & 0o777 == 0o600
    assert [one.name for one in tmp_path.iterdir()] == ["older.mcap"]
    recorder.close("seconds")


def test_a_robot_that_cannot_start_leaves_an_older_recording(tmp_path: Path) -> None:
    path = tmp_path / "older.mcap"
    path.write_bytes(b"older")
    words = ["run", "--port", "/dev/absent", "--scene", "visitor", "--no-page", "--force"]
    made = CliRunner().invoke(app, [*words, "--record", str(path)])
    assert made.exit_code == BAD_INPUT, made.output
    assert path.read_bytes() == b"older"


def test_a_writer_that_stops_delays_nothing_and_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "late.mcap"
    recorder = Recorder(path, info_for())
    recorder.open()
    made = assembly(recorder)
    made.robot.start(made.clock)
    process = recorder._link._process
    assert process is not None
    process.send_signal(19)  # SIGSTOP
    seen = []
    for number in range(1, 401):
        made.clock.sleep_until(0.005 * number)
        seen.append(made.robot.tick(0.005 * number, 0.005))
        recorder.record(seen[-1])  # would never return if it waited
    process.send_signal(18)  # SIGCONT
    assert recorder.close("seconds").startswith("400 ticks")
    assert recorder.lost == 0
    back = list(RunRecording(path).ticks())
    assert list(map(exact, back)) == list(map(exact, seen))


def test_what_the_queue_cannot_hold_is_lost_and_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gazerig.robot.recording.writer_client.QUEUE_BYTES", 150_000)
    path = tmp_path / "lost.mcap"
    recorder = Recorder(path, info_for())
    recorder.open()
    made = assembly(recorder)
    made.robot.start(made.clock)
    process = recorder._link._process
    assert process is not None
    process.send_signal(19)
    for number in range(1, 401):
        made.clock.sleep_until(0.005 * number)
        recorder.record(made.robot.tick(0.005 * number, 0.005))
    process.send_signal(18)
    said = recorder.close("seconds")
    assert recorder.lost > 0
    assert f"; {recorder.lost} ticks could not be kept" in said
    recording = RunRecording(path)
    assert recording.end.lost == recorder.lost
    assert f"lacks {recorder.lost} ticks" in recording.note
    assert len(list(recording.ticks())) == 400 - recorder.lost


def test_a_writer_that_dies_is_told_once_and_the_run_goes_on(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "dead.mcap", info_for())
    recorder.open()
    made = assembly(recorder)
    made.robot.start(made.clock)
    process = recorder._link._process
    assert process is not None
    process.kill()
    process.wait()
    said: list[str] = []
    for number in range(1, 200):
        made.clock.sleep_until(0.005 * number)
        recorder.record(made.robot.tick(0.005 * number, 0.005))
        said += recorder.events()
    assert said == ["recording stopped (its writer has died); the run goes on without it"]
    assert "not whole: its writer has died" in recorder.close("seconds")
