"""Tracks of a robot: the available ones, their fit to this rig, and their control."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np
from msgspec import Struct, structs

from gazerig.gaze.angles import norm, sub
from gazerig.gaze.mouth.speech_track import SPEECH, speech_track
from gazerig.gaze.track.animation import NO_TABLES, AnimationTables
from gazerig.gaze.track.track import BLEND_IN_S, BLEND_OUT_S, KEEP, Track
from gazerig.gaze.track.track_motion import TrackMotion
from gazerig.gaze.track.track_player import TrackPlayer, Voice
from gazerig.gaze.types import ORDERED, Percept, Target, Vec3
from gazerig.robot.model.commands import EndTrack, Play, Speak, SyncTrack
from gazerig.robot.model.control_source import FINISHED, SHOWN_S, TrackState
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.reply import CommandReply, TrackReply
from gazerig.robot.model.track_fit import RigTrack, TrackFit, TrackRefused
from gazerig.robot.model.types import JointAngles

_MOST_KEPT = 64
"""Number of curves that are kept for the next time."""


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


class PreparedTrack(NamedTuple):
    """A track on this rig, ready to be played.

    Attributes:
        placed: Its keys.
        motion: Its curves from where it begins.
        again: Its curves when it repeats.
        sound_s: Duration of its sound, 0 without one.
        yaml: The track for a recording, if its file is newer than the run.
    """

    placed: RigTrack
    motion: TrackMotion
    again: TrackMotion
    sound_s: float = 0.0
    yaml: str = ""

    @property
    def duration_s(self) -> float:
        """Return the time from its start to the end of motion and sound."""
        more_s = max(self.motion.length_s, self.sound_s) - self.motion.position_at(
            self.motion.duration_s
        )
        return self.motion.duration_s + max(0.0, more_s) / self.motion.speed


class TrackFiles(Protocol):
    """Files of tracks, which may change during a run."""

    def changes(self) -> Mapping[str, Track | str]:
        """Return tracks whose files have changed since the last call, or the fault of a file."""
        ...

    def to_text(self, track: Track) -> str:
        """Return a track as YAML."""
        ...

    def from_text(self, text: str) -> Track:
        """Return the track of a YAML text, which a recording holds."""
        ...


class TrackChoices:
    """The tracks of one rig.

    Args:
        tracks: All known tracks by name.
        player: Plays them.
        joints: Joints of the rig, in the order of all sequences of joints.
        lid_spans_rad: Range of each lid from shut to open, by joint.
        tables: Expressions and levels of the rig.
        latency_s: Latency of the joints.
        sound_s: Returns the duration of a track's sound.
        files: Files of tracks, None for a rig without them.
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
        files: TrackFiles | None = None,
    ) -> None:
        self._tracks: dict[str, Track | str] = dict(tracks)
        self._player, self._joints, self._tables = player, joints, tables
        self._sound_s, self._files = sound_s, files
        self._changed: set[str] = set()
        self._playing: dict[int, TrackState] = {}
        self._ended: dict[int, tuple[TrackState, float]] = {}
        self._number = self._shifts = 0
        self._look: object = KEEP
        self._nearest: int | None = None
        self._lid_spans_rad: Mapping[str, float] | None = None
        self.retune(lid_spans_rad, latency_s)

    def retune(self, lid_spans_rad: Mapping[str, float], latency_s: float) -> None:
        """Change the parameters of the next track."""
        self._latency_s = latency_s
        if lid_spans_rad != self._lid_spans_rad:  # else what is prepared stays
            self._lid_spans_rad = lid_spans_rad
            self._fit = TrackFit(self._joints, lid_spans_rad, self._tables)
            self._prepared: dict[object, PreparedTrack] = {}
            self._names: tuple[str, ...] | None = None

    # --- the available ones

    def _read_files(self) -> None:
        """Take over tracks whose files have changed."""
        if self._files is not None and (changed := self._files.changes()):
            self._tracks |= changed
            self._changed |= changed.keys()
            self._prepared, self._names = {}, None

    @property
    def names(self) -> tuple[str, ...]:
        """Return the tracks whose joints this rig has. Thread-safe."""
        self._read_files()
        if self._names is None:
            found = []
            for name, track in self._tracks.items():
                with contextlib.suppress(TrackRefused):
                    if isinstance(track, Track) and self._fit.place(track):
                        found.append(name)
            self._names = tuple(found)
        return self._names

    def all_tracks(self, limits: Sequence[JointLimit]) -> tuple[TrackInfo, ...]:
        """Return all tracks with their fit to this rig. Thread-safe.

        Args:
            limits: Limits of the joints.
        """
        self._read_files()
        return tuple([self._info(name, limits) for name in self._tracks])

    def _info(self, name: str, limits: Sequence[JointLimit]) -> TrackInfo:
        track = self._tracks[name]
        if isinstance(track, str):
            return TrackInfo(name, "", refused=track)
        middle = np.clip(0.0, [one.low_rad for one in limits], [one.high_rad for one in limits])
        try:
            found = self.prepare(Play(name), limits)
            self._fit.sizes(found.placed, middle, limits)
        except ValueError as refused:
            return TrackInfo(name, track.description, refused=str(refused))
        return TrackInfo(
            name, track.description, found.duration_s, found.motion.slowed_by, "",
            found.placed.owns, track.sound, tuple(track.cues.items()), track.layers,
        )  # fmt: skip

    def prepare(self, command: Play | Speak, limits: Sequence[JointLimit]) -> PreparedTrack:
        """Return a track's motion on this rig, which takes time at first. Thread-safe.

        Raises:
            ValueError: There is no such track, cue or level, or the rig cannot play the track.
        """
        key = structs.replace(command, lead_s=None, who="")
        if isinstance(key, Play):
            key = structs.replace(key, sound_s=0.0)
            if key.track in self._changed:  # its text is only for the recording
                key = structs.replace(key, yaml="")
        found = self._prepared.get((key, tuple(limits)))
        if found is not None:
            return found
        if isinstance(command, Play):
            found = self._prepare_track(command, limits)
        else:
            track = speech_track(
                command.sound, command.duration_s, command.level, command.mouth, command.volume
            )
            placed = self._fit.place(track)
            motion = self._fit.motion(placed, limits)
            found = PreparedTrack(placed, motion, motion, command.duration_s)
        if len(self._prepared) >= _MOST_KEPT:
            self._prepared = {}
        self._prepared[key, tuple(limits)] = found
        return found

    def _prepare_track(self, command: Play, limits: Sequence[JointLimit]) -> PreparedTrack:
        name = command.track
        files = self._files
        track = files.from_text(command.yaml) if files and command.yaml else self._tracks.get(name)
        if track is None:
            known = ", ".join(self.names)
            raise ValueError(f"no track {name!r}; available: {known}")
        if isinstance(track, str):
            raise ValueError(f"{name}: {track}")
        start_s = command.from_s
        if isinstance(start_s, str):
            if start_s not in track.cues:
                known = ", ".join(track.cues) or "none"
                raise ValueError(f"{name} has no cue {start_s!r}; available: {known}")
            start_s = track.cues[start_s]
        try:
            placed = self._fit.place(track, command.times)
            sound_s = command.sound_s
            if track.sound and not sound_s:
                sound_s = self._sound_s(track.sound)
        except TrackRefused as refused:
            raise ValueError(f"{name}: {refused}") from None
        motion = again = self._fit.motion(placed, limits, command.speed)
        if start_s > 0.0:
            motion = self._fit.motion(placed, limits, command.speed, start_s)
            length_s = max(again.length_s, sound_s)
            if start_s > length_s:
                raise ValueError(f"{name} lasts {length_s:.2f} s: from_s must be less")
        text = files.to_text(track) if files and name in self._changed else ""
        return PreparedTrack(placed, motion, again, sound_s, text)

    def require(self, command: Play | Speak, limits: Sequence[JointLimit]) -> None:
        """Check that a track can be played, and compute its curves. Thread-safe.

        Raises:
            ValueError: It cannot; the message lists the available tracks or cues.
        """
        self._read_files()
        if isinstance(command, Speak) or command.track:
            self.prepare(command, limits)

    def complete(self, command: Play | Speak, limits: Sequence[JointLimit]) -> Play | Speak:
        """Return a command with what a recording needs: lead and duration of a sound, its file."""
        if command.lead_s is not None or not (isinstance(command, Speak) or command.track):
            return command
        if isinstance(command, Speak):
            return structs.replace(command, lead_s=self.latencies_s())
        try:
            found = self.prepare(command, limits)
        except ValueError:  # ``play`` reports it
            return command
        if found.sound_s:
            command = structs.replace(command, lead_s=self.latencies_s(), sound_s=found.sound_s)
        return structs.replace(command, yaml=found.yaml) if found.yaml else command

    def latencies_s(self) -> tuple[float, ...]:
        """Return the latencies of all joints. Thread-safe."""
        return (self._latency_s,) * len(self._joints)

    # --- playing

    @property
    def playing(self) -> str:
        """Return the newest track, "" if there is none."""
        return self._player.playing

    def states(self, t_s: float) -> tuple[TrackState, ...]:
        """Return the tracks that play, and the last ones that have ended, by their numbers."""
        if not self._playing and not self._ended:
            return ()
        voices = {voice.number: voice for voice in self._player.voices}
        for number in self._playing.keys() - voices.keys():
            self._end_state(number, FINISHED, t_s)
        for number, voice in voices.items():
            state, passed = self._playing[number], voice.passed
            self._playing[number] = structs.replace(
                state,
                position_s=voice.position_s(t_s),
                cue=passed[-1] if passed else state.cue,
                cues=state.cues + len(passed),
            )
            passed.clear()
        self._ended = {
            number: (state, end_s)
            for number, (state, end_s) in self._ended.items()
            if number == self._number or t_s < end_s + SHOWN_S
        }
        found = {number: state for number, (state, _) in self._ended.items()} | self._playing
        return tuple([found[number] for number in sorted(found)])

    def play(
        self, command: Play | Speak, t_s: float, commanded_rad: JointAngles,
        limits: Sequence[JointLimit],
    ) -> CommandReply:  # fmt: skip
        """Start a track from the joints' present angles, or end all tracks.

        Args:
            command: Track, speed and count, or a speech.
            t_s: Present time.
            commanded_rad: Joint angles last sent.
            limits: Present limits of the joints.
        """
        name = SPEECH if isinstance(command, Speak) else command.track
        if not name:
            return self._end(self._player.voices, t_s, limits, command.who)
        player, fit = self._player, self._fit
        base_rad = fit.subtract_offset(commanded_rad, player.state(t_s))
        try:
            found = self.prepare(command, limits)
            sizes, reduced = fit.sizes(found.placed, base_rad, limits)
        except TrackRefused as refused:
            return CommandReply(f"{name}: {refused}")
        except ValueError as error:
            return CommandReply(str(error))
        track, motion = found.placed.track, found.motion
        loop = track.loop or (isinstance(command, Play) and command.loop)
        replaced = player.overlapping(motion, name)
        state = player.state(t_s, replaced)
        fade_s = fit.fade_s(state, limits, BLEND_OUT_S)
        self._number += 1
        voice = Voice(
            self._number, name, motion, sizes.tolist(), partial(fit.move_s, limits=limits),
            fit.channel_means(command.lead_s) if command.lead_s else (), found.sound_s,
            found.again if loop else None,
        )  # fmt: skip
        wait_s = fit.wait_s(state, fade_s, motion, limits) if state.any() else 0.0
        voice.begins_s = t_s + wait_s
        if motion.owned:
            voice.entry_s = max(BLEND_IN_S, fit.entry_s(motion, base_rad, limits))
        for one in replaced:
            self._end_state(one.number, f"another track: {name}", t_s)
        player.play(voice, t_s, fade_s)
        reply = structs.replace(
            fit.reply(name, found.placed, motion, reduced),
            duration_s=wait_s + found.duration_s,
            number=self._number,
        )
        limited = [reply.text().partition("; ")[2]]
        if track.sound and motion.rate != 1.0:
            limited.append("without its sound, which plays at speed 1 only")
        self._playing[self._number] = TrackState(
            self._number, name, voice.position_s(t_s), voice.length_s, motion.rate, loop=loop,
            owns=found.placed.owns, who=command.who, sound=track.sound,
            limited="; ".join(filter(None, limited)), since_s=t_s, volume=track.volume,
        )  # fmt: skip
        return CommandReply(track=reply)

    def ends_show(self, command: Play, limits: Sequence[JointLimit]) -> bool:
        """Return whether a track would replace one that owns joints."""
        try:
            motion = self.prepare(command, limits).motion
        except ValueError:
            return False
        return any(one.motion.owned for one in self._player.overlapping(motion, command.track))

    def end(self, command: EndTrack, t_s: float, limits: Sequence[JointLimit]) -> CommandReply:
        """End tracks that play; to end all is done with none."""
        voices = [voice for voice in self._player.voices if command.track in ("", voice.name)]
        if not voices and command.track:
            known = ", ".join(voice.name for voice in self._player.voices) or "none"
            return CommandReply(f"{command.track} is not playing; playing: {known}")
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
        fade_s = self._fit.fade_s(self._player.state(t_s, voices), limits, BLEND_OUT_S)
        for voice in voices:
            self._end_state(voice.number, f"{who or 'a user'} has ended it", t_s)
        self._player.end(voices, t_s, fade_s)
        return CommandReply(track=TrackReply("", fade_s))

    def _end_state(self, number: int, reason: str, t_s: float) -> None:
        self._ended[number] = structs.replace(self._playing.pop(number), end_reason=reason), t_s

    def drop_present(self, t_s: float) -> str:
        """Drop all tracks, as a client holds their joints or the torque is off.

        Returns:
            The names of the tracks, "" if there were none.
        """
        names = ", ".join(voice.name for voice in self._player.voices)
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
        if look is KEEP or look is None:
            return chosen
        if isinstance(look, tuple):
            x, y, z = map(float, look)
            seen = (x, y, z), (0.0, 0.0, 0.0), t_s, ORDERED, -1
            why = "a track looks there"
        else:
            faces = {face.id: face for face in percept.faces} if percept is not None else {}
            if isinstance(look, int):
                self._nearest = look
            elif faces and self._nearest not in faces:
                self._nearest = min(faces, key=lambda i: norm(sub(faces[i].p_world_m, p_head_m)))
                self._shifts += 1
            if percept is None or self._nearest not in faces:
                return chosen
            face = faces[self._nearest]
            seen = face.p_world_m, face.v_world_m_s, percept.captured_s, "face", face.id
            why = f"face {face.id}: a track looks at it"
        return Target(
            *seen, 1.0, True, None, chosen.shift + self._shifts, why, saliences=chosen.saliences
        )
