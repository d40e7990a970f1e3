"""Tracks as data: curves of least jerk, what a rig can do of them, and bad input."""

from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.load import ConfigError, shipped_names
from gazerig.config.schema import Rig, load_rig
from gazerig.config.tracks import load_track, shipped_tracks, tracks_of
from gazerig.gaze.track.minimum_jerk_curve import MinimumJerkCurve
from gazerig.gaze.track.track import POSE_CHANNELS, KeyFrame, Track, channel_keys
from gazerig.gaze.types import Floats
from gazerig.robot.app.rig_limits import lid_spans, limits
from gazerig.robot.model.track_fit import (
    FittedTrack,
    TrackFit,
    TrackRefused,
    track_motions,
)

RIGS = [name for name in shipped_names("rigs") if name != "minimal"]
"""The shipped rigs but the one without neck and lids, which has nothing to laugh or tilt with."""


def fitted(track: Track, name: str = "desk", speed: float = 1.0, **at: float) -> FittedTrack:
    """Return a track on a shipped rig, with joints at angles in degrees, else at 0."""
    rig = load_rig(name)
    joints = rig.names
    base = np.array([radians(at.get(name, 0.0)) for name in joints])
    fit = TrackFit(joints, lid_spans(rig))
    return fit.fit("x", track_motions(track, joints), speed, base, limits(rig.joints))


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("name", shipped_names("tracks"))
def test_every_shipped_track_is_done_by_every_shipped_rig_as_written(name: str, rig: str) -> None:
    track = shipped_tracks()[name]
    brows = {"left_brow", "right_brow"} <= set(load_rig(rig).names)
    if name == "brow_shrug" and not brows:
        with pytest.raises(TrackRefused, match="left_brow, right_brow"):
            fitted(track, rig)
        return
    found = fitted(track, rig)
    assert found.slowed_by == 1.0 and found.reduced_joints == ()
    samples = found.track.motion.samples
    assert np.abs(samples.value).max() > radians(3.0)
    for end in (0, -1):
        for column in samples[1:]:
            assert np.abs(column[end]).max() < 1e-9


def spline_of_least_jerk(times: Floats, values: Floats, at: Floats) -> tuple[Floats, Floats]:
    from scipy.interpolate import make_interp_spline

    rest = [(1, 0.0), (2, 0.0)]
    spline = make_interp_spline([0.0, *times], [0.0, *values], k=5, bc_type=(rest, rest))
    return spline(at), spline(at, 1)


@given(keys=st.lists(st.tuples(st.floats(0.05, 2.0), st.floats(0.1, 30.0)), min_size=1, max_size=8))
@settings(max_examples=100, deadline=None)
def test_a_curve_that_does_not_turn_is_the_spline_of_least_jerk_unless_that_swings_back(
    keys: list[tuple[float, float]],
) -> None:
    spans, steps = np.array(keys).T
    times, values = np.cumsum(spans), np.cumsum(steps)
    curve = MinimumJerkCurve(0.0, times.tolist(), values.tolist())
    at = np.linspace(0.0, times[-1], 500)
    least, rate = spline_of_least_jerk(times, values, at)
    value, speed, acceleration = curve.sample_at(at)
    assert speed.min() > -1e-4 * speed.max()  # never back
    if rate.min() > 0.0:
        assert np.abs(value - least).max() < 1e-6 * np.abs(least).max()
    before = np.maximum(0.0, times - 1e-9)
    for one, other in zip(curve.sample_at(before)[1:], curve.sample_at(times)[1:], strict=True):
        assert np.abs(one - other).max() < 1e-5 * max(1.0, np.abs(acceleration).max())
    assert [curve.value_at(t) for t in at[::50]] == pytest.approx(value[::50], abs=1e-9)


def test_a_curve_rests_where_it_turns_and_never_swings_past() -> None:
    curve = MinimumJerkCurve(0.0, [0.3, 0.6, 0.9, 1.4], [10.0, -4.0, -4.0, 0.0])
    value, speed, acceleration = curve.sample_at(np.linspace(0.0, 1.5, 3001))
    assert value.max() <= 10.0 + 1e-9 and value.min() >= -4.0 - 1e-9
    at = curve.sample_at(np.array([0.3, 0.6, 0.9, 1.4]))
    assert np.abs(at[1]).max() < 1e-9 and np.abs(at[2]).max() < 1e-6
    assert np.abs(np.gradient(value, 5e-4) - speed).max() < 0.2
    assert np.abs(np.gradient(speed, 5e-4) - acceleration)[5:-5].max() < 20.0


def nod(**more: object) -> Track:
    frames = (KeyFrame(0.2, head_pitch_deg=-8.0), KeyFrame(0.5, head_pitch_deg=0.0))
    return Track("a nod", frames, **more)  # type: ignore[arg-type]


def test_too_fast_is_refused_with_joint_time_and_limit_or_slowed() -> None:
    fast = (KeyFrame(0.05, head_pitch_deg=-10.0),)
    with pytest.raises(
        TrackRefused, match=r"neck_pitch at 0\.0\d s: needs \d+ deg/s2, but tracks may use 1600"
    ):
        fitted(Track("a jerk", fast))  # fmt: skip
    slow = fitted(Track("a jerk", fast, fit="slow"))
    # 10 deg in 50 ms peak at 5.7735 x 10 / .05^2 = 23094 deg/s2; 1600 may be used.
    assert slow.slowed_by == pytest.approx((23094.0 / 1600.0) ** 0.5, rel=0.01)
    assert slow.slow_joint == "neck_pitch"
    most = np.abs(slow.track.motion.samples.scale(np.array(slow.track.sizes), slow.track.speed).acceleration)  # fmt: skip
    assert degrees(most.max()) == pytest.approx(1600.0, rel=0.01)


def test_at_the_end_of_a_range_it_is_smaller_or_refused() -> None:
    with pytest.raises(TrackRefused, match="neck_pitch leaves its range: it can move 50% as far"):
        fitted(nod(), neck_pitch=-31.0)  # fmt: skip
    found = fitted(nod(fit="slow"), neck_pitch=-31.0)
    assert found.reduced_joints == (("neck_pitch", pytest.approx(0.5)),)
    with pytest.raises(TrackRefused, match="neck_pitch is at the end of its range"):
        fitted(nod(fit="slow"), neck_pitch=-34.5)


def test_joints_that_a_rig_lacks_are_left_out_where_optional_else_refused_by_name(
    desk_rig: Rig,
) -> None:
    jaw = (KeyFrame(0.3, head_pitch_deg=5.0, joints_deg={"jaw": 10.0}),)
    with pytest.raises(TrackRefused, match="it moves jaw, which this rig lacks"):
        fitted(Track("a yawn", jaw))
    made = track_motions(Track("a yawn", jaw, optional=("jaw",)), desk_rig.names)
    assert made.left_out == ("jaw",)
    with pytest.raises(TrackRefused, match="this rig has none of the joints"):
        track_motions(Track("a yawn", (KeyFrame(0.3, joints_deg={"jaw": 9.0}),), optional=("jaw",)), desk_rig.names)  # fmt: skip


def test_a_loop_repeats_and_all_ends_at_rest() -> None:
    laugh = shipped_tracks()["laugh"]
    once, often = (channel_keys(laugh, laugh.frames, count) for count in (1, 5))
    pitch = once["head_pitch"], often["head_pitch"]
    assert len(pitch[1].times_s) == len(pitch[0].times_s) + 4 * 2
    assert pitch[1].times_s[-1] == pytest.approx(pitch[0].times_s[-1] + 4 * 0.3)
    aside = Track("aside", (KeyFrame(0.3, eyes_yaw_deg=5.0),), return_s=0.7)
    assert channel_keys(aside, aside.frames, 1)["eyes_yaw"].times_s == (0.3, 1.0)


def test_in_joint_space_the_eyes_go_along_with_the_head(desk_rig: Rig) -> None:
    for space, follows in (("gaze", 0.0), ("joint", 1.0)):
        motion = track_motions(nod(space=space), desk_rig.names).motion
        flat = [0.0] * len(POSE_CHANNELS)
        motion.add_to(flat, 0.2, (1.0,) * len(flat))
        assert flat[1] == pytest.approx(radians(-8.0))
        assert flat[POSE_CHANNELS.index("eyes_pitch")] == pytest.approx(follows * radians(-8.0))
        eyes = motion.samples.value[:, POSE_CHANNELS.index("eyes_pitch")]
        assert np.allclose(eyes, follows * motion.samples.value[:, 1])


LONG = "frames:\n" + "".join(
    f"  - {{time_s: {i + 1}, head_yaw_deg: {i % 5}, look_at: person}}\n" for i in range(5000)
)
BAD = {
    "frames:\n  - {time_s: 0.2}\n": ("frames.0", "names no motion"),
    "frames:\n  - {time_s: 0.2, head_pich_deg: 3}\n": ("frames.0.head_pich_deg", "head_pitch_deg"),
    "frames:\n  - {time_s: 0.2, head_pitch_deg: 300}\n": ("frames.0.head_pitch_deg", "90"),
    "frames:\n  - {time_s: 0.2, lids: {top: 0.5}}\n": ("frames.0", "unknown lids 'top'"),
    "frames:\n  - {time_s: 0.2, head_yaw_deg: .nan}\n": ("frames.0.head_yaw_deg", ""),
    "frames: []\n": ("", "at least one frame"),
    "frames:\n  - {time_s: 0.5, head_yaw_deg: 1}\n  - {time_s: 0.5, head_yaw_deg: 2}\n": (
        "frames.1.time_s",
        "later than the previous frame",
    ),
    "loop_s: [0.1, 0.5]\nframes:\n  - {time_s: 0.5, head_yaw_deg: 1}\n": (
        "loop_s",
        "not the time of a frame",
    ),
    "frames:\n  - {time_s: 0.5, joints_deg: {neck_yaw: 1}}\n": (
        "frames.0.joints_deg.neck_yaw",
        "head_yaw_deg",
    ),
    "fit: maybe\nframes:\n  - {time_s: 0.5, head_yaw_deg: 1}\n": ("fit", "slow"),
    "frames:\n  - {time_s: 1, look_at: [1, .nan, 2]}\n": ("frames.0", "give [x, y, z]"),
    "frames:\n  - {time_s: 1, look_at: nobody}\n": ("frames.0", "person, or null"),
    "cues: {a: 1, a: 2}\nframes: [{time_s: 2, look_at: 3}]\n": ("cues.a", "duplicate key"),
    "cues: {a: 9}\nframes: [{time_s: 2, look_at: 3}]\n": ("cues.a", "after the last frame"),
    "owns: [Neck]\nframes: [{time_s: 2, look_at: 3}]\n": ("owns.0", "neck, eyes, lids"),
    "sound: ../x.wav\n": ("sound", "and below can be named"),
    LONG.replace("time_s: 7,", "time_s: 3,"): ("frames.6.time_s", "which is at 6 s"),
    LONG.replace("time_s: 7,", "time_s: .nan,"): ("frames.6.time_s", "wanted a number"),
    LONG.replace("time_s: 7, head", "time_s: 7, heat"): ("frames.6.heat_yaw_deg", "head_yaw_deg"),
}


def test_a_long_track_is_one_curve_and_a_longer_file_is_refused(
    desk_rig: Rig, tmp_path: Path
) -> None:
    file = tmp_path / "long.yaml"
    file.write_text(f"description: long\nfit: slow\n{LONG}cues: {{a: 4}}\n", encoding="utf-8")
    track = load_track(file)
    assert len(track.frames) == 5000 and track.frames[6].look_at == "person" and track.cues
    motion = track_motions(track, desk_rig.names).motion
    assert motion.duration_s > 5000.0 and len(motion.samples.times_s) < 100
    every = motion.sample_at(np.arange(0.0, 60.0, 0.005))
    for part, whole in zip(every[1:], motion.samples[1:], strict=True):
        assert part.max() <= whole.max() * 1.02 and part.min() >= whole.min() * 1.02
    file.write_bytes(b"frames:\n" + b"  - {time_s: 1, look_at: 1}\n" * 750_000)
    with pytest.raises(ConfigError, match="larger than the 20 MB that"):
        load_track(file)


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_a_bad_file_is_answered_with_line_key_and_rule(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(f"description: mine\n{text}", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_track(file)
    key, rule = BAD[text]
    (fault,) = caught.value.faults
    assert fault.key == key and rule in fault.rule
    assert fault.line is not None and fault.line >= 1


def test_a_rig_with_tracks_of_its_own_is_checked_with_them(tmp_path: Path) -> None:
    good, bad = tmp_path / "wave_back.yaml", tmp_path / "twitch.yaml"
    good.write_text("description: x\nframes:\n  - {time_s: 0.5, head_yaw_deg: 5}\n")
    bad.write_text("description: x\nframes:\n  - {time_s: 0.05}\n")
    assert "wave_back" in tracks_of([str(good)])
    with pytest.raises(ConfigError, match="twitch.yaml:3: frames.0: .*names no motion"):
        tracks_of([str(good), str(bad)])
