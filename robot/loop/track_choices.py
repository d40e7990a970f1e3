"""Tracks of a robot: the available ones on this rig, and orders to play and end them."""

from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path

from msgspec import Struct, structs

from gazerig.drivers.errors import SetupError
from gazerig.drivers.sound.sound_file import check_sound
from gazerig.gaze.track.motion import Motion
from gazerig.gaze.track.player import SPEECH, TrackPlayer, TrackState, Voice
from gazerig.gaze.track.track import MAX_DURATION_S, Track
from gazerig.params import unknown_text
from gazerig.robot.model.commands import EndTrack, Play, Speak
from gazerig.robot.model.reply import CommandReply, TrackReply
from gazerig.robot.model.track_fit import Limits, TrackFit, TrackRefused

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
    description: str = ""
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

    # --- the available ones

    def all_tracks(self, limits: Limits) -> tuple[TrackInfo, ...]:
        """Return all tracks with their fit to this rig. Thread-safe."""
        self._read_changes()
        return tuple([self._info(name, limits) for name in tuple(self._tracks)])

    def _info(self, name: str, limits: Limits) -> TrackInfo:
        try:
            motion = self.motion(Play(name), limits)
        except ValueError as refused:
            return TrackInfo(
                name, getattr(self._tracks[name], "description", ""), refused=str(refused)
            )
        track = motion.track
        return TrackInfo(
            name, track.description, motion.duration_s, motion.limited, "", motion.owns,
            track.sound, tuple(track.cues.items()),
        )  # fmt: skip

    def _read_changes(self) -> None:
        if changed := self._changes():
            self._tracks |= changed
            self._changed |= changed.keys()
            self._fitted.cache_clear()

    def motion(self, command: Play | Speak, limits: Limits) -> Motion:
        """Return a track's motion on this rig, which takes time at first. Thread-safe.

        Raises:
            ValueError: There is no such track, or the rig cannot play it; the message lists the
                available tracks.
        """
        if isinstance(command, Speak):
            return self._fit.speech(command, limits)
        if command.definition is not None:
            return self._fit.motion(command.definition, limits, command.speed, command.sound_s)
        return self._fitted(command.track, command.speed, command.sound_s, tuple(limits))

    def _fit_track(self, name: str, speed: float, sound_s: float, limits: Limits) -> Motion:
        track = self._tracks.get(name)
        if track is None:
            names = [one.name for one in self.all_tracks(limits) if not one.refused]
            raise ValueError(unknown_text("track", name, names))
        try:
            if isinstance(track, str):
                raise TrackRefused(track)
            if track.sound and not sound_s:
                sound_s = check_sound(Path(track.sound), MAX_DURATION_S).duration_s
            return self._fit.motion(track, limits, speed, sound_s)
        except (TrackRefused, SetupError) as refused:
            raise ValueError(f"{name}: {refused}") from None

    def prepare(self, command: Play | Speak, limits: Limits) -> Play | Speak:
        """Return a command with what a recording needs: the duration of a sound, a new track.

        This also computes its curves. Thread-safe.

        Raises:
            ValueError: It cannot be played; the message lists the available tracks or cues.
        """
        self._read_changes()
        if isinstance(command, Speak) or not command.track:
            return command
        motion = self.motion(command, limits)
        _start_s(command, motion)
        new = motion.track if command.track in self._changed else command.definition
        return structs.replace(command, sound_s=motion.sound_s, definition=new)

    # --- playing

    def play(self, command: Play | Speak, t_s: float, limits: Limits) -> CommandReply:
        """Start a track, or end all tracks.

        Args:
            command: Track, speed and count, or a speech.
            t_s: Present time.
            limits: Present limits of the joints.
        """
        if isinstance(command, Play) and not command.track:
            return self.end(EndTrack(who=command.who), t_s)
        try:
            motion = self.motion(command, limits)
            from_s = _start_s(command, motion)
        except ValueError as error:
            return CommandReply(str(error))
        track, name, rounds, limited = motion.track, SPEECH, 1, motion.limited
        if isinstance(command, Play):
            name = command.track
            rounds = 0 if command.loop or track.loop else max(1, command.times)
        if track.sound and motion.rate != 1.0:
            limited += "; without its sound, which plays at speed 1 only"
        lead_s = motion.lead_s + (self.latency_s if motion.sound_s else 0.0)
        state = TrackState(
            0, name, 0.0, motion.length_s, motion.rate, rounds == 0, motion.owns,
            command.who, track.sound, limited=limited.removeprefix("; "), volume=track.volume,
        )  # fmt: skip
        voice = Voice(state, motion, from_s, rounds, lead_s)
        self._player.start(voice, t_s)
        duration_s = voice.begins_s - t_s + lead_s + motion.duration_s * max(1, rounds)
        duration_s -= motion.time_at(from_s)
        return CommandReply(
            track=TrackReply(name, duration_s, voice.state.limited, voice.state.number)
        )

    def ends_show(self, command: Play, limits: Limits) -> bool:
        """Return whether a track would replace one that owns joints."""
        replaced = self._player.overlapping(self.motion(command, limits), command.track)
        return any(one.motion.owned and one.state.is_playing for one in replaced)

    def end(self, command: EndTrack, t_s: float) -> CommandReply:
        """End tracks that play; to end all is done with none."""
        playing = self._player.playing
        voices = [voice for voice in playing if command.track in ("", voice.state.name)]
        if not voices and command.track:
            known = ", ".join(voice.state.name for voice in playing) or "none"
            return CommandReply(f"{command.track} is not playing; playing: {known}")
        fade_s = self._player.end(voices, f"{command.who or 'a user'} has ended it", t_s)
        return CommandReply(track=TrackReply("", fade_s))


def _start_s(command: Play | Speak, motion: Motion) -> float:
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
