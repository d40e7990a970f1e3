"""Tracks in a show: another clock at random, several at once, joints of their own."""

from collections.abc import Sequence
from functools import cache
from math import radians
from typing import NamedTuple

import numpy as np
import pytest

from gazerig.config.schema import Rig, load_rig
from gazerig.gaze.track.track import KeyFrame, Track
from gazerig.gaze.track.track_player import OffsetState, TrackPlayer
from gazerig.robot.app.rig_limits import lid_spans, limits
from gazerig.robot.control.track_choices import TrackChoices
from gazerig.robot.model.commands import EndTrack, Play, SyncTrack
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.track_fit import TrackFit
from gazerig.robot.model.types import further_joints


@cache
def rig() -> Rig:
    return load_rig("expressive")


class Show(NamedTuple):
    """A player, and what starts and controls its tracks."""

    player: TrackPlayer
    choices: TrackChoices
    bounds: Sequence[JointLimit]

    def play(self, name: str, t_s: float, **how: object) -> int:
        rest = (0.0,) * len(rig().names)
        reply = self.choices.play(Play(name, **how), t_s, rest, self.bounds)  # type: ignore[arg-type]
        assert reply.track is not None, reply
        return reply.track.number

    def end(self, t_s: float, track: str = "") -> str:
        return self.choices.end(EndTrack(track), t_s, self.bounds).refused


def show(**tracks: Track) -> Show:
    player = TrackPlayer(len(further_joints(rig().joints)))
    choices = TrackChoices(tracks, player, rig().names, lid_spans(rig()))
    return Show(player, choices, limits(rig().joints))


def long_track(seconds: float, seed: int) -> Track:
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
    return Track("a show", frames, fit="slow", cues={"middle": seconds / 2})


def test_a_show_of_an_hour_with_200_corrections_keeps_all_limits() -> None:
    it, random = show(hour=long_track(3600.0, 1)), np.random.default_rng(2)
    t = 0.0
    it.play("hour", t, loop=True)
    (voice,) = it.player.voices
    worst = 0.0
    for _ in range(200):
        before = it.player.state(t)
        off_s = float(random.choice([0.01, 0.1, -0.2, 2.0]))
        it.choices.sync(SyncTrack(1, max(0.0, voice.position_s(t) + off_s)), t)
        after = it.player.state(t)
        for was, now in zip(before[:2], after[:2], strict=True):
            assert np.abs(was - now).max() < 1e-9
        for _ in range(18):
            t += 0.2
            it.player.step(t)
            _, speed, acceleration = it.player.state(t)
            worst = max(worst, voice.played.stretch(speed[None], acceleration[None]))
    assert 0.4 < worst <= 1.06, worst


@pytest.mark.parametrize("at_s", [3.1, 40.0, 59.0])
def test_a_track_that_begins_in_its_middle_grows_from_rest_within_limits(at_s: float) -> None:
    it = show(minute=long_track(60.0, 3))
    it.play("minute", 0.0, from_s=at_s)
    (voice,) = it.player.voices
    assert not it.player.state(0.0).value.any() and voice.position_s(0.0) == at_s
    times = np.arange(0.0, 2.0, 0.005)
    states = [it.player.state(t) for t in times.tolist()]
    value, speed, acceleration = (np.array([one[i] for one in states]) for i in range(3))
    assert voice.played.stretch(speed, acceleration) <= 1.0 + 1e-3
    assert speed[1:] == pytest.approx(np.diff(value, axis=0) / 0.005, abs=0.02)
    offsets = np.array([it.player.step(t).to_flat() for t in times.tolist()])
    assert offsets - offsets[0] == pytest.approx(value, abs=1e-9)


def test_other_channels_run_together_and_the_same_replace() -> None:
    pitch = Track("p", (KeyFrame(2.0, head_pitch_deg=5.0),), fit="slow")
    jaw = Track("j", (KeyFrame(2.0, joints_deg={"jaw": 5.0}),), fit="slow", owns=("jaw",))
    talk = Track("t", (KeyFrame(2.0, joints_deg={"jaw": 3.0}),), fit="slow")
    it = show(pitch=pitch, jaw=jaw, talk=talk)
    it.play("pitch", 0.0)
    it.play("jaw", 0.1)
    it.player.step(0.5)
    states = it.choices.states(0.5)
    assert [one.name for one in states if one.is_playing] == ["pitch", "jaw"]
    assert states[1].owns == ("jaw",)
    it.play("talk", 0.6)
    it.player.step(0.6)
    states = it.choices.states(0.6)
    assert [one.name for one in states if one.is_playing] == ["pitch", "talk"]
    assert states[1].end_reason == "another track: talk"
    assert not it.choices.ends_show(Play("talk")) and not it.choices.ends_show(Play("pitch"))
    assert it.end(0.7) == ""
    it.player.step(0.7)
    assert not [one for one in it.choices.states(0.7) if one.is_playing]
    assert it.end(0.8, "talk") == "talk is not playing; playing: none"


def test_a_jaw_that_is_interrupted_in_a_syllable_comes_to_rest_at_once() -> None:
    state = OffsetState(*np.zeros((3, 12)))
    state.value[9], state.speed[9], state.acceleration[9] = 0.152, -3.22, -140.0
    assert TrackFit(rig().names, lid_spans(rig())).fade_s(state, limits(rig().joints), 0.25) < 1.0


def test_an_owned_jaw_goes_from_the_present_angle_to_the_track_and_back() -> None:
    jaw = Track(
        "j", tuple(KeyFrame(float(s), joints_deg={"jaw": 2.0 + s % 2}) for s in range(1, 9)),
        fit="slow", owns=("jaw",), blend_in_s=0.5, blend_out_s=0.8,
    )  # fmt: skip
    it = show(jaw=jaw)
    it.play("jaw", 0.0)
    angles, index = [], 9
    for k in range(2200):
        t = k * 0.005
        it.player.step(t)
        (index,) = it.player.owned.layers or (index,)
        angles.append(it.player.owned.mix(index, radians(5.0)))
    at = np.degrees(angles)
    assert at[0] == pytest.approx(5.0) and at[-1] == pytest.approx(5.0)
    assert at[400] == pytest.approx(2.0, abs=0.01)  # of the track alone
    bound = it.bounds[rig().names.index("jaw")]
    assert np.abs(np.diff(at, 2)).max() / 0.005**2 <= np.degrees(bound.accel_rad_s2)
    assert np.abs(np.diff(at)).max() / 0.005 <= np.degrees(bound.speed_rad_s)


def test_cues_loops_and_a_clock_of_a_sound() -> None:
    frames = (KeyFrame(1.0, head_pitch_deg=3.0), KeyFrame(2.0, head_pitch_deg=0.0))
    it = show(hello=Track("h", frames, fit="slow", cues={"top": 1.0, "end": 1.9}, loop=True))
    number = it.play("hello", 0.0)
    t, cues = 0.0, list[tuple[int, str]]()
    for _ in range(1004):
        t += 0.005
        it.player.step(t)
        (state,) = it.choices.states(t)
        if not cues or state.cues != cues[-1][0]:
            cues.append((state.cues, state.cue))
    assert cues == [(0, ""), (1, "top"), (2, "end"), (3, "top"), (4, "end"), (5, "top")]
    assert state.loop and state.position_s == pytest.approx(1.02)
    it.choices.sync(SyncTrack(number, 1.12, "sound"), t)  # 0.1 s late: faster for 3.75 s
    for _ in range(800):
        t += 0.005
        it.player.step(t)
    (state,) = it.choices.states(t)
    assert state.position_s == pytest.approx((1.12 + 4.0) % 2.0, abs=0.012)
    assert state.clock == "sound"
    with pytest.raises(ValueError, match="has no cue 'no'; available: top, end"):
        it.choices.require(Play("hello", from_s="no"))
    it.play("hello", t, from_s="top")
    (playing,) = [one for one in it.choices.states(t) if one.is_playing]
    assert playing.position_s <= 1.0
    it.player.step(t + 0.5)
    (playing,) = [one for one in it.choices.states(t + 0.5) if one.is_playing]
    assert 1.0 <= playing.position_s <= 1.5 and playing.cue == "top"
