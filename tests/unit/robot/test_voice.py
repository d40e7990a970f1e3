"""A head that speaks: files, texts and streams as tracks with a mouth, and every end of them."""

import asyncio
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fakes.waiting import wait_for
from features_there import needs_espeak

import gazerig
from gazerig.drivers.sound.espeak import SpokenText
from gazerig.drivers.sound.sound_file import write_wav
from gazerig.errors import Refused
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import Say
from gazerig.robot.model.reply import TrackState
from gazerig.robot.run import voice

RATE = 16000
SHIPPED = Path(__file__).parents[3] / "config" / "rigs" / "expressive.yaml"
JAW_DEG = 12.0


def speech(seconds: float) -> bytes:
    """Return samples of syllables, four a second."""
    t_s = np.arange(round(seconds * RATE)) / RATE
    voice = np.sin(2 * np.pi * 1000 * t_s) * (0.5 - 0.5 * np.cos(2 * np.pi * 4 * t_s))
    return (12000 * voice).astype("<i2").tobytes()


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Return a folder with an expressive rig whose sounds are silent, and three sounds."""
    folder = tmp_path_factory.mktemp("voice")
    text = SHIPPED.read_text("utf-8").replace(
        "profile: robot", "profile: robot\nsound: {device: silent}\nloop: {rate_hz: 50}"
    )
    show = "description: x\nsound: long.wav\nframes: [{time_s: 50, head_yaw_deg: 3}]\n"
    (folder / "show.yaml").write_text(show, "utf-8")
    (folder / "rig.yaml").write_text(f"{text}\ntrack_files: [show.yaml]\n", "utf-8")
    write_wav(folder / "word.wav", speech(0.25), RATE)
    write_wav(folder / "short.wav", speech(1.5), RATE)
    write_wav(folder / "long.wav", speech(60.0), RATE)
    return folder


class Ticks:
    """Ticks of a head, by tracks and jaw."""

    def __init__(self) -> None:
        self.all: list[Tick] = []

    def speech(self) -> list[tuple[TrackState, float]]:
        found = []
        for tick in self.all:
            jaw = tick.guard_result.joints.index("jaw")
            found += [
                (one, float(np.degrees(tick.guard_result.command_rad[jaw])))
                for one in tick.tracks
                if one.name == "speech" and one.is_playing
            ]
        return found


def opened(folder: Path, ticks: Ticks | None = None, **given: Any) -> Any:
    head: Any = gazerig.open(
        str(folder / "rig.yaml"), mock=True, bus="ideal", say=lambda line: None, **given
    )
    if ticks is not None:
        update = head._feed.update

        def both(tick: Tick) -> None:
            ticks.all.append(tick)
            update(tick)

        head._feed.update = both
    return head


# --- in simulated time


@pytest.mark.parametrize("what", ["file", "stream", pytest.param("text", marks=needs_espeak)])
def test_the_jaw_follows_the_speech_and_is_shut_at_its_end(folder, what):
    ticks = Ticks()
    with opened(folder, ticks, fast=True) as head:
        if what == "stream":
            order = head.say(
                [speech(1.5)[i : i + 1280] for i in range(0, 48000, 1280)], rate_hz=RATE
            )
        else:
            order = head.say("short.wav" if what == "file" else "Mama, bob, baby, papa.")
        assert order.wait(10.0) == "arrived"
        assert order.reply.track.limited == ""
        head.step(0.5)
        said = ticks.speech()
        jaw = [angle for _, angle in said]
        assert max(jaw) > 0.5 * JAW_DEG and min(jaw) > -0.1
        assert abs(head.state.joints["jaw"].commanded_deg) < 0.1
        if what != "text":
            shut = sum(1 for a, b, c in zip(jaw, jaw[1:], jaw[2:], strict=False) if a > b <= c)
            assert 4 <= shut <= 7  # once in each of six syllables


def test_the_lips_close_on_the_phonemes_of_a_text(folder, monkeypatch):
    t_s = np.arange(2 * RATE) / RATE
    pcm = (12000 * np.sin(2 * np.pi * 1000 * t_s)).astype("<i2").tobytes()
    phonemes = [("m", 0.3), ("a", 0.4), ("b", 0.8), ("a", 0.9), ("p", 1.4), ("a", 1.42)]
    monkeypatch.setattr(voice, "speak", lambda text, name: SpokenText(pcm, RATE, phonemes))
    ticks = Ticks()
    with opened(folder, ticks, fast=True) as head:
        head.step(2.0)  # it begins gently
        assert head.say("mabapa").wait(10.0) == "arrived"
    times, jaw = np.array([(one.position_s, angle) for one, angle in ticks.speech()]).T
    silent_s = 0.05
    for middle_s in (0.332, 0.825, 1.372):
        assert np.interp(middle_s + silent_s - 0.015, times, jaw) < 0.1 * JAW_DEG
        assert np.interp(middle_s + silent_s - 0.12, times, jaw) > 0.8 * JAW_DEG


def test_what_cannot_be_said_is_refused_with_one_message(folder):
    (folder / "rig.wav").write_bytes(b"no sound")
    with opened(folder, fast=True) as head:
        for what, message in (
            ("none.wav", "there is no such file"),
            ("rig.wav", "write it again"),
            (" \n", "a text without a word is no speech"),
        ):
            with pytest.raises(Refused, match=message):
                head.say(what)


def test_clients_of_the_network_may_name_sounds_of_the_folders_only(folder, tmp_path):
    write_wav(tmp_path / "secret.wav", speech(0.5), RATE)
    with opened(folder, fast=True) as head:
        voice = head._made.voice
        said = voice.prepare(Say("short.wav"), True)
        assert said.definition.sound == str(folder / "short.wav")
        for name in (str(tmp_path / "secret.wav"), "../secret.wav"):
            with pytest.raises(
                gazerig.Error, match="only files in .* can be named here; see sound.folders"
            ):
                voice.prepare(Say(name), True)
        assert voice.prepare(Say(str(tmp_path / "secret.wav"))).sound_s == pytest.approx(0.5)


# --- in real time


@pytest.fixture(scope="module")
def speaker(folder: Path) -> Iterator[Any]:
    """A head in real time for several tests, each of which leaves it silent and free."""
    with opened(folder) as head:
        yield head


def is_playing(head: Any) -> bool:
    return any(one.is_playing for one in head.state.tracks)


def sound_s(head: Any) -> float | None:
    player = head._made.voice._player
    found: float | None = player.position_s(RealClock().now_s()) if player is not None else None
    return found


def is_silent(head: Any) -> bool:
    """Return whether the position of the sound stands still."""
    first, clock = sound_s(head), RealClock()
    clock.sleep_until(clock.now_s() + 0.1)
    return sound_s(head) == first


def test_sound_and_track_have_one_clock_and_every_end_silences_the_sound(folder):
    with opened(folder) as head:
        head.say("long.wav")
        wait_for(lambda: (sound_s(head) or 0.0) > 0.1)
        pid = head._made.voice._player.pid
        for end in (lambda: head.play(""), lambda: head.jog("neck_yaw", 1.0), head.stop):
            end()
            wait_for(lambda: is_silent(head))
            if end != head.stop:
                head.release_joints()
                head.say("long.wav")
                wait_for(lambda: not is_silent(head))
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_stream_moves_the_mouth_and_a_stall_shuts_it(speaker, monkeypatch):
    head, voice = speaker, speaker._made.voice
    abandoned_s = "gazerig.robot.run.voice._ABANDONED_S"
    monkeypatch.setattr(abandoned_s, 600.0)
    voice.feed(speech(0.5), RATE, 1)
    wait_for(lambda: head.state.joints["jaw"].commanded_deg > 0.3 * JAW_DEG)
    wait_for(lambda: any("stalled" in one.text for one in head.events(0.0)))
    wait_for(lambda: abs(head.state.joints["jaw"].commanded_deg) < 0.5)
    with pytest.raises(gazerig.Error, match="this piece is not played"):
        voice.feed(speech(5.0), RATE, 1)
    assert is_playing(head)
    monkeypatch.setattr(abandoned_s, 0.0)
    wait_for(lambda: not is_playing(head))
    voice.feed(speech(1.0), RATE, 1)
    assert head.say("word.wav").wait(20.0) == "arrived"  # it replaces the stream
    head.jog("neck_yaw", 0.0)
    with pytest.raises(gazerig.Error, match="the joints are held"):
        voice.feed(speech(0.1), RATE, 1)
    head.release_joints()


def test_a_stream_without_volume_moves_the_mouth_and_needs_no_loudspeaker(folder):
    text, rig = (folder / "rig.yaml").read_text("utf-8"), folder / "elsewhere.yaml"
    rig.write_text(text.replace("device: silent", "device: none such"), "utf-8")
    with gazerig.open(str(rig), mock=True, bus="ideal", say=lambda line: None) as head:
        pieces = [speech(0.5)[i : i + 1280] for i in range(0, 16000, 1280)]
        with pytest.raises(Refused, match="none such"):
            head.say(pieces, rate_hz=RATE)
        with pytest.raises(Refused, match="the volume is 2: give 0..1"):
            head.say(pieces, rate_hz=RATE, volume=2.0)
        thread = threading.Thread(target=lambda: head.say(pieces, rate_hz=RATE, volume=0.0))
        thread.start()
        wait_for(lambda: head.state.joints["jaw"].commanded_deg > 0.3 * JAW_DEG)
        thread.join()
        wait_for(lambda: not is_playing(head))


def test_other_programs_say_files_and_streams(speaker):
    async def say(pid: int) -> str:
        async with gazerig.aio.connect(pid) as head:
            return await head.say("word.wav")

    with gazerig.connect(os.getpid()) as head:
        assert head.say("word.wav").reply.track.name == "speech"  # type: ignore[union-attr]
        with pytest.raises(Refused, match="there is no such file"):
            head.say("none.wav")
        pieces = [speech(0.2)[i : i + 1280] for i in range(0, 6400, 1280)]
        assert head.say(pieces, rate_hz=RATE).wait() == "arrived"
        with pytest.raises(Refused, match="whole frames"):
            head._say_piece(b"a", RATE, 1, 1.0)
        wait_for(lambda: not is_playing(speaker))
    assert asyncio.run(say(os.getpid())) == "arrived"


def test_the_sound_of_a_track_file_begins_and_ends_with_it(speaker):
    head = speaker
    assert head.play("show").reply.track.duration_s >= 59.9
    wait_for(lambda: (sound_s(head) or 0.0) > 0.1)
    head.end_track("show")
    wait_for(lambda: is_silent(head))
    head.play("show", from_s=30.0)
    wait_for(lambda: (sound_s(head) or 0.0) > 30.0)
    track = head.state.tracks[-1]
    assert track.position_s == pytest.approx(sound_s(head), abs=2.0)
    head.play("show", speed=0.5)
    wait_for(lambda: is_silent(head))
    assert "without its sound, which plays at speed 1" in head.state.tracks[-1].limited
