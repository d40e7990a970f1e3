"""Sound and mouth: python tests/bench/bench_sound.py [--minutes 10] [PART ...]

drift: a sound of ten minutes, simulated and with the silent device: motion against sound
jaw: the measured jaw of emulated servos against loudness, for a file, a text and a stream
stream: the same for a stream in simulated time
lips: share of b, m and p in 200 words on which the measured jaw is closed
cost: processor and timing of the loop with and without sound

Requires espeak-ng and miniaudio. Nothing here passes or fails.
"""

import argparse
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import gazerig
from gazerig.drivers.sound.params import SoundParams
from gazerig.drivers.sound.sound_file import write_wav
from gazerig.drivers.sound.speech import SpokenText, speak
from gazerig.gaze.mouth.loudness import FRAME_S, WINDOW_S, band_pressures, loud_pressure, openings
from gazerig.gaze.mouth.mouth_keys import phoneme_closures
from gazerig.gaze.mouth.stream_mouth import StreamMouth
from gazerig.robot.app.voice import STREAM_DELAY_S, stream_ahead_s
from gazerig.robot.control.tick import Tick

RIG = Path(__file__).parents[2] / "config" / "rigs" / "expressive.yaml"
OPEN_DEG, CLOSED_SHARE, TOLERANCE_S = 12.0, 0.12, 0.02
TEXT = """
My name is Bob, and maybe you remember me from the big museum in Bremen. Before people built me, I was
a box of motors, bolts and rubber bands. My first problem was a simple one: nobody believed that a mouth
made of plastic could move like the mouth of a person. So Pamela put a small motor behind my jaw, and a
pump of patience behind my temper. Now I may complain about my bumpy bed, the bad pumpkin soup, and the
number of times that visitors press my button. Please do not press my button. Perhaps you prefer a poem
about a baby bumblebee who bumped into a bamboo boat. The bee was brave, but the boat was bigger. By
midnight the bumblebee became a member of the boat club and played the trumpet in the pub. People came
from miles about to applaud, and the mayor promised him a medal made from beeswax. In my opinion it is
the best poem ever put on paper. Maybe tomorrow I will compose a symphony for pipes, drums and a broken
laptop, because my composer, a humble amp, is improving. Be so kind and come back before my battery
becomes empty, and bring somebody who plays the bass.
"""


class Moment(NamedTuple):
    """A tick: time, positions of track and sound, measured and commanded jaw (1: open)."""

    t_s: float
    track_s: float
    sound_s: float
    measured: float
    commanded: float


class Trace:
    """Recorder of the ticks in which a speech plays."""

    def __init__(self, head: Any) -> None:
        self.moments: list[Moment] = []
        self.ticks_s: list[float] = []
        self._head = head

    def update(self, tick: Tick) -> None:
        self.ticks_s.append(tick.t_s)
        speech = [one for one in tick.tracks if one.name == "speech" and one.is_playing]
        if not speech:
            return
        voice = self._head._composed.voice
        sound_s = voice._player.position_s(tick.t_s) if voice._player is not None else None
        jaw = tick.guard_result.joints.index("jaw")
        self.moments.append(
            Moment(
                tick.t_s,
                speech[-1].position_s,
                np.nan if sound_s is None else sound_s,
                np.degrees(tick.joints.position_rad[jaw]) / OPEN_DEG,
                np.degrees(tick.guard_result.command_rad[jaw]) / OPEN_DEG,
            )
        )

    def columns(self) -> np.ndarray:
        return np.array(self.moments).T


def rig_file(folder: str) -> str:
    """Return the expressive rig with the silent device."""
    path = Path(folder, "expressive.yaml")
    text = RIG.read_text("utf-8").replace(
        "profile: robot", "profile: robot\nsound: {device: silent}"
    )
    path.write_text(text, "utf-8")
    return str(path)


def opened(folder: str, fast: bool) -> tuple[Any, Trace]:
    """Return a head and the trace of its ticks."""
    open_head: Any = gazerig.open
    head = open_head(rig_file(folder), fast=fast, mock=True, say=lambda line: print(" ", line))
    trace = Trace(head)
    target, name = (head._feed, "update") if fast else (head, "_update")
    update: Callable[[Tick], None] = getattr(target, name)

    def both(tick: Tick) -> None:
        trace.update(tick)
        update(tick)

    setattr(target, name, both)
    return head, trace


def loudness(spoken: SpokenText) -> np.ndarray:
    """Return the opening by loudness, one value per frame."""
    samples = np.frombuffer(spoken.pcm, np.int16) / 32768.0
    pressures = band_pressures(samples, spoken.rate_hz)
    return openings(pressures, loud_pressure(pressures), -30.0)


def lags_ms(
    sound_s: np.ndarray, jaw: np.ndarray, opening: np.ndarray, start_s: float
) -> np.ndarray:
    """Return the delay of the jaw behind the loudness in windows of 2 s, ms."""
    grid = np.arange(0.0, len(opening) * FRAME_S, 0.005)
    frames_s = np.arange(len(opening)) * FRAME_S + 0.5 * WINDOW_S
    smooth = np.hanning(17) / np.hanning(17).sum()
    ideal = np.convolve(np.interp(grid, frames_s, opening), smooth, mode="same")
    moved = np.interp(grid, sound_s - start_s, jaw)
    found = []
    for begin in range(60, len(grid) - 460, 400):
        part = moved[begin : begin + 400]
        if part.std() < 0.05:
            continue
        shifts = range(-50, 51)
        fits = [np.corrcoef(part, ideal[begin - k : begin - k + 400])[0, 1] for k in shifts]
        found.append(5.0 * shifts[int(np.argmax(fits))])
    return np.array(found)


def report_lags(name: str, lags: np.ndarray) -> None:
    print(
        f"{name}: jaw behind the sound, median {np.median(lags):.0f} ms, "
        f"p5 {np.quantile(lags, 0.05):.0f}, p95 {np.quantile(lags, 0.95):.0f}, "
        f"95 % within +-{np.quantile(np.abs(lags), 0.95):.0f} ms ({len(lags)} windows)"
    )


def jaw(folder: str) -> None:
    """Compare the jaw with the sound, in real time and simulated."""
    spoken = speak(TEXT, SoundParams())
    ideal = loudness(spoken)
    file = Path(folder, "speech.wav")
    write_wav(file, spoken.pcm, spoken.rate_hz)
    piece = 2 * round(0.04 * spoken.rate_hz)

    def pieces() -> Iterator[bytes]:
        begin_s = time.monotonic()
        for k, i in enumerate(range(0, len(spoken.pcm), piece)):
            yield spoken.pcm[i : i + piece]
            time.sleep(max(0.0, begin_s + 0.04 * (k + 1) - time.monotonic()))

    says: dict[str, tuple[Callable[[Any], Any], float]] = {
        "file": (lambda head: head.say(str(file)).wait(200.0), 0.0),
        "text": (lambda head: head.say(TEXT).wait(200.0), 0.05),
        "stream": (lambda head: head.say(pieces(), rate_hz=spoken.rate_hz), 0.0),
    }
    for name, (say, start_s) in says.items():
        head, trace = opened(folder, False)
        with head:
            say(head)
            head.sleep(0.5)
        _, track_s, sound_s, measured, _ = trace.columns()
        there = ~np.isnan(sound_s)
        report_lags(name, lags_ms(sound_s[there], measured[there], ideal, start_s))
        if name != "stream":
            error = 1e3 * (sound_s - track_s)[there & (track_s > 2.0)]
            print(
                f"  sound before track: {np.median(error):.1f} ms, most {np.abs(error).max():.1f}"
            )
    head, trace = opened(folder, True)
    with head:
        head.say(str(file)).wait(200.0)
    _, track_s, _, measured, _ = trace.columns()
    report_lags("simulated file", lags_ms(track_s, measured, ideal, 0.0))


def simulated_stream(folder: str) -> None:
    """Measure the mouth of a stream in simulated time, in which no tick is late."""
    spoken = speak(TEXT[:300], SoundParams())
    samples = np.frombuffer(spoken.pcm, np.int16) / 32768.0
    head, trace = opened(folder, True)
    mouth, fed, piece = StreamMouth(spoken.rate_hz, -30.0), 0, round(0.04 * spoken.rate_hz)
    heard_s, jaw_at = [], []
    with head:
        rig = head._composed.assembly.live_params.rig
        head.step(5.0)
        jaw = rig.names.index("jaw")
        lead_s = head._composed.assembly.robot.joint_latencies_s()[jaw]
        begin_s = head.time_s + STREAM_DELAY_S
        while (now_s := head.time_s - begin_s) < len(samples) / spoken.rate_hz:
            while fed / spoken.rate_hz < now_s + STREAM_DELAY_S - 0.04:
                mouth.add(samples[fed : fed + piece])
                fed += piece
            head.level("mouth", 0.9 * mouth.opening_at(now_s + stream_ahead_s(rig, lead_s)))
            for _ in range(4):
                head.step()
                heard_s.append(head.time_s - begin_s)
                jaw_at.append(head.state.joints["jaw"].measured_deg / OPEN_DEG)
    report_lags(
        "simulated stream", lags_ms(np.array(heard_s), np.array(jaw_at), loudness(spoken), 0.0)
    )


def lips(folder: str) -> None:
    """Count the closed lips on b, m and p."""
    spoken = speak(TEXT, SoundParams())
    assert spoken.phonemes is not None
    closures = phoneme_closures(spoken.phonemes, len(spoken.pcm) / 2 / spoken.rate_hz)
    file = Path(folder, "speech.wav")
    write_wav(file, spoken.pcm, spoken.rate_hz)
    print(f"{len(TEXT.split())} words, {len(closures)} b, m and p")
    for name, what, start_s in (("phonemes known", TEXT, 0.05), ("from the sound", str(file), 0.0)):
        head, trace = opened(folder, True)
        with head:
            head.say(what).wait(200.0)
        _, track_s, _, measured, commanded = trace.columns()
        for which, values, aside_s in (
            ("measured", measured, 0.0),
            ("commanded", commanded, 0.0),
            ("measured 0.15 s later, for comparison", measured, 0.15),
        ):
            shut = 0
            for one in closures:
                at_s = track_s - start_s - aside_s
                near = (at_s > one.begin_s - TOLERANCE_S) & (at_s < one.end_s + TOLERANCE_S)
                shut += bool(near.any() and values[near].min() < CLOSED_SHARE)
            print(f"{name}, {which}: {shut / len(closures):.1%} closed")


def long_sound(folder: str, minutes: float) -> tuple[Path, SpokenText]:
    """Return speech of some minutes."""
    spoken = speak(TEXT, SoundParams())
    seconds = len(spoken.pcm) / 2 / spoken.rate_hz
    whole = spoken._replace(pcm=spoken.pcm * max(1, round(60.0 * minutes / seconds)))
    file = Path(folder, "long.wav")
    write_wav(file, whole.pcm, whole.rate_hz)
    return file, whole


def processor_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def drift(folder: str, minutes: float) -> None:
    """Compare motion and sound over a long time."""
    file, whole = long_sound(folder, minutes)
    ideal = loudness(whole)
    for fast in (True, False):
        head, trace = opened(folder, fast)
        with head:
            order = head.say(str(file))
            if not fast:
                head.sleep(3.0)
                voice = head._composed.voice
                pid, began_s = voice._player.pid, time.monotonic()
                before_s = processor_s(pid)
            order.wait(60.0 * minutes + 60.0)
            if not fast:
                share = (processor_s(pid) - before_s) / (time.monotonic() - began_s)
                print(f"processor of the playback: {share:.2%} of a core")
        _, track_s, sound_s, measured, _ = trace.columns()
        if fast:
            lags = lags_ms(track_s, measured, ideal, 0.0)
        else:
            there = ~np.isnan(sound_s)
            error = 1e3 * (sound_s - track_s)[there & (track_s > 2.0)]
            parts = np.array_split(error, 10)
            print("sound - track, ms, by tenths:", [round(float(np.median(p)), 1) for p in parts])
            print(
                f"  95 % within +-{np.quantile(np.abs(error), 0.95):.1f} ms, most {np.abs(error).max():.1f}"
            )
            lags = lags_ms(sound_s[there], measured[there], ideal, 0.0)
        tenth = len(lags) // 10
        change = float(np.mean(lags[-tenth:]) - np.mean(lags[:tenth]))
        print(
            f"{'simulated' if fast else 'real'}: drift of the jaw {change:+.1f} ms in {minutes:g} min"
        )
        report_lags("  all", lags)


def cost(folder: str) -> None:
    """Measure processor and loop timing with and without sound."""
    file, _ = long_sound(folder, 1.0)
    for name in ("without", "with sound", "with a stream"):
        head, trace = opened(folder, False)
        with head:
            head.sleep(2.0)
            begin, used = len(trace.ticks_s), time.process_time()
            began_s = time.monotonic()
            if name == "with sound":
                head.say(str(file))
            elif name == "with a stream":
                pcm = [bytes(1280)] * 750
                given = {"rate_hz": 16000}
                sender = threading.Thread(target=head.say, args=(iter(pcm),), kwargs=given)
                sender.start()
            head.sleep(30.0)
            share = (time.process_time() - used) / (time.monotonic() - began_s)
            periods = 1e3 * np.diff(trace.ticks_s[begin:])
        print(
            f"{name}: processor of the program {share:.1%}; period sd {periods.std():.3f} ms, "
            f"p99 {np.quantile(periods, 0.99):.2f}, most {periods.max():.1f}"
        )


PARTS = {"jaw": jaw, "stream": simulated_stream, "lips": lips, "cost": cost}


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=["lips", "stream", "jaw", "cost", "drift"])
    parser.add_argument("--minutes", type=float, default=10.0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for part in given.parts:
            print(f"-- {part}")
            if part == "drift":
                drift(folder, given.minutes)
            else:
                PARTS[part](folder)


if __name__ == "__main__":
    main()
