"""Tracks of a robot: the available ones, their fit to this rig, and their control."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from msgspec import Struct, structs

from gazerig.gaze.angles import norm, sub
from gazerig.gaze.mouth.mouth_keys import MouthKey
from gazerig.gaze.mouth.speech_track import SPEECH, speech_track
from gazerig.gaze.track.animation import NO_TABLES, AnimationTables
from gazerig.gaze.track.track import BLEND_OUT_S, KEEP, MAX_TRACKS, Track
from gazerig.gaze.track.track_player import TrackPlayer, Voice
from gazerig.gaze.types import ORDERED, Percept, Target, Vec3
from gazerig.robot.control.joint_latency import JointLatency
from gazerig.robot.model.commands import EndTrack, Play, Speak, SyncTrack
from gazerig.robot.model.control_source import FINISHED, SHOWN_S, TrackState
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.reply import CommandReply, TrackReply
from gazerig.robot.model.track_fit import (
    FittedTrack,
    TrackFit,
    TrackMotions,
    TrackRefused,
    track_motions,
)
from gazerig.robot.model.types import JointAngles

_MOST_KEPT = 64
"""Number of tracks with a non-default count whose curves are cached."""
_MOST_SPEECHES = 8


class TrackInfo(Struct, frozen=True):
    """A track on this rig, played from the middle of all ranges.

    Attributes:
        name: Name of the track.
        description: Its description.
        duration_s: Duration in s, 0 if it is refused.
        slowed_by: Factor by which it takes longer than defined.
        refused: Reason why this rig cannot do it, "" if it can.
        owns: Joints that gaze does not move meanwhile.
        sound: Path of its sound, "" without one.
        cues: Names and times in s of its cues.
        layers: What it moves: head, eyes, lids, gaze, expression, levels and joints by name.
    """

    name: str
    description: str
    duration_s: float = 0.0
    slowed_by: float = 1.0
    refused: str = ""
    owns: tuple[str, ...] = ()
    sound: str = ""
    cues: tuple[tuple[str, float], ...] = ()
    layers: tuple[str, ...] = ()


def _limits_text(limits: str, sound: str, speed: float) -> str:
    """Return what limits changed in a track, also that its sound is silent at other speeds."""
    silent = "without its sound, which plays at speed 1 only" if sound and speed != 1.0 else ""
    return "; ".join(filter(None, (limits, silent)))


class TrackChoices:
    """The tracks of one rig.

    Args:
        tracks: All known tracks by name.
        player: Plays them.
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
        tables: Expressions and levels of the rig.
        latency_s: Latency of joints that has not been measured yet.
        sound_s: Returns the duration of a track's sound.
        latency: Measures the latencies of the joints; None: as of joints on one bus.
    """

    def __init__(
        self,
        tracks: Mapping[str, Track],
        player: TrackPlayer,
        joints: tuple[str, ...],
        lid_spans_rad: Mapping[str, float],
        tables: AnimationTables = NO_TABLES,
        latency_s: float = 0.0,
        sound_s: Callable[[str], float] = lambda path: 0.0,
        latency: JointLatency | None = None,
    ) -> None:
        self.latency = latency or JointLatency(("",) * len(joints))
        self._tracks, self._player, self._joints = dict(tracks), player, joints
        self._tables, self._sound_s = tables, sound_s
        self._states: tuple[TrackState, ...] = ()
        self._playing: dict[int, TrackState] = {}
        self._ended: dict[int, tuple[TrackState, float]] = {}
        self._number = self._shifts = 0
        self._look: object = KEEP
        self._sounds: dict[str, float] = {}
        self._nearest: int | None = None
        self._cache: dict[tuple[str, int], TrackMotions | TrackRefused] = {}
        self._speeches: dict[Speak, TrackMotions] = {}
        self.retune(lid_spans_rad, latency_s)
        for name in tracks:
            self._motions(name, 0)

    def retune(self, lid_spans_rad: Mapping[str, float], latency_s: float) -> None:
        """Change the parameters of the next track."""
        self._latency_s = latency_s
        self._fit = TrackFit(self._joints, lid_spans_rad)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the tracks whose joints this rig has."""
        return tuple(
            name
            for name in self._tracks
            if name != SPEECH and not isinstance(self._motions(name, 0), Exception)
        )

    @property
    def playing(self) -> str:
        """Return the newest track, "" if there is none."""
        return self._player.playing

    def states(self, t_s: float) -> tuple[TrackState, ...]:
        """Return the tracks that play, and the last ones that have ended, by their numbers."""
        if not self._playing and not self._ended:
            return self._states
        voices = {voice.number: voice for voice in self._player.voices}
        for number in [number for number in self._playing if number not in voices]:
            self._end_state(number, FINISHED, t_s)
        for number, voice in voices.items():
            state, passed = self._playing[number], voice.passed
            self._playing[number] = structs.replace(
                state,
                position_s=voice.position_s(t_s) - voice.ahead_s,
                cue=passed[-1] if passed else state.cue,
                cues=state.cues + len(passed),
            )
            passed.clear()
        newest = self._number
        self._ended = {
            number: one
            for number, one in self._ended.items()
            if number == newest or t_s < one[1] + SHOWN_S
        }
        found = {number: state for number, (state, _) in self._ended.items()} | self._playing
        self._states = tuple([found[number] for number in sorted(found)])
        if not self._playing and len(self._ended) == 1:
            self._ended = {} if self._states[0].number == newest else self._ended
        return self._states

    def require(self, command: Play) -> None:
        """Check that a track exists, and compute its curves. Thread-safe.

        Raises:
            ValueError: There is no such track; the message lists the available ones.
        """
        if not command.track:
            return
        if command.track not in self._tracks:
            there = ", ".join(self.names)
            raise ValueError(f"no track {command.track!r}; available: {there}")
        made = self._motions(command.track, command.times)
        if isinstance(made, TrackRefused):
            raise ValueError(f"{command.track}: {made}")
        length_s = max(made.motion.duration_s, self._sounds.get(made.track.sound, 0.0))
        if self._start_s(command) > length_s:
            raise ValueError(f"{command.track} lasts {length_s:.2f} s: from_s must be less")

    def prepare(self, command: Speak) -> TrackMotions:
        """Return the track of a speech, which takes time. Thread-safe.

        Raises:
            ValueError: The rig has no such level.
        """
        key = structs.replace(command, lead_s=None, who="")
        if key not in self._speeches:
            if command.level and command.level not in self._tables.levels:
                raise ValueError(f"no level {command.level!r} for the mouth")
            mouth = [MouthKey(*pair) for pair in command.mouth]
            track = speech_track(
                command.sound, command.duration_s, command.level, mouth, command.volume
            )
            for old in tuple(self._speeches)[: 1 - _MOST_SPEECHES]:
                self._speeches.pop(old, None)
            self._speeches[key] = track_motions(track, self._joints, 0, self._tables)
        return self._speeches[key]

    def speak(
        self, command: Speak, t_s: float, commanded_rad: JointAngles, limits: Sequence[JointLimit]
    ) -> CommandReply:
        """Start a speech; the arguments are those of ``play``."""
        made = self.prepare(command)
        replaced = self._player.overlapping(made.motion)
        # A stream sets its level itself, so that its track does not overlap another speech.
        others = [
            voice
            for voice in self._player.voices
            if voice.played.name == SPEECH and voice not in replaced
        ]
        if others:
            self._end(others, t_s, limits, command.who)
        self._tracks[SPEECH], self._cache[SPEECH, 0] = made.track, made
        played = Play(SPEECH, who=command.who, lead_s=command.lead_s, sound_s=command.duration_s)
        return self.play(played, t_s, commanded_rad, limits)

    def measure_sound(self, command: Play | Speak) -> Play | Speak:
        """Return a command with lead and duration of a sound, which a recording needs."""
        if command.lead_s is not None:
            return command
        if isinstance(command, Speak):
            return structs.replace(command, lead_s=self.latencies_s())
        track = self._tracks.get(command.track)
        if track is None or not track.sound:
            return command
        sound_s = self._sounds.get(track.sound, 0.0)
        return structs.replace(command, lead_s=self.latencies_s(), sound_s=sound_s)

    def latencies_s(self) -> tuple[float, ...]:
        """Return the latencies of all joints, measured or assumed. Thread-safe."""
        return self.latency.estimates_s(self._latency_s)

    def all_tracks(self, limits: Sequence[JointLimit]) -> tuple[TrackInfo, ...]:
        """Return all tracks with their fit to this rig.

        Args:
            limits: Limits of the joints.
        """
        return tuple(
            self._info(name, track, limits)
            for name, track in self._tracks.items()
            if name != SPEECH
        )

    def _info(self, name: str, track: Track, limits: Sequence[JointLimit]) -> TrackInfo:
        middle = np.clip(0.0, [one.low_rad for one in limits], [one.high_rad for one in limits])
        try:
            fitted = self._fit_track(Play(name), middle, limits)
        except TrackRefused as refused:
            return TrackInfo(name, track.description, refused=str(refused))
        made = self._require_motions(name, 0)
        return TrackInfo(
            name, track.description, fitted.track.duration_s, fitted.slowed_by, "", made.owns,
            track.sound, tuple(track.cues.items()), track.layers,
        )  # fmt: skip

    def _start_s(self, command: Play) -> float:
        """Return the position at which a track begins.

        Raises:
            ValueError: It has no such cue; the message lists the available ones.
        """
        cues, start = self._tracks[command.track].cues, command.from_s
        if isinstance(start, str) and start not in cues:
            there = ", ".join(cues) or "none"
            raise ValueError(f"{command.track} has no cue {start!r}; available: {there}")
        return cues[start] if isinstance(start, str) else start

    def play(
        self, command: Play, t_s: float, commanded_rad: JointAngles, limits: Sequence[JointLimit]
    ) -> CommandReply:
        """Start a track from the joints' present angles, or end all tracks.

        Args:
            command: Track, speed and count.
            t_s: Present time.
            commanded_rad: Joint angles last sent.
            limits: Present limits of the joints.
        """
        if not command.track:
            return self._end(self._player.voices, t_s, limits, command.who)
        made = self._require_motions(command.track, command.times)
        replaced = self._player.overlapping(made.motion)
        if len(self._player.voices) - len(replaced) >= MAX_TRACKS:
            return CommandReply(f"{MAX_TRACKS} tracks are playing: end one of them first")
        state = self._player.state(t_s, replaced)
        fade_s = self._fit.fade_s(state, limits, BLEND_OUT_S)
        base = self._fit.subtract_offset(commanded_rad, self._player.state(t_s))
        try:
            fitted = self._fit_track(command, base, limits)
        except TrackRefused as refused:
            return CommandReply(f"{command.track}: {refused}")
        wait_s = self._fit.wait_s(state, fade_s, fitted.track, limits)
        self._number += 1
        track, loop = self._tracks[command.track], command.loop or made.track.loop
        for voice in replaced:
            self._end_state(voice.number, f"another track: {command.track}", t_s)
        self._player.play(
            fitted.track, self._number, t_s, fade_s, wait_s, self._start_s(command), loop
        )
        reply = TrackReply(
            command.track,
            wait_s + fitted.track.duration_s,
            fitted.slowed_by,
            fitted.slow_joint,
            fitted.reduced_joints,
            made.left_out,
            self._number,
        )
        limited = _limits_text(reply.text().partition("; ")[2], track.sound, fitted.track.speed)
        self._playing[self._number] = TrackState(
            self._number, command.track, 0.0, fitted.track.length_s, fitted.track.speed,
            loop=loop, owns=made.owns, who=command.who, sound=track.sound, limited=limited,
            since_s=t_s, volume=track.volume,
        )  # fmt: skip
        return CommandReply(track=reply)

    def ends_show(self, command: Play) -> bool:
        """Return whether a track would replace one that owns joints."""
        made = self._motions(command.track, command.times)
        return isinstance(made, TrackMotions) and any(
            voice.motion.owned for voice in self._player.overlapping(made.motion)
        )

    def end(self, command: EndTrack, t_s: float, limits: Sequence[JointLimit]) -> CommandReply:
        """End tracks that play; to end all is done with none."""
        voices = [
            voice for voice in self._player.voices if command.track in ("", voice.played.name)
        ]
        if not voices and command.track:
            there = ", ".join(voice.played.name for voice in self._player.voices) or "none"
            return CommandReply(f"{command.track} is not playing; playing: {there}")
        return self._end(voices, t_s, limits, command.who)

    def sync(self, command: SyncTrack, t_s: float) -> None:
        """Correct the position of a track by another clock; an ended track is ignored."""
        for voice in self._player.voices:
            if voice.number == command.number:
                voice.sync(t_s, command.position_s)
                state = self._playing[voice.number]
                self._playing[voice.number] = structs.replace(state, clock=command.clock)

    def _end(
        self, voices: Sequence[Voice], t_s: float, limits: Sequence[JointLimit], who: str
    ) -> CommandReply:
        """End tracks early, with a blend."""
        least_s = max([voice.played.blend_s[1] for voice in voices], default=0.0)
        fade_s = self._fit.fade_s(self._player.state(t_s, voices), limits, least_s or BLEND_OUT_S)
        for voice in voices:
            self._end_state(voice.number, f"{who or 'a user'} has ended it", t_s)
        self._player.end(voices, t_s, fade_s)
        return CommandReply(track=TrackReply("", fade_s))

    def _end_state(self, number: int, reason: str, t_s: float) -> None:
        ended = structs.replace(self._playing.pop(number), end_reason=reason)
        self._ended[number] = ended, t_s

    def drop_present(self, t_s: float) -> str:
        """Drop all tracks, as a client holds their joints or the torque is off.

        Returns:
            The names of the tracks, "" if there were none.
        """
        names = ", ".join(voice.played.name for voice in self._player.voices)
        self._player.reset()
        for number in tuple(self._playing):
            self._end_state(number, "its joints are controlled by a client or switched off", t_s)
        return names

    def target(self, chosen: Target, percept: Percept | None, p_head_m: Vec3, t_s: float) -> Target:
        """Return the gaze target of a track instead of attention's, if there is one."""
        look = self._player.look
        if look != self._look:
            self._look, self._nearest = look, None
            self._shifts += 1
        if isinstance(look, tuple):
            x, y, z = look
            return Target(
                (float(x), float(y), float(z)), (0.0, 0.0, 0.0), t_s, ORDERED, -1, 1.0, True, None,
                chosen.shift + self._shifts, "a track looks there", saliences=chosen.saliences,
            )  # fmt: skip
        if look is KEEP or look is None or percept is None:
            return chosen
        faces = {face.id: face for face in percept.faces}
        if look != "person":
            self._nearest = look if isinstance(look, int) else None
        elif self._nearest not in faces:
            near = min(faces.values(), key=lambda f: norm(sub(f.p_world_m, p_head_m)), default=None)
            self._shifts += near is not None
            self._nearest = near.id if near is not None else None
        face = faces.get(self._nearest) if self._nearest is not None else None
        if face is None:
            return chosen
        return Target(
            face.p_world_m, face.v_world_m_s, percept.captured_s, "face", face.id, 1.0, True, None,
            chosen.shift + self._shifts, f"face {face.id}: a track looks at it",
            saliences=chosen.saliences,
        )  # fmt: skip

    def _fit_track(
        self,
        command: Play,
        base_rad: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
        limits: Sequence[JointLimit],
    ) -> FittedTrack:
        name, made = command.track, self._require_motions(command.track, command.times)
        out_s = made.track.blend_out_s or BLEND_OUT_S
        lead_s = 0.0
        if command.lead_s and made.motion.channels:
            # Faster joints begin later than the slowest one.
            leads = self._fit.channel_means(command.lead_s)
            lead_s = max([leads[i] for i in made.motion.channels])
            delays = [max(0.0, lead_s - one) for one in leads]
            made = made._replace(motion=made.motion.delay(delays))
        return self._fit.fit(
            name, made, command.speed, base_rad, limits,
            (made.track.blend_in_s, out_s), lead_s, command.sound_s,
        )  # fmt: skip

    def _require_motions(self, name: str, count: int) -> TrackMotions:
        made = self._motions(name, count)
        if isinstance(made, TrackRefused):
            raise made
        return made

    def _motions(self, name: str, count: int) -> TrackMotions | TrackRefused:
        """Return the curves of a track, or the reason why this rig has none."""
        key = name, count if count != self._tracks[name].count else 0
        if key not in self._cache:
            if len(self._cache) >= len(self._tracks) + _MOST_KEPT:
                self._cache = {kept: made for kept, made in self._cache.items() if kept[1] == 0}
            track = self._tracks[name]
            if track.sound and track.sound not in self._sounds:
                self._sounds[track.sound] = self._sound_s(track.sound)
            try:
                self._cache[key] = track_motions(track, self._joints, count, self._tables)
            except TrackRefused as refused:
                self._cache[key] = refused
        return self._cache[key]
