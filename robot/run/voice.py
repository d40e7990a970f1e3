"""Voice of a run: texts and files that the head says, streams, and the sounds of tracks.

A speech is prepared in the caller's thread: its samples are read, and the openings of its mouth are
computed. The order to play them contains both, so a recorded run repeats it without the sound. In
every tick the tracks are compared with the sound that is played: it starts and stops with them, and
the position that is really heard corrects the track's clock. In simulated time nothing is played.
"""

import contextlib
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from gazerig.config.rig import Rig
from gazerig.config.shipped_files import file_in_folders
from gazerig.drivers.errors import SetupError
from gazerig.drivers.sound.params import KINDS, SILENT_DEVICE
from gazerig.drivers.sound.playback import SoundEvent
from gazerig.drivers.sound.player import SoundError, SoundPlayer, check_format
from gazerig.drivers.sound.sound_file import check_sound, read_samples, write_wav
from gazerig.drivers.sound.speech import speak
from gazerig.gaze.track.animation import MOUTH
from gazerig.gaze.track.mouth import Mouth
from gazerig.gaze.track.player import SPEECH
from gazerig.gaze.track.track import FINISHED, Track
from gazerig.gaze.types import Floats
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import (
    MAX_SPEECH_S,
    Command,
    EndTrack,
    Play,
    Say,
    SetLevel,
    SyncTrack,
    check_command,
)
from gazerig.robot.model.reply import CommandTaker, TrackState

STREAM_DELAY_S = 0.15
"""Time from the arrival of a stream's first piece until it is heard."""

_STREAM, _STREAM_TRACK_S = "stream", 600.0
"""Sound and longest duration of the track of a stream."""
_WATCH_S = 0.02
_SYNC_EVERY_S, _SYNC_ERROR_S = 0.25, 0.003
_AGAIN_S = 0.1
"""Step back of a track's position with which its sound begins again, as it repeats."""
_OPEN_S = 2.0
_REPLY_S = 1.0
_ABANDONED_S = 5.0
_KEPT_FILES = 8
"""Number of texts whose sounds are kept; the newest ones may still be waiting."""
_SMOOTHING_LAG = 0.6
"""Delay of a level that is set fifty times a second, as a share of its smoothing time."""
_LEAD_IN_S = 0.05
"""Silence before a text, in which the loudspeaker starts."""


class RunVoice:
    """The voice of one head. Except ``update`` and ``stop``, any thread may call all methods.

    Args:
        command: Queues a command for the next tick.
        rig: Returns the present rig.
        clock: Clock of the loop.
        folder: Folder of the rig's file, for relative paths.
        fast: Whether time is simulated: nothing is played.
        report: Takes a line for the events of the next tick; called in ``update``.
    """

    def __init__(
        self,
        command: CommandTaker,
        rig: Callable[[], Rig],
        clock: Clock,
        folder: Path,
        fast: bool,
        report: Callable[[str], object],
    ) -> None:
        self._command, self._rig, self._clock, self._report = command, rig, clock, report
        self._folder, self._fast = folder, fast
        self._player: SoundPlayer | None = None
        self._device = ""
        self._lock = threading.RLock()
        self._closed = False
        self._played: TrackState | None = None
        self._watched_s = self._fed_s = 0.0
        self._over = False
        self._mouth: Mouth | None = None
        self._texts = tempfile.TemporaryDirectory(prefix="gazerig-voice-")
        self._count = 0

    # --- speech

    def prepare(self, command: Say, confined: bool = False) -> Play:
        """Return the command that says a file or a text.

        Args:
            command: What is said.
            confined: Whether only files in the folders of sounds may be said.

        Raises:
            ValueError: the command is invalid.
            SetupError: the file, the text or a program is not usable.
        """
        command = check_command(command)
        what, params = command.what, self._rig().sound
        if what.lower().endswith(KINDS):
            sound = check_sound(self._find(what, confined), MAX_SPEECH_S)
            samples = read_samples(sound).astype(np.float64)
            speech = self._speech(command, sound.path, samples, len(samples) / sound.duration_s)
        else:
            said = speak(what, params.voice)
            silent_s = _LEAD_IN_S + params.latency_ms / 1e3
            pcm = bytes(2 * round(silent_s * said.rate_hz)) + said.pcm
            phonemes = [(name, t_s + silent_s) for name, t_s in said.phonemes]
            path = self._write(pcm, said.rate_hz)
            speech = self._speech(command, path, _mono(pcm, 1), said.rate_hz, phonemes)
        self._open_loudspeaker(params.device)
        return speech

    def prepare_stream(
        self, pieces: Sequence[bytes], rate_hz: int, channels: int, who: str
    ) -> Play:
        """Return the command that says a whole stream, in simulated time.

        Raises:
            SoundError: the format is not possible.
        """
        check_format(rate_hz, channels)
        samples = _mono(b"".join(pieces), channels)
        return self._speech(Say(_STREAM, who=who), _STREAM, samples, rate_hz)

    def _speech(
        self, command: Say, path: str, samples: Floats, rate_hz: float,
        spoken: Sequence[tuple[str, float]] = (),
    ) -> Play:  # fmt: skip
        """Return the order to play a sound, with the openings of the mouth if the rig has one."""
        duration_s, keys = len(samples) / rate_hz, tuple[tuple[float, float], ...]()
        if self._level:
            mouth = Mouth(rate_hz)
            mouth.add(samples)
            if spoken:
                mouth.close(spoken, duration_s)
            smoothing_s = self._rig().levels[self._level].smoothing_ms / 1e3
            keys = mouth.keys(duration_s, 0.5 * smoothing_s)
        track = Track(SPEECH, sound=path, volume=command.volume)
        return Play(SPEECH, sound_s=duration_s, definition=track, mouth=keys, who=command.who)

    def _find(self, name: str, confined: bool) -> Path:
        """Return a file in the folders of sounds, or at its absolute path.

        Raises:
            SoundError: it is outside these folders, and must not be.
        """
        given = Path(name).expanduser()
        folders = [(self._folder / one).resolve() for one in self._rig().sound.folders or ("",)]
        found = [folder / given for folder in folders if (folder / given).is_file()]
        path = found[0] if found else folders[0] / given
        try:
            return Path(file_in_folders(folders, str(path))) if confined else path
        except ValueError as error:
            raise SoundError(f"{name}: {error}; see sound.folders") from None

    def _write(self, pcm: bytes, rate_hz: int) -> str:
        """Write samples to a file that exists until the run ends, or some texts later."""
        self._count += 1
        path = Path(self._texts.name) / f"{self._count % _KEPT_FILES}.wav"
        write_wav(path, pcm, rate_hz)
        return str(path)

    def _open_loudspeaker(self, device: str) -> None:
        """Open a loudspeaker, so that the sound begins with the motion.

        Raises:
            SoundError: it cannot be opened, or the run has ended.
        """
        if self._fast:
            return
        with self._lock:
            if self._closed:
                raise SoundError("the run has ended")
            player = self._player_on(device)
            player.prepare()
        end_s = self._clock.now_s() + _OPEN_S
        while not player.is_open and self._clock.now_s() < end_s:
            self._clock.sleep_until(self._clock.now_s() + _WATCH_S)
            with self._lock:
                failed = [one.reason for one in player.events() if one.kind == "failed"]
            if failed:
                raise SoundError(failed[0])

    def open(self) -> None:
        """Start the sound's process, which takes longer than a tick.

        Raises:
            SetupError: it cannot be started.
        """
        with self._lock:
            self._player_on(self._rig().sound.device).prepare()

    def _player_on(self, device: str) -> SoundPlayer:
        """Return the player of a loudspeaker instead of that of another one."""
        if self._player is not None and self._device != device:
            self._player.close()
            self._player = None
        self._device = device
        self._player = self._player or SoundPlayer(device)
        return self._player

    # --- streams

    def feed(self, pcm: bytes, rate_hz: int, channels: int, volume: float = 1.0) -> float:
        """Say a piece of a stream; the first one starts it.

        Args:
            pcm: Samples, signed, 16 bits, channels interleaved.
            rate_hz: Rate of the stream.
            channels: 1 or 2.
            volume: Factor 0..1, of the first piece; 0: the sound is heard from elsewhere, and only
                the mouth moves, without a loudspeaker.

        Returns:
            Length of the part that has not been heard yet, s.

        Raises:
            SoundError: too much is waiting, the format is not possible, or nothing can be played.
            ValueError: the head does not accept the speech.
        """
        if self._mouth is None:
            if not 0.0 <= volume <= 1.0:
                raise SoundError(f"the volume is {volume:g}: give 0..1")
            if not volume and not self._level:
                raise SoundError("this head has no level mouth, which a sound without volume moves")
            self._open_loudspeaker(self._rig().sound.device if volume else SILENT_DEVICE)
        now_s = self._clock.now_s()
        with self._lock:
            if (player := self._player) is None:
                raise SoundError("the run has ended")
            mouth = self._mouth or self._start_stream(player, rate_hz, channels, volume)
            player.feed(pcm, now_s)
            self._fed_s = now_s
            mouth.add(_mono(pcm, channels))
            return player.ahead_s(now_s)

    def _start_stream(
        self, player: SoundPlayer, rate_hz: int, channels: int, volume: float
    ) -> Mouth:
        check_format(rate_hz, channels)
        track = Track(SPEECH, sound=_STREAM)
        ticket = self._command(Play(SPEECH, sound_s=_STREAM_TRACK_S, definition=track))
        reply = ticket.wait(_REPLY_S) if ticket is not None else None
        if reply is None or reply.track is None:
            raise SoundError(reply.refused if reply is not None else "the control loop hangs")
        self._played = reply.track
        heard_s = self._clock.now_s() + STREAM_DELAY_S
        player.open_stream(rate_hz, channels, heard_s, volume * self._rig().sound.volume)
        self._mouth = Mouth(rate_hz)
        return self._mouth

    def finish(self) -> None:
        """Mark the end of the stream; what has arrived is said."""
        with self._lock:
            if self._mouth is not None and self._player is not None:
                self._player.finish_stream()

    # --- the loop's thread

    def update(self, tick: Tick) -> None:
        """Let the sound follow the tracks of a tick, and their clock the sound.

        It never waits: while another thread uses the loudspeaker, the next tick is followed.
        """
        if self._fast or not self._lock.acquire(blocking=False):
            return
        try:
            self._follow(tick)
        except (SetupError, OSError) as error:
            self._fail(str(error), tick)
        finally:
            self._lock.release()

    def _follow(self, tick: Tick) -> None:
        player, played = self._player, self._played
        if player is not None and played is not None:
            for event in player.events():
                self._handle(event, tick)
            if played.number > max([one.number for one in tick.tracks], default=0):
                return  # the tick is older than the stream
        wanted = _sounding_track(tick)
        if played is not None and (wanted is None or wanted.number != played.number):
            if player is not None and not _has_finished(played, tick):
                player.stop()
            self._played = self._mouth = None
        if wanted is None:
            return
        if wanted.sound == _STREAM:
            if player is not None and self._mouth is not None:
                self._follow_stream(self._mouth, player)
        else:
            self._follow_sound(self._player_on(self._rig().sound.device), wanted, tick)

    def _handle(self, event: SoundEvent, tick: Tick) -> None:
        if event.kind == "failed":
            self._fail(event.reason, tick)
        elif event.kind == "stalled":
            self._report("the stream has stalled: the mouth closes until it continues")
        elif event.kind == "ended":
            self._over = True
            if self._mouth is not None:
                self._mouth = None
                self._try(EndTrack(SPEECH))

    def _fail(self, reason: str, tick: Tick) -> None:
        """Report a failure once, and end the track of the sound."""
        self._report(reason)
        self._over, self._mouth = True, None
        if (failed := self._played or _sounding_track(tick)) is not None:
            self._try(EndTrack(failed.name))

    def _follow_sound(self, player: SoundPlayer, wanted: TrackState, tick: Tick) -> None:
        """Start the sound of a track, or let the track follow it."""
        before, self._played = self._played, wanted
        sound = self._rig().sound
        latency_s, now_s = sound.latency_ms / 1e3, self._clock.now_s()
        if before is None or wanted.position_s < before.position_s - _AGAIN_S:
            self._over = False
            start_s = tick.t_s - wanted.position_s - latency_s
            player.play(wanted.sound, wanted.position_s, start_s, wanted.volume * sound.volume)
            return
        heard_s = player.position_s(now_s)
        if heard_s is None or self._over or now_s - self._watched_s < _SYNC_EVERY_S:
            return
        self._watched_s = now_s
        track_s = wanted.position_s + now_s - tick.t_s
        error_s = heard_s - latency_s - track_s
        if abs(error_s) > _SYNC_ERROR_S:
            # The command is executed in the next tick.
            until_s = max(0.0, tick.t_s + 1.0 / self._rig().loop.rate_hz - now_s)
            self._try(SyncTrack(wanted.number, track_s + error_s + until_s))

    def _follow_stream(self, mouth: Mouth, player: SoundPlayer) -> None:
        """Open the mouth by the part of the stream that will be heard when it has moved."""
        now_s, rig, level = self._clock.now_s(), self._rig(), self._level
        if now_s - self._watched_s < _WATCH_S:
            return
        self._watched_s = now_s
        if now_s - self._fed_s > _ABANDONED_S and player.ahead_s(now_s) < _WATCH_S:
            player.finish_stream()
        heard_s = player.position_s(now_s)
        if level and heard_s is not None:
            ahead_s = rig.levels[level].smoothing_ms / 1e3 * _SMOOTHING_LAG + 0.5 * _WATCH_S
            ahead_s += (rig.gaze.oculomotor.eye_lag_ms - rig.sound.latency_ms) / 1e3
            self._try(SetLevel(level, mouth.opening_at(heard_s + ahead_s)))

    @property
    def _level(self) -> str:
        return MOUTH if MOUTH in self._rig().levels else ""

    def _try(self, command: Command) -> None:
        """Queue a command; a refusal is not important, as the next one follows."""
        with contextlib.suppress(ValueError):
            self._command(command)

    def stop(self) -> None:
        """Stop all sound, as the head parks."""
        self._played = self._mouth = None
        if self._player is not None:
            self._player.stop()

    def close(self) -> None:
        """End the sound and its process."""
        with self._lock:
            self._closed = True
            if self._player is not None:
                self._player.close()
            self._player = None
        self._texts.cleanup()


def _sounding_track(tick: Tick) -> TrackState | None:
    """Return the newest track whose sound is to be heard."""
    if tick.stopped:
        return None
    found = [one for one in tick.tracks if one.sound and one.is_playing and one.speed == 1.0]
    return max(found, key=lambda one: one.number, default=None)


def _has_finished(played: TrackState, tick: Tick) -> bool:
    return any(one.number == played.number and one.end_reason == FINISHED for one in tick.tracks)


def _mono(pcm: bytes, channels: int) -> Floats:
    samples = np.frombuffer(pcm, "<i2").reshape(-1, channels).mean(axis=1) / 32768.0
    return np.asarray(samples, dtype=np.float64)
