"""Playback of sounds: time of each part, position, files, speech programs and the process."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from features_there import needs_espeak

from gazerig.drivers.sound import espeak
from gazerig.drivers.sound.params import SILENT_DEVICE
from gazerig.drivers.sound.playback import PcmQueue, Playback, PlayedSound, SoundEvent
from gazerig.drivers.sound.player import MAX_AHEAD_S, SoundError, SoundPlayer
from gazerig.drivers.sound.sound_file import check_sound, write_wav
from gazerig.drivers.sound.speech import MAX_CHARACTERS, speak
from gazerig.robot.model.clock import RealClock

RATE = 48000
PERIOD = 480
LATENCY_S = 0.02


class Loudspeaker:
    """A device of simulated time, which hears each buffer after the latency."""

    def __init__(self) -> None:
        self.records: list[PlayedSound] = []
        self.events: list[SoundEvent] = []
        self.playback = Playback(RATE, 1, LATENCY_S, self.take)
        self.heard: list[np.ndarray] = []
        self.requests = 0

    def take(self, event: PlayedSound | SoundEvent) -> None:
        if isinstance(event, PlayedSound):
            self.records.append(event)
        else:
            self.events.append(event)

    def run(self, seconds: float, late_s: float = 0.0) -> None:
        for _ in range(round(seconds * RATE / PERIOD)):
            now_s = self.requests * PERIOD / RATE + late_s * (self.requests % 7 == 3)
            data = self.playback.fill(PERIOD, now_s)
            assert len(data) == 2 * PERIOD
            self.heard.append(np.frombuffer(data, np.int16))
            self.requests += 1

    def heard_at(self, t_s: float) -> int:
        return int(np.concatenate(self.heard)[round((t_s - LATENCY_S) * RATE)])


def ramp(seconds: float) -> PcmQueue:
    """Return a source whose sample k has the value k / 10."""
    queue = PcmQueue(2)
    queue.add((np.arange(round(seconds * RATE)) // 10).astype(np.int16).tobytes())
    return queue


@pytest.mark.parametrize("late_s", [0.0, 0.008])
@pytest.mark.parametrize("start_s", [-0.1, 0.0, 0.5])
def test_each_sample_is_heard_at_its_time_also_if_the_start_is_late_or_requests_are(
    start_s, late_s
):
    device = Loudspeaker()
    source = ramp(2.0)
    source.finish()
    device.playback.play(1, source, 0.0, start_s, 1.0)
    device.run(1.5, late_s)
    for t_s in (0.7, 1.0, 1.4):
        assert device.heard_at(t_s) == pytest.approx((t_s - start_s) * RATE / 10, abs=2)
        assert device.records[-1].position_s(t_s) == pytest.approx(t_s - start_s, abs=1e-3)
    device.run(1.5, late_s)
    assert [one.kind for one in device.events] == ["started", "ended"]
    assert device.records[-1].position_s(9.0) == pytest.approx(2.0, abs=1e-3)


def test_a_stalled_stream_stops_the_position_is_reported_once_and_continues():
    device, queue = Loudspeaker(), ramp(0.3)
    device.playback.play(1, queue, 0.0, 0.0, 1.0)
    device.run(0.8)
    assert [one.kind for one in device.events] == ["started", "stalled"]
    assert device.records[-1].position_s(0.8) == pytest.approx(0.3, abs=0.001)
    queue.add(bytes(RATE))
    queue.finish()
    device.run(0.2)
    assert device.records[-1].position_s(1.0) == pytest.approx(0.5, abs=0.03)


def test_a_stop_fades_out_within_one_buffer_also_before_the_start():
    device = Loudspeaker()
    device.playback.play(1, ramp(2.0), 0.0, 0.0, 1.0)
    device.run(0.5)
    device.playback.stop()
    device.run(0.1)
    last = device.heard[50]
    assert last[0] > 0 and last[-1] == 0 and not device.heard[51].any()
    device.playback.play(2, ramp(2.0), 0.0, 99.0, 1.0)
    device.playback.stop()
    device.run(0.1)
    assert not device.playback.is_playing


def test_a_late_stream_loses_nothing_and_the_volume_is_a_factor():
    device = Loudspeaker()
    device.playback.play(1, ramp(1.0), 0.0, -0.5, 0.5, skips=False)
    device.run(0.5)
    assert device.heard_at(LATENCY_S + 0.1) == pytest.approx(0.05 * RATE / 10, abs=1)
    assert device.records[-1].position_s(0.2) == pytest.approx(0.2 - LATENCY_S, abs=0.001)


# --- files


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sounds")
    tone = (9000 * np.sin(np.arange(16000) * 0.2)).astype(np.int16).tobytes()
    write_wav(folder / "good.wav", tone, 16000)
    write_wav(folder / "slow.wav", tone, 8000)
    write_wav(folder / "seven.wav", bytes(14000), 16000, 7)
    (folder / "cut.wav").write_bytes((folder / "good.wav").read_bytes()[:9000])
    for name in ("bad.mp3", "text.txt"):
        (folder / name).write_bytes(b"no sound" * 50)
    return folder


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.wav", "there is no such file"),
        ("text.txt", "a sound is a file .wav, .flac, .mp3, .ogg; convert it"),
        ("bad.mp3", "write it again"),
        ("cut.wav", "is cut off: it is shorter than its header states; write it again"),
        ("seven.wav", "has 7 channels; write it with 1 or 2"),
        ("slow.wav", "lasts 2 s, more than 1 s; divide it"),
    ],
)
def test_a_bad_file_is_one_message_with_its_name_and_the_remedy(folder, name, message):
    with pytest.raises(SoundError) as told:
        check_sound(folder / name, 1.0)
    assert str(told.value).startswith(f"{folder / name}: ")
    assert str(told.value).endswith(message) and "\n" not in str(told.value)


# --- speech programs


@needs_espeak
def test_espeak_reports_the_time_of_each_phoneme():
    spoken = speak("a mama", "en-us")
    names = [name for name, _ in spoken.phonemes]
    times = [begin_s for _, begin_s in spoken.phonemes]
    assert names.count("m") == 2 and times == sorted(times)
    assert times[-1] <= len(spoken.pcm) / 2 / spoken.rate_hz
    with pytest.raises(SoundError, match="no voice 'xx-yy'; list them with: espeak-ng --voices"):
        speak("a mama", "xx-yy")


def test_a_missing_library_and_bad_texts_are_one_message(monkeypatch):
    monkeypatch.setattr(espeak, "_LIBRARY", "none such")
    missing = espeak.synthesise("hello", "en-us")
    assert isinstance(missing, str) and missing.startswith("espeak-ng is not installed")
    assert missing.endswith(": apt install espeak-ng")
    with pytest.raises(SoundError, match="at most 5000 characters, not 5001"):
        speak("a" * (MAX_CHARACTERS + 1), "en-us")


# --- the process


@pytest.fixture
def player() -> Iterator[SoundPlayer]:
    player = SoundPlayer(SILENT_DEVICE)
    yield player
    player.close()


def wait_for(player: SoundPlayer, kind: str) -> SoundEvent:
    """Return the first event of a kind."""
    clock = RealClock()
    found: list[SoundEvent] = []
    for _ in range(2000):
        found += player.events()
        for event in found:
            if event.kind == kind:
                return event
        clock.sleep_until(clock.now_s() + 0.01)
    raise AssertionError(f"no event {kind}: {found}")


def test_the_process_plays_files_and_streams_and_restarts_after_its_death(player, folder):
    clock = RealClock()
    player.play(str(folder / "good.wav"), 0.5, clock.now_s())
    assert player.position_s(clock.now_s()) is None
    wait_for(player, "started")
    positions = [player.position_s(clock.now_s()) for _ in range(1000)]
    assert None not in positions and positions == sorted(positions)
    wait_for(player, "ended")
    assert player.position_s(clock.now_s()) == pytest.approx(1.0, abs=0.01)

    player.open_stream(16000, 1, clock.now_s() + 0.1)
    for _ in range(5):
        player.feed(bytes(1280), clock.now_s())
    with pytest.raises(SoundError, match="this piece is not played"):
        player.feed(bytes(round(32000 * MAX_AHEAD_S)), clock.now_s())
    with pytest.raises(SoundError, match="give whole frames of 2 bytes"):
        player.feed(bytes(641), clock.now_s())
    wait_for(player, "stalled")
    assert player.position_s(clock.now_s()) == pytest.approx(0.2, abs=0.01)
    player.finish_stream()
    wait_for(player, "ended")

    assert player.pid is not None
    os.kill(player.pid, signal.SIGKILL)
    assert "ended (SIGKILL): the next sound starts it again" in wait_for(player, "failed").reason
    player.play(str(folder / "good.wav"), 0.0, clock.now_s())
    wait_for(player, "started")


def test_the_process_ends_with_its_link_and_names_a_missing_loudspeaker(folder):
    player = SoundPlayer("no such loudspeaker")
    player.play(str(folder / "good.wav"), 0.0, 0.0)
    reason = wait_for(player, "failed").reason
    assert "no loudspeakers are named 'no such loudspeaker'; available: " in reason
    pid = player.pid
    assert pid is not None
    player.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


_KILLED = """
import os, sys
from gazerig.drivers.sound.player import SoundPlayer
player = SoundPlayer("silent")
player.prepare()
while not player.is_open:
    player.events()
print(player.pid, flush=True)
os.kill(os.getpid(), 9)
"""


def test_the_process_ends_with_a_killed_program():
    done = subprocess.run([sys.executable, "-c", _KILLED], capture_output=True, text=True)
    assert done.returncode == -signal.SIGKILL
    clock = RealClock()
    for _ in range(1000):
        if not Path(f"/proc/{int(done.stdout)}").exists():
            return
        clock.sleep_until(clock.now_s() + 0.01)
    raise AssertionError("the sound's process still runs")


@pytest.mark.parametrize(("rate_hz", "channels"), [(1000, 1), (16000, 3), (500_000, 1)])
def test_a_stream_of_another_format_is_refused(player, rate_hz, channels):
    with pytest.raises(SoundError, match="give 1 or 2 channels at 8000..192000 Hz"):
        player.open_stream(rate_hz, channels, 0.0)
