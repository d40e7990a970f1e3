"""Resimulation of a recorded run: its percepts, times, commands and rng with the present models.

With the recorded configuration and code every command is bit-identical, and the joint angles are
the recorded ones. After a change the recorded angles would belong to other commands, so emulated
servos follow the commands instead (ideal ones if they were ideal).
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, NamedTuple

from msgspec import structs

from gazerig.config.load import ConfigError, load, shipped_path
from gazerig.config.rig import Rig
from gazerig.config.save_text import params_text, track_files
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import DriverError, SetupError
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.loop import LoopCount, Tick
from gazerig.robot.loop.tick import MeasuredJoints, TickRecord
from gazerig.robot.model.frames import CameraMount
from gazerig.robot.recording.body_playback import NoCamera, PlaybackBody, PlaybackPerception
from gazerig.robot.recording.read import BadRecording, RunRecording
from gazerig.robot.run.assemble import Substitutes, assemble
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run_summary import Summary
from gazerig.robot.run.session import shut_down

Joints = Literal["recorded", "emulated"]


class Resimulation(NamedTuple):
    """Result of a resimulation.

    joints: source of the joints' angles
    ticks: number of compared ticks; agreeing: number of ticks with bit-identical target, gaze and
        commands
    first_difference_s: time of the first difference from the first tick, None if all agree;
    differs: the difference there
    sent_bytes_same: whether the bytes on the emulated bus are the same too, None if unknown
    recorded_figures, rerun_figures: the figures of both (gazerig.robot.run.run_summary)
    notes: further messages for the user
    """

    joints: Joints
    ticks: int
    agreeing_ticks: int
    first_difference_s: float | None
    difference: str
    sent_bytes_same: bool | None
    recorded_figures: dict[str, object]
    rerun_figures: dict[str, object]
    notes: tuple[str, ...]

    @property
    def is_same(self) -> bool:
        """Return whether every tick is identical."""
        return self.agreeing_ticks == self.ticks


def rerun(
    recording: RunRecording,
    rig: Rig | str | None = None,
    character: str | None = None,
    joints: str | None = None,
    on_tick: Callable[[Tick], None] | None = None,
) -> Resimulation:
    """Resimulate a recorded run.

    rig: another rig, by name, by path or as an object; None: as recorded
    character: applied to it, by name or path
    joints: "recorded" (the default if nothing is changed) or "emulated"
    on_tick: receives every tick of the new run, for a recording or a report

    Raises:
        gazerig.config.load.ConfigError: the rig or character is invalid.
        SetupError: the recording cannot be read or contains no tick.
    """
    if joints not in (None, "recorded", "emulated"):
        raise SetupError(f"joints {joints}: unknown; choose recorded or emulated")
    changed = rig is not None or character is not None
    fed: Joints = "emulated" if joints == "emulated" or (joints is None and changed) else "recorded"
    with TemporaryDirectory(prefix="gazerig-rerun-") as folder:
        with_rig = _resimulation_rig(recording, rig, character, Path(folder))
        # The scene is not needed: its percepts are in the recording.
        info = recording.info
        options = RunOptions(True, True, info.seed, "visitor", bus=info.bus)
        again = _Resimulator(with_rig, options, fed, on_tick)
        try:
            return again.resimulate(recording)
        finally:
            again.close()


class _Resimulator:
    """Resimulation of one run."""

    def __init__(
        self, rig: Rig, options: RunOptions, joints: Joints, on_tick: Callable[[Tick], None] | None
    ) -> None:
        self._joints = joints
        self._on_tick = on_tick
        self._compared = _Comparison()
        self._notes: list[str] = []
        self._body: PlaybackBody | None = None
        camera = rig.camera
        self._perception = PlaybackPerception(CameraMount(camera), camera.horizontal_field_deg)
        self._made = assemble(
            rig,
            options,
            Substitutes(
                body=self._wrap_body if joints == "recorded" else lambda own: own,
                camera=lambda own: NoCamera(),
                perception=lambda own: self._perception,
            ),
        )

    def _wrap_body(self, own: Body) -> Body:
        self._body = PlaybackBody(own)
        return self._body

    def close(self) -> None:
        """End the processes started for it."""
        self._made.close()

    def resimulate(self, recording: RunRecording) -> Resimulation:
        """Resimulate the whole run and compare."""
        moments = recording.moments()
        first = next(moments, None)
        if first is None:
            raise SetupError(f"{recording.path} contains no tick: nothing can be run again")
        names, recorded = self._made.robot.body.names, first.tick.guard_result.joints
        if names != recorded:
            apart = (
                f"the rig has the joints {', '.join(names)}, the recording {', '.join(recorded)}"
            )
            if self._body is not None:
                raise SetupError(f"{apart}: use emulated servos")
            self._notes.append(apart)
        if recording.note:
            self._notes.append(recording.note)
        began_s = first.tick.t_s - first.dt_s
        starts = [one.t_s for one in first.before if isinstance(one, MeasuredJoints)]
        if not starts:
            self._notes.append("the start of the run is not in the recording: it begins")
        self._made.clock.sleep_until(starts[0] if starts else began_s)
        if self._body is not None:
            self._body.play(first)
        self._made.robot.start(self._made.clock)
        ended = self._run_ticks(chain((first,), moments))
        end = recording.end
        if ended is None and end.ran_s is not None:
            self._made.clock.sleep_until(began_s + end.ran_s)
        if self._body is not None:
            self._body.stop_playback()
        count = LoopCount(self._compared.ticks, 0, ended or end.stopped_by or "seconds")
        shut_down(self._made, count, lambda line: None)
        if ended is not None:
            self._notes.append(f"the new run ended early: {ended}")
        now = self._made.sent_bytes_digest()
        same = now == end.tx_sha256 if end.tx_sha256 else None
        return self._compared.result(self._joints, same, tuple(self._notes))

    def _run_ticks(self, moments: Iterator[TickRecord]) -> str | None:
        """Run all ticks; return the reason of an early end."""
        made = self._made
        for moment in moments:
            made.clock.sleep_until(moment.tick.t_s)
            was = moment.tick
            if self._body is not None:
                self._body.play(moment)
            self._perception.percept = was.percept
            for command in was.commands:
                try:
                    made.robot.replay_command(command)
                except ValueError as error:
                    self._notes.append(f"a command could not be given again: {error}")
            try:
                tick = made.robot.tick(was.t_s, moment.dt_s)
            except DriverError as error:
                return f"fault: {error}"
            if self._body is not None:  # events of bus and camera belong to the recorded computer
                tick = structs.replace(tick, events=was.events)
            self._compared.update(was, tick)
            if self._on_tick is not None:
                self._on_tick(tick)
            if tick.guard_result.level == "torque_off" and not tick.stopped and self._body is None:
                return f"fault: {'; '.join(tick.guard_result.critical_reasons)}"
        return None


class _Comparison:
    """Two runs, tick by tick."""

    def __init__(self) -> None:
        self.ticks = 0
        self._agreeing = 0
        self._began_s = 0.0
        self._first_s: float | None = None
        self._differs = ""
        self._was, self._is = Summary(), Summary()

    def update(self, was: Tick, now: Tick) -> None:
        """Compare a tick with the recorded one."""
        if self.ticks == 0:
            self._began_s = was.t_s
        self.ticks += 1
        self._was.update(was)
        self._is.update(now)
        pairs = zip(_Decisions._fields, _decisions(was), _decisions(now), strict=True)
        name = next((name for name, then, again in pairs if then != again), None)
        differs = f"{name}: {_describe_difference(was, now, name)}" if name is not None else ""
        if not differs:
            self._agreeing += 1
        elif self._first_s is None:
            self._first_s = was.t_s - self._began_s
            self._differs = differs

    def result(self, joints: Joints, tx_same: bool | None, notes: tuple[str, ...]) -> Resimulation:
        """Return the result."""
        return Resimulation(
            joints, self.ticks, self._agreeing, self._first_s, self._differs, tx_same,
            self._was.figures(), self._is.figures(), notes,
        )  # fmt: skip


class _Decisions(NamedTuple):
    """Decisions of a tick, as text that is equal only if every bit is equal."""

    target: str
    gaze: str
    desired: str
    command: str
    level: str


def _decisions(tick: Tick) -> _Decisions:
    # The wording of the reason may change; its content is in the saliences.
    return _Decisions(
        repr(structs.replace(tick.target, why="")),
        repr(tick.gaze),
        repr(tick.desired_rad),
        repr(tick.guard_result.command_rad),
        tick.guard_result.level,
    )


def _describe_difference(was: Tick, now: Tick, name: str) -> str:
    """Return a short text on how one part of a tick differs."""
    if name == "target":
        return f"{now.target.why}, was {was.target.why}"
    if name == "gaze":
        return f"{now.gaze.phase}, was {was.gaze.phase}"
    if name == "level":
        return f"{now.guard_result.level}, was {was.guard_result.level}"
    if was.guard_result.joints != now.guard_result.joints:
        return (
            f"joints {', '.join(now.guard_result.joints)}, was {', '.join(was.guard_result.joints)}"
        )
    then, again = was.desired_rad, now.desired_rad
    if name == "command":
        then, again = was.guard_result.command_rad, now.guard_result.command_rad
    rows = zip(now.guard_result.joints, then, again, strict=True)
    joint, old, new = next(row for row in rows if repr(row[1]) != repr(row[2]))
    return f"{joint} {new:.6f} rad, was {old:.6f}"


def _resimulation_rig(
    recording: RunRecording, rig: Rig | str | None, character: str | None, folder: Path
) -> Rig:
    """Return the rig of the resimulation: the recorded one, unless another is given."""
    if isinstance(rig, str):
        return load_rig(rig, character)
    text = params_text(rig) if rig is not None else recording.info.config_yaml
    whole = _write_text(text, folder / "recorded.yaml")
    try:
        base = rig if rig is not None else load(whole, Rig)
    except ConfigError as error:
        first = error.faults[0]
        raise BadRecording(
            f"{recording.path} was made with a configuration that this version does not support "
            f"({first.key}: {first.rule}): give another rig"
        ) from None
    found = base
    if character is not None:
        by_path = "/" in character or character.endswith((".yaml", ".yml"))
        file = Path(character) if by_path else shipped_path("characters", character)
        found = load(file, Rig, defaults=(whole,))
    if rig is None and recording.info.tracks_yaml:
        # The files of tracks may also have changed since then.
        kept = _write_text(recording.info.tracks_yaml, folder / "tracks.yaml")
        (folder / "tracks").mkdir()
        found = replace(found, track_files=track_files(kept, folder / "tracks"))
    scanpath = found.gaze.scanpath
    same_walk = rig is None and scanpath.transition_matrix == base.gaze.scanpath.transition_matrix
    if not same_walk or not recording.info.walk_yaml:
        return found
    # The walk's own file may have changed since then, or be on another computer.
    walk = str(_write_text(recording.info.walk_yaml, folder / "walk.yaml"))
    return replace(
        found, gaze=replace(found.gaze, scanpath=replace(scanpath, transition_matrix=walk))
    )


def _write_text(text: str, file: Path) -> Path:
    file.write_text(text, encoding="utf-8")
    return file
