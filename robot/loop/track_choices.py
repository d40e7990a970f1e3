"""Tracks of a robot: the available ones, their fit to this rig, and their control."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path

from msgspec import Struct, structs

from gazerig.drivers.errors import SetupError
from gazerig.drivers.sound.sound_file import check_sound
from gazerig.gaze.track.track import MAX_DURATION_S, Track
from gazerig.gaze.track.track_motion import TrackMotion
from gazerig.gaze.track.track_player import BLEND_IN_S, SPEECH, PlayingTrack, TrackPlayer
from gazerig.params import unknown_text
from gazerig.robot.model.commands import EndTrack, Play, Speak, SyncTrack
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.reply import SHOWN_S, CommandReply, TrackReply, TrackState
from gazerig.robot.model.track_fit import TrackFit, TrackRefused

_MOST_KEPT = 64
"""Number of curves that are kept for the next time."""


class TrackInfo(Struct, frozen=True):
    """A track on this rig, played from the neutral pose.

    Attributes:
        name: Name of the track.
        description: Its description.
        duration_s: Duration in s, 0 if it is refused.
        limited: Where it is slower or smaller than defined, "" if it is not.
        refused: Reason why this rig cannot do it, "" if it can.
        owns: Joints that gaze does not move meanwhile.
        sound: Path of its sound, "" without one.
        cues: Names and times in s of its cues.
    """

    name: str
    description: str
    duration_s: float = 0.0
    limited: str = ""
    refused: str = ""
    owns: tuple[str, ...] = ()
    sound: str = ""
    cues: tuple[tuple[str, float], ...] = ()


class TrackChoices:
    """The tracks of one rig.

    Args:
        tracks: All known tracks by name.
        player: Plays them.
        fit: Fits them to the rig.
        latency_s: Latency of the joints, by which motion is ahead of its sound.
        changes: Returns the tracks whose files have changed since the last call, or the fault of
            a file.
    """

    def __init__(
        self,
        tracks: Mapping[str, Track],
        player: TrackPlayer,
        fit: TrackFit,
        latency_s: float = 0.0,
        changes: Callable[[], Mapping[str, Track | str]] = dict,
    ) -> None:
        self.latency_s = latency_s
        self._tracks: dict[str, Track | str] = dict(tracks)
        self._player, self._fit = player, fit
        self._changes, self._changed = changes, set[str]()
        self._fitted = lru_cache(_MOST_KEPT)(self._fit_track)
        self._started: list[tuple[PlayingTrack, TrackState]] = []
        self._number = 0

    # --- the available ones

    def _known(self) -> dict[str, Track | str]:
        """Return all tracks, or the faults of their files, as they are now."""
        if changed := self._changes():
            self._tracks |= changed
            self._changed |= changed.keys()
            self._fitted.cache_clear()
        return self._tracks

    @property
    def names(self) -> tuple[str, ...]:
        """Return the tracks whose joints this rig has. Thread-safe."""
        found = []
        for name, track in self._known().items():
            with contextlib.suppress(TrackRefused):
                if isinstance(track, Track):
                    self._fit.rows(track)
                    found.append(name)
        return tuple(found)

    def all_tracks(self, limits: Sequence[JointLimit]) -> tuple[TrackInfo, ...]:
        """Return all tracks with their fit to this rig. Thread-safe.

        Args:
            limits: Limits of the joints.
        """
        return tuple([self._info(name, track, limits) for name, track in self._known().items()])

    def _info(self, name: str, track: Track | str, limits: Sequence[JointLimit]) -> TrackInfo:
        try:
            motion, reply = self.prepare(Play(name), limits)
        except ValueError as refused:
            description = track.description if isinstance(track, Track) else ""
            return TrackInfo(name, description, refused=str(refused))
        track = motion.track
        return TrackInfo(
            name, track.description, motion.duration_s, reply.limited, "", self._fit.owns(track),
            track.sound, tuple(track.cues.items()),
        )  # fmt: skip

    def prepare(
        self, command: Play | Speak, limits: Sequence[JointLimit]
    ) -> tuple[TrackMotion, TrackReply]:
        """Return a track's motion on this rig, which takes time at first. Thread-safe.

        Raises:
            ValueError: There is no such track or cue, or the rig cannot play the track.
        """
        if isinstance(command, Speak):
            track = Track(SPEECH, sound=command.sound, volume=command.volume)
            duration_s, level, mouth = command.duration_s, command.level, command.mouth
            motion = self._fit.speech(track, level, mouth, duration_s, limits)
            return motion, TrackReply(SPEECH, motion.duration_s)
        name, how = command.track, (command.speed, command.sound_s, tuple(limits))
        if command.definition is not None:
            return self._fit.motion(name, command.definition, how[2], *how[:2])
        return self._fitted(name, *how)

    def _fit_track(
        self, name: str, speed: float, sound_s: float, limits: tuple[JointLimit, ...]
    ) -> tuple[TrackMotion, TrackReply]:
        track = self._tracks.get(name)
        if track is None:
            raise ValueError(unknown_text("track", name, self.names))
        if isinstance(track, str):
            raise ValueError(f"{name}: {track}")
        try:
            if track.sound and not sound_s:
                sound_s = check_sound(Path(track.sound), MAX_DURATION_S).duration_s
            return self._fit.motion(name, track, limits, speed, sound_s)
        except (TrackRefused, SetupError) as refused:
            raise ValueError(f"{name}: {refused}") from None

    def require(self, command: Play | Speak, limits: Sequence[JointLimit]) -> None:
        """Check that a track can be played, and compute its curves. Thread-safe.

        Raises:
            ValueError: It cannot; the message lists the available tracks or cues.
        """
        self._known()
        if isinstance(command, Speak) or command.track:
            motion, _ = self.prepare(command, limits)
            _start_s(command, motion)

    def complete(self, command: Play, limits: Sequence[JointLimit]) -> Play:
        """Return a command with what a recording needs: the duration of a sound, a new track."""
        try:
            motion, _ = self.prepare(command, limits)
        except ValueError:  # ``play`` reports it
            return command
        new = motion.track if command.track in self._changed else command.definition
        return structs.replace(command, sound_s=motion.sound_s, definition=new)

    # --- playing

    @property
    def playing(self) -> str:
        """Return the newest track, "" if there is none."""
        playing = self._player.playing
        return playing[-1].name if playing else ""

    def states(self, t_s: float) -> tuple[TrackState, ...]:
        """Return the tracks that play, and the last ones that have ended, by their numbers."""
        shown = []
        for voice, state in self._started:
            if not state.end_reason:
                state = structs.replace(
                    state,
                    position_s=voice.position_s(t_s),
                    cue=voice.cue,
                    cues=voice.cues,
                    end_reason=voice.end_reason,
                    clock=voice.clock,
                )
            if (
                not state.end_reason
                or state.number == self._number
                or t_s < voice.ended_s + SHOWN_S
            ):
                shown.append((voice, state))
        self._started = shown
        return tuple([state for _, state in shown])

    def play(self, command: Play | Speak, t_s: float, limits: Sequence[JointLimit]) -> CommandReply:
        """Start a track, or end all tracks.

        Args:
            command: Track, speed and count, or a speech.
            t_s: Present time.
            limits: Present limits of the joints.
        """
        player, fit = self._player, self._fit
        if isinstance(command, Play) and not command.track:
            return self.end(EndTrack(who=command.who), t_s)
        try:
            motion, reply = self.prepare(command, limits)
            from_s = _start_s(command, motion)
        except ValueError as error:
            return CommandReply(str(error))
        name, track = reply.name, motion.track
        replaced = player.overlapping(motion, name)
        staying = [voice for voice in replaced if motion.owned and voice.motion.owned]
        ended = f"another track: {name}"
        player.end([voice for voice in replaced if voice not in staying], ended, t_s)
        fading = [
            voice.gone_s
            for voice in player.voices
            if voice.end_reason and not voice.motion.owned
            and voice.motion.channels & motion.channels
        ]  # fmt: skip
        begins_s = max([t_s, *fading])
        entry_s = 0.0
        if motion.owned or from_s > 0.0:
            entry_s = motion.blend_s(motion.time_at(from_s), BLEND_IN_S, rising=True)
        player.end(staying, ended, t_s, begins_s + entry_s)
        lead_s = motion.lead_s + (self.latency_s if motion.sound_s else 0.0)
        rounds = 1
        if isinstance(command, Play):
            rounds = 0 if command.loop or track.loop else max(1, command.times)
        voice = PlayingTrack(name, motion, begins_s, from_s, rounds, lead_s, entry_s)
        player.play(voice)
        self._number += 1
        duration_s = begins_s - t_s + lead_s + motion.duration_s * max(1, rounds)
        duration_s -= motion.time_at(from_s)
        reply = structs.replace(reply, duration_s=duration_s, number=self._number)
        limited = [reply.limited]
        if track.sound and motion.rate != 1.0:
            limited.append("without its sound, which plays at speed 1 only")
        state = TrackState(
            self._number, name, voice.position_s(t_s), motion.length_s, motion.rate, rounds == 0,
            fit.owns(track), command.who, track.sound, limited="; ".join(filter(None, limited)),
            volume=track.volume,
        )  # fmt: skip
        self._started.append((voice, state))
        return CommandReply(track=reply)

    def ends_show(self, command: Play, limits: Sequence[JointLimit]) -> bool:
        """Return whether a track would replace one that owns joints."""
        try:
            motion, _ = self.prepare(command, limits)
        except ValueError:
            return False
        return any(one.motion.owned for one in self._player.overlapping(motion, command.track))

    def end(self, command: EndTrack, t_s: float) -> CommandReply:
        """End tracks that play; to end all is done with none."""
        playing = self._player.playing
        voices = [voice for voice in playing if command.track in ("", voice.name)]
        if not voices and command.track:
            known = ", ".join(voice.name for voice in playing) or "none"
            return CommandReply(f"{command.track} is not playing; playing: {known}")
        fade_s = self._player.end(voices, f"{command.who or 'a user'} has ended it", t_s)
        return CommandReply(track=TrackReply("", fade_s))

    def sync(self, command: SyncTrack, t_s: float) -> None:
        """Correct the position of a track by another clock; an ended track is ignored."""
        for voice, state in self._started:
            if state.number == command.number and not voice.end_reason:
                voice.correct(t_s, command.position_s)
                voice.clock = command.clock

    def drop_present(self, t_s: float) -> str:
        """Drop all tracks, as a client holds their joints or the torque is off.

        Returns:
            The names of the tracks, "" if there were none.
        """
        playing = self._player.playing
        for voice in playing:
            voice.leave("its joints are controlled by a client or switched off", t_s, 0.0)
        self._player.reset()
        return ", ".join(voice.name for voice in playing)


def _start_s(command: Play | Speak, motion: TrackMotion) -> float:
    """Return the position at which a track begins.

    Raises:
        ValueError: There is no such cue, or it is behind the end.
    """
    if isinstance(command, Speak):
        return 0.0
    start_s, name, cues = command.from_s, command.track, motion.track.cues
    if isinstance(start_s, str):
        if start_s not in cues:
            raise ValueError(f"{name} has {unknown_text('cue', start_s, cues)}")
        start_s = cues[start_s]
    if start_s > motion.length_s:
        raise ValueError(f"{name} lasts {motion.length_s:.2f} s: from_s must be less")
    return start_s
