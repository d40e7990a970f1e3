"""Tracks as data: curves of least jerk, what a rig can do of them, and bad input."""

from collections.abc import Sequence
from functools import cache
from math import degrees, pi, radians
from typing import NamedTuple, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.load import ConfigError, shipped_names
from gazerig.config.schema import load_rig
from gazerig.config.tracks import TrackFiles, load_track
from gazerig.gaze.attention.top_down import Rule
from gazerig.gaze.lids.lids import LidOpenings
from gazerig.gaze.track.animation import Animation
from gazerig.gaze.track.motion import Curves, key_states
from gazerig.gaze.track.player import TrackPlayer
from gazerig.gaze.track.track import EYES, HEAD, LIDS, LIMIT_SHARE, KeyFrame, Track
from gazerig.gaze.track.track_trigger import TrackTrigger
from gazerig.gaze.types import Angles2, GazeCommand, Target
from gazerig.robot.loop.tracks import TrackChoices
from gazerig.robot.model.commands import EndTrack, Play
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import further_joints
from gazerig.robot.run.models import rig_kinematics
from gazerig.robot.run.rig_limits import limits, offsets, track_fit
from gazerig.robot.run.track_file import fit_keys

RIGS = [name for name in shipped_names("rigs") if name != "minimal"]
"""The shipped rigs but the one without neck and lids, which has nothing to laugh or tilt with."""


rig_named = cache(load_rig)


@cache
def fit_to(name):
    """Return the fit to a shipped rig, which computes each motion once."""
    fit = track_fit(rig_named(name))
    fit.motion = cache(fit.motion)  # type: ignore[method-assign]
    return fit


def fitted(track, name="desk"):
    """Return the curves of a track on a shipped rig."""
    return fit_to(name).motion(track, tuple(limits(rig_named(name).joints)), Play("it"))


def sampled(motion):
    return motion.curves.sample(np.arange(0.0, motion.duration_s + 0.1, 0.001))


@cache
def shipped_tracks():
    return cast(dict[str, Track], TrackFiles("desk", ()).read())


@pytest.mark.parametrize("name", shipped_names("tracks"))
@pytest.mark.parametrize("rig", RIGS)
def test_every_shipped_track_is_done_by_every_shipped_rig_as_written(name, rig):
    track = shipped_tracks()[name]
    needed = {"brow_shrug": "left_brow", "tilt": "neck_roll"}.get(name)
    if needed and needed not in rig_named(rig).names:
        with pytest.raises(ValueError, match="left_brow, right_brow|head_roll"):
            fitted(track, rig)
        return
    motion = fitted(track, rig)
    assert "ends at its range" not in motion.state.limited
    assert "slower" not in motion.state.limited or name == "flinch"
    samples = sampled(motion)
    assert np.abs(samples[0]).max() > radians(3.0)
    assert np.abs(samples[:, [0, -1]]).max() < 1e-9


def curve(times, values, at):
    """Return the (3, n) states of the curve through keys at times."""
    return Curves(times, key_states(times, values)[:, :, None]).sample(at)[:, :, 0]


@given(keys=st.lists(st.tuples(st.floats(0.05, 2.0), st.floats(0.1, 30.0)), min_size=1, max_size=8))
@settings(max_examples=100, deadline=None)
def test_a_curve_that_does_not_turn_never_swings_back(keys):
    spans, steps = np.array(keys).T
    times, values = np.append(0.0, np.cumsum(spans)), np.append(0.0, np.cumsum(steps))
    value, speed, _ = curve(times, values, np.linspace(0.0, times[-1], 500))
    assert speed.min() > -1e-9 and value[-1] == pytest.approx(values[-1])
    assert curve(times, values, times)[0] == pytest.approx(values)


def test_a_curve_rests_where_it_turns_and_never_swings_past():
    times, values = np.array([0.0, 0.3, 0.6, 0.9, 1.4]), np.array([0.0, 10.0, -4.0, -4.0, 0.0])
    value, speed, acceleration = curve(times, values, np.linspace(0.0, 1.5, 3001))
    assert value.max() <= 10.0 + 1e-9 and value.min() >= -4.0 - 1e-9
    assert np.abs(curve(times, values, times)[1:]).max() < 1e-9
    assert np.abs(np.gradient(value, 5e-4) - speed).max() < 0.2
    assert np.abs(np.gradient(speed, 5e-4) - acceleration)[5:-5].max() < 20.0


def test_dense_keys_of_a_steady_turn_move_at_a_steady_speed():
    times = np.arange(0.0, 2.01, 0.1)
    speed = curve(times, 30.0 * times, np.linspace(0.2, 1.8, 500))[1]
    assert speed == pytest.approx(np.full(500, 30.0))


def nod():
    return Track("a nod", (KeyFrame(0.2, head_pitch_deg=-8.0), KeyFrame(0.5, head_pitch_deg=0.0)))


def test_only_segments_that_are_too_fast_take_longer():
    fast = (KeyFrame(1.0, head_pitch_deg=-10.0), KeyFrame(1.05, head_pitch_deg=0.0))
    held = (KeyFrame(2.05, head_pitch_deg=0.0), KeyFrame(3.05, head_pitch_deg=5.0))
    motion = fitted(Track("a jerk", (*fast, *held)))
    # 10 deg in 50 ms peak at 5.7735 x 10 / .05^2 = 23094 deg/s2; 1600 may be used.
    longer_s = 0.05 * ((23094.0 / 1600.0) ** 0.5 - 1.0)
    assert motion.duration_s == pytest.approx(3.45 + longer_s, abs=0.003)
    assert motion.state.limited == f"slower by {1.0 + longer_s / 3.45:.2f} for neck_pitch"
    assert degrees(np.abs(sampled(motion)[2]).max()) == pytest.approx(1600.0, rel=0.01)
    for before_s, after_s in ((1.0, 1.0), (2.05, 2.05 + longer_s)):
        assert motion.position_at(after_s) == pytest.approx(before_s, abs=0.003)
    assert motion.rate < 1.0


def test_a_track_that_begins_in_motion_is_led_in_from_rest():
    frames = tuple(KeyFrame(0.02 + 0.1 * i, head_yaw_deg=12.0 + 2.0 * i) for i in range(8))
    motion = fitted(Track("a part of a turn", frames))
    lead_s = -motion.position_at(0.0)
    assert 0.1 < lead_s < 0.5 and motion.rate == 1.0  # the rest keeps its times
    value, speed, acceleration = motion.curves.sample(np.arange(0.0, lead_s + 0.8, 0.001))[:, :, 0]
    assert value[0] == speed[0] == acceleration[0] == 0.0
    assert degrees(np.abs(acceleration).max()) < 1.001 * LIMIT_SHARE * 2000.0
    (at,) = motion.curves.sample(np.array([lead_s + 0.42]))[0, :, 0]
    assert degrees(at) == pytest.approx(20.0, abs=1e-6)


def test_it_stays_within_the_ranges_and_says_what_they_leave():
    bow = Track("a bow", (KeyFrame(1.0, head_pitch_deg=-70.0), KeyFrame(2.0, head_pitch_deg=10.0)))
    motion = fitted(bow)
    assert "neck_pitch ends at its range" in motion.state.limited
    pitch = np.degrees(sampled(motion)[0, :, 1])
    assert pitch.min() == pytest.approx(-35.0) and pitch.max() == pytest.approx(10.0, abs=0.01)


def test_what_a_rig_lacks_is_left_out_and_named():
    jaw = KeyFrame(0.3, head_pitch_deg=5.0, joints_deg={"jaw": 10.0})
    assert fitted(Track("a yawn", (jaw,))).state.limited == "without jaw"
    with pytest.raises(ValueError, match="this rig has none of the joints that it moves: jaw"):
        fitted(Track("a yawn", (KeyFrame(0.3, joints_deg={"jaw": 9.0}),)))
    mouth = KeyFrame(0.3, head_pitch_deg=5.0, levels={"mouth": 1.0})
    assert fitted(Track("a word", (mouth,), owns=("tail",))).state.limited == "without mouth, tail"


def test_a_track_of_a_sound_alone_moves_nothing():
    motion = fitted(Track("a song", sound="song.wav"))
    assert not motion.channels.any() and not sampled(motion).any() and motion.state.limited == ""


def test_a_frame_names_expressions_as_levels():
    rig = rig_named("expressive")
    motion = fitted(Track("a smile", (KeyFrame(1.0, levels={"happy": 0.5}),)), "expressive")
    full = offsets(rig, rig.expressions["happy"])
    (half,) = motion.curves.sample(np.array([1.0]))[0]
    assert half == pytest.approx(0.5 * full)


def test_eyes_move_instead_of_a_neck_that_a_rig_lacks():
    assert "neck_pitch" not in rig_named("maker").names
    motion = fitted(nod(), "maker")
    assert (
        np.flatnonzero(motion.channels).tolist() == [4]
        and motion.state.limited == "without neck_pitch"
    )
    both = Track("both", (KeyFrame(0.5, head_pitch_deg=-8.0, eyes_pitch_deg=3.0),))
    motion = fitted(both, "maker")
    assert np.degrees(sampled(motion)[0, :, 4]).max() == pytest.approx(3.0)
    assert motion.state.limited == "without neck_pitch"


LONG = "frames:\n" + "".join(
    f"  - {{time_s: {i + 1}, head_yaw_deg: {i % 5}, eyes_yaw_deg: 1}}\n" for i in range(5000)
)
BAD = {
    "frames:\n  - {time_s: 0.2}\n": ("frames.0", "names no motion"),
    "frames:\n  - {time_s: 0.2, head_pich_deg: 3}\n": ("frames.0.head_pich_deg", "head_pitch_deg"),
    "frames:\n  - {time_s: 0.2, head_pitch_deg: 300}\n": ("frames.0.head_pitch_deg", "90"),
    "frames:\n  - {time_s: 0.2, lids: {top: 0.5}}\n": ("frames.0", "no lids 'top'"),
    "frames:\n  - {time_s: 0.2, head_yaw_deg: .nan}\n": ("frames.0.head_yaw_deg", ""),
    "frames: []\n": ("frames", "at least one frame"),
    "frames:\n  - {time_s: 0.5, head_yaw_deg: 1}\n  - {time_s: 0.5, head_yaw_deg: 2}\n": (
        "frames.1.time_s",
        "later than the previous frame",
    ),
    "frames:\n  - {time_s: 0.5, joints_deg: {neck_yaw: 1}}\n": (
        "frames.0.joints_deg.neck_yaw",
        "head_yaw_deg",
    ),
    "cues: {a: 1, a: 2}\nframes: [{time_s: 2, head_yaw_deg: 3}]\n": ("cues.a", "duplicate key"),
    "sound: ../x.wav\n": ("sound", "and below can be named"),
    LONG.replace("time_s: 7, head", "time_s: 7, heat"): ("frames.6.heat_yaw_deg", "head_yaw_deg"),
}


def test_a_long_track_is_one_curve_and_a_longer_file_is_refused(tmp_path):
    file = tmp_path / "long.yaml"
    file.write_text(f"description: long\n{LONG}cues: {{a: 4}}\n", encoding="utf-8")
    track = load_track(file)
    assert len(track.frames) == 5000 and track.frames[6].eyes_yaw_deg == 1 and track.cues
    motion = fitted(track)
    assert motion.duration_s == motion.length_s > 5000.0
    yaw = np.degrees(motion.curves.sample(np.array([1.0, 7.0, 4999.0]))[0, :, 0])
    assert yaw == pytest.approx([0.0, 1.0, 3.0])
    file.write_bytes(b"frames:\n" + b"  - {time_s: 1, lids: 1}\n   " * 750_000)
    with pytest.raises(ConfigError, match="larger than the 20 MB that"):
        load_track(file)


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_a_bad_file_is_answered_with_line_key_and_rule(text, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(f"description: mine\n{text}", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_track(file)
    key, rule = BAD[text]
    (fault,) = caught.value.faults
    assert fault.key == key and rule in fault.rule
    assert fault.line is not None and fault.line >= 1


# --- Files of tracks, and fits of keys to samples


def test_a_motion_sampled_densely_becomes_few_keys_within_the_tolerance():
    random = np.random.default_rng(3)
    times = np.cumsum(random.uniform(0.015, 0.025, 200))
    truth = 12.0 * np.sin(2 * pi * 0.6 * times) * np.minimum(1.0, times)
    found, keys = fit_keys(times, truth + random.normal(0.0, 0.15, 200), 0.7)
    assert 4 <= len(found) <= 30
    assert np.abs(curve(found, keys, times)[0] - truth).max() < 0.7 + 0.3
    assert len(fit_keys(times, np.full(len(times), 3.0), 0.7)[0]) == 2


# --- Tracks begin, end and are interrupted at random moments: no joint jumps or breaks a limit


DT_S = 0.01
TARGET = (1.0, 0.0, 0.25)
SPEEDS = (0.5, 0.65, 0.85, 1.1, 1.45, 2.0)
"""Few, so that each motion is computed once."""


def joint_angles(rig_name, changes):
    """Return (n, joints) angles of a head that looks at a point straight ahead all the while."""
    kinematics = rig_kinematics(rig_named(rig_name))

    def angles(one):
        yaw, pitch, roll = one.change(HEAD, (0.0, 0.0, 0.0))
        eyes = kinematics.eye_angles_to(TARGET, *kinematics.head_pose((yaw, pitch, roll)))
        left, right = (cast(Angles2, tuple(one.change(EYES, eye))) for eye in eyes)
        lids = LidOpenings(0.9, 0.9, False, 0.9, 0.9).change(one.factors[LIDS], one.added[LIDS])
        gaze = GazeCommand(
            (yaw, pitch, roll), left, right, lids.left, lids.right,
            "fixate", False, TARGET, 0, 0, 0, lids.lower_left, lids.lower_right,
        )  # fmt: skip
        return kinematics.inverse(gaze, one.joints_rad)

    return np.array([angles(one) for one in changes])


def interrupted(track, rig_name, moments):
    """Play a track and, at random moments, another one, the same again, or nothing.

    Returns:
        (n, joints) angles in each tick, and the limits of the joints.
    """
    rig, random = rig_named(rig_name), np.random.default_rng(len(track))
    animation, bounds = Animation(further_joints(rig.joints)), limits(rig.joints)
    player = animation.tracks
    choices = TrackChoices(shipped_tracks, player, fit_to(rig_name), lambda: bounds)
    names = [one.name for one in choices.states() if not one.refused]
    others = (*names, track, track, "")
    changes, t = [animation.step(0.0)] * 3, 0.0
    for _ in range(moments):
        name = track if not player.playing else others[int(random.integers(len(others)))]
        speed = float(random.choice(SPEEDS))
        if name:
            choices.play(Play(name, speed), t)
        else:
            player.end("enough", t)
        for _ in range(int(random.integers(1, round(0.25 / DT_S)))):
            t += DT_S
            changes.append(animation.step(t))
    return joint_angles(rig_name, changes), bounds


TRACKS = shipped_names("tracks")
RIG_OF = dict(
    zip(TRACKS, ("expressive", "desk", "maker", "expressive", "feetech") * 9, strict=False)
)  # fmt: skip


@pytest.mark.parametrize("track", TRACKS)
def test_no_joint_jumps_or_breaks_a_limit_at_random_moments(track):
    angles, bounds = interrupted(track, RIG_OF[track], 80)
    speed = np.abs(np.diff(angles, axis=0)).max(axis=0) / DT_S
    acceleration = np.abs(np.diff(angles, 2, axis=0)).max(axis=0) / DT_S**2
    assert speed.max() * DT_S > radians(0.1)  # something has moved
    assert (speed < [one.speed_rad_s for one in bounds]).all()
    assert (acceleration < [one.accel_rad_s2 for one in bounds]).all()


# --- Tracks in a show: another clock at random, several at once, joints of their own


class Show(NamedTuple):
    """A player, and what starts and controls its tracks."""

    player: TrackPlayer
    choices: TrackChoices
    bounds: Sequence[JointLimit]

    def play(self, name, t_s, **how):
        reply = self.choices.play(Play(name, **how), t_s)
        assert reply.track is not None, reply
        return reply.track.number

    def added(self, t_s):
        return self.player.step(t_s)[1]


def playback(it):
    """Return the only track that plays."""
    (found,) = it.player.playing
    return found


def strain(motion, offsets, dt_s):
    """Return the factor by which offsets must be slower to keep the share of all limits."""
    speed = np.diff(offsets, axis=0) / dt_s
    return float(motion.strain(np.stack((speed[1:], np.diff(speed, axis=0) / dt_s))).max())


def show(**tracks):
    joints = rig_named("expressive").joints
    player, bounds = TrackPlayer(len(further_joints(joints))), limits(joints)
    choices = TrackChoices(lambda: tracks, player, fit_to("expressive"), lambda: bounds)
    return Show(player, choices, bounds)


def long_track(seconds, seed):
    """Return a track with a key of neck and jaw in each second or so."""
    random, times = np.random.default_rng(seed), np.arange(0.8, seconds, 0.9)
    frames = tuple(
        KeyFrame(
            round(float(t), 3),
            head_yaw_deg=float(random.uniform(-15, 15)),
            head_pitch_deg=float(random.uniform(-6, 6)),
            joints_deg={"jaw": float(random.uniform(0, 6))},
        )
        for t in times
    )
    return Track("a show", frames, cues={"middle": seconds / 2})


def test_a_show_of_an_hour_with_many_corrections_keeps_all_limits():
    it, random = show(hour=long_track(3600.0, 1)), np.random.default_rng(2)
    t = 0.0
    it.play("hour", t, loop=True)
    worst = 0.0
    for _ in range(60):
        off_s = float(random.choice([0.01, 0.1, -0.2, 2.0]))
        it.player.sync(1, max(0.0, playback(it).state.position_s + off_s), t)
        rows = []
        for _ in range(300):
            t += DT_S
            rows.append(it.added(t))
        worst = max(worst, strain(playback(it).motion, np.array(rows), DT_S))
    assert 0.4 < worst <= 1.06, worst


@pytest.mark.parametrize("at_s", [3.1, 40.0, 59.0])
def test_a_track_that_begins_in_its_middle_grows_from_rest_within_limits(at_s):
    it = show(minute=long_track(60.0, 3))
    it.play("minute", 0.0, from_s=at_s)
    started = playback(it)
    assert started.state.position_s == pytest.approx(at_s)
    rows = np.array([it.added(0.005 * k) for k in range(400)])
    assert not rows[0].any() and np.abs(rows[1]).max() < 5e-5
    assert strain(started.motion, rows, 0.005) <= 1.1
    later = started.motion.curves.sample(np.array([started.time_s]))[0, 0]
    assert rows[-1] == pytest.approx(later, abs=1e-9)


def test_other_channels_run_together_and_the_same_replace():
    pitch = Track("p", (KeyFrame(2.0, head_pitch_deg=5.0),))
    jaw = Track("j", (KeyFrame(2.0, joints_deg={"jaw": 5.0}),), owns=("jaw",))
    talk = Track("t", (KeyFrame(2.0, joints_deg={"jaw": 3.0}),))
    it = show(pitch=pitch, jaw=jaw, talk=talk)
    it.play("pitch", 0.0)
    it.play("jaw", 0.1)
    it.player.step(0.5)
    states = it.player.states(0.5)
    assert [one.name for one in states if one.is_playing] == ["pitch", "jaw"]
    assert states[1].owns == ("jaw",)
    it.play("talk", 0.6)
    it.player.step(0.6)
    states = it.player.states(0.6)
    assert [one.name for one in states if one.is_playing] == ["pitch", "talk"]
    assert states[1].end_reason == "another track: talk"
    it.choices.end(EndTrack(), 0.7)
    it.player.step(0.7)
    assert not [one for one in it.player.states(0.7) if one.is_playing]
    with pytest.raises(ValueError, match="no playing track 'talk'; available: none"):
        it.choices.end(EndTrack("talk"), 0.8)


def test_an_owned_jaw_goes_from_the_present_angle_to_the_track_and_back():
    jaw = Track(
        "j", tuple(KeyFrame(float(s), joints_deg={"jaw": 2.0 + s % 2}) for s in range(1, 9)),
        owns=("jaw",),
    )  # fmt: skip
    it = show(jaw=jaw)
    it.play("jaw", 0.0)
    angles = []
    for k in range(2200):
        factors, added = it.player.step(k * 0.005)
        angles.append(factors[9] * radians(5.0) + added[9])
    at = np.degrees(angles)
    assert at[0] == pytest.approx(5.0) and at[-1] == pytest.approx(5.0)
    assert at[400] == pytest.approx(2.0, abs=0.01)  # of the track alone
    bound = it.bounds[rig_named("expressive").names.index("jaw")]
    assert np.abs(np.diff(at, 2)).max() / 0.005**2 <= np.degrees(bound.accel_rad_s2)
    assert np.abs(np.diff(at)).max() / 0.005 <= np.degrees(bound.speed_rad_s)


def test_loops_cues_and_a_clock_of_a_sound():
    frames = (KeyFrame(1.0, head_pitch_deg=3.0), KeyFrame(2.0, head_pitch_deg=0.0))
    it = show(hello=Track("h", frames, cues={"top": 1.0, "end": 1.9}, loop=True))
    number = it.play("hello", 0.0)
    t = 0.0
    for _ in range(1004):
        t += 0.005
        it.player.step(t)
    (state,) = it.player.states(t)
    assert state.position_s == pytest.approx(1.02)
    it.player.sync(number, 1.12, t)  # 0.1 s late: faster for 3.75 s
    for _ in range(800):
        t += 0.005
        it.player.step(t)
    (state,) = it.player.states(t)
    assert state.position_s == pytest.approx((1.12 + 4.0) % 2.0, abs=0.012)
    with pytest.raises(ValueError, match="no cue 'no'; available: top, end"):
        it.choices.prepare(Play("hello", from_s="no"))
    with pytest.raises(ValueError, match="hello lasts 2.00 s: from_s must be less"):
        it.choices.prepare(Play("hello", from_s=99.0))
    it.play("hello", t, from_s="top")
    (playing,) = [one for one in it.player.states(t) if one.is_playing]
    assert playing.position_s <= 1.0
    it.player.step(t + 0.5)
    (playing,) = [one for one in it.player.states(t + 0.5) if one.is_playing]
    assert 1.0 <= playing.position_s <= 1.5


def looked_at(kind, number=1):
    return Target((1.0, 0.0, 0.2), (0.0, 0.0, 0.0), 0.0, kind, number, 0.5, True, None, 0, "")


def test_a_rule_plays_its_track_at_its_onset_and_not_again_too_soon():
    rule = Rule("hand", 0.5, gesture="nod")
    trigger = TrackTrigger()
    seen = [(0.0, "face"), (0.1, "hand"), (0.2, "hand"), (0.3, "face"), (0.4, "hand"),
            (9.9, "face"), (10.2, "hand"), (17.0, "hand")]  # fmt: skip
    played = [t for t, kind in seen if trigger.step("wait", rule, looked_at(kind), t)]
    assert played == [0.1, 10.2]
    named = Rule("id:7", 0.5, gesture="nod")
    assert not trigger.step("one", named, looked_at("face", 6), 20.0)
    assert trigger.step("one", named, looked_at("face", 7), 20.1) == "nod"
    assert not trigger.step("none", Rule("face", 0.5), looked_at("face"), 30.0)
