"""Rerun of a recorded run: its percepts, times, commands and seed with the present models.

The joint angles are the recorded ones. With the recorded code every command is bit-identical.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from msgspec import structs

from gazerig.config.load import ConfigError, load
from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.loop import Tick
from gazerig.robot.loop.power_down import Interrupts
from gazerig.robot.loop.tick import MeasuredJoints
from gazerig.robot.recording.body_playback import NoCamera, PlaybackBody, PlaybackPerception
from gazerig.robot.recording.read import BadRecording, RunRecording
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.session import prepare_shutdown


class Rerun(NamedTuple):
    """Result of a rerun.

    ticks: number of compared ticks; agreeing_ticks: number of ticks with bit-identical target, gaze
        and commands
    first_difference_s: time of the first difference from the first tick, None if all agree;
    difference: what differs there, "" if all agree
    sent_bytes_same: whether the bytes on the emulated bus are the same too, None if unknown
    notes: further messages for the user
    """

    ticks: int
    agreeing_ticks: int
    first_difference_s: float | None
    difference: str
    sent_bytes_same: bool | None
    notes: tuple[str, ...]

    @property
    def is_same(self) -> bool:
        """Return whether every tick is identical."""
        return self.agreeing_ticks == self.ticks


def rerun(recording: RunRecording, on_tick: Callable[[Tick], None] | None = None) -> Rerun:
    """Run a recording again.

    Args:
        recording: The recorded run.
        on_tick: Receives every tick of the new run.

    Raises:
        SetupError: the recording cannot be read or contains no tick.
    """
    with TemporaryDirectory(prefix="gazerig-rerun-") as folder:
        played: list[PlaybackBody] = []

        def wrap(body: Body) -> Body:
            played[:] = [PlaybackBody(body)]
            return played[0]

        options = RunOptions(True, True, recording.info.seed, bus=recording.info.bus)
        rig = _recorded_rig(recording, Path(folder))
        run = Run(rig, options, camera=NoCamera(), wrap_body=wrap)
        try:
            return _rerun(recording, run, played[0], on_tick)
        finally:
            run.close()


def _rerun(
    recording: RunRecording,
    run: Run,
    body: PlaybackBody,
    on_tick: Callable[[Tick], None] | None,
) -> Rerun:
    """Run all ticks again and compare them."""
    notes = [recording.note] if recording.note else []
    moments = recording.moments()
    first = next(moments, None)
    if first is None:
        raise SetupError(f"{recording.path} contains no tick: nothing can be run again")
    began_s = first.tick.t_s - first.dt_s
    starts = [one.t_s for one in first.before if isinstance(one, MeasuredJoints)]
    if not starts:
        notes.append("the start of the run is not in the recording")
    perception = PlaybackPerception(run.view.mount, run.view.params.horizontal_field_deg)
    run.robot.perception = perception
    run.clock.sleep_until(starts[0] if starts else began_s)
    body.play(first)
    run.robot.start(run.clock)
    ticks = agreeing = 0
    first_s, difference = None, ""
    for moment in chain((first,), moments):
        was = moment.tick
        run.clock.sleep_until(was.t_s)
        body.play(moment)
        perception.percept = was.percept
        for command in was.commands:
            run.robot.replay_command(command)
        # Events of bus and camera belong to the recorded computer.
        tick = structs.replace(run.robot.tick(was.t_s, moment.dt_s), events=was.events)
        if on_tick is not None:
            on_tick(tick)
        ticks += 1
        differs = _difference(was, tick)
        agreeing += not differs
        if differs and first_s is None:
            first_s, difference = was.t_s - first.tick.t_s, differs
    end = recording.end
    if end.ran_s is not None:
        run.clock.sleep_until(began_s + end.ran_s)
    body.stop_playback()
    prepare_shutdown(run, lambda line: None, Interrupts()).shut_down()
    same = run.bus.sent_bytes_digest() == end.tx_sha256 if end.tx_sha256 else None
    return Rerun(ticks, agreeing, first_s, difference, same, tuple(notes))


def _difference(was: Tick, now: Tick) -> str:
    """Return the names of the decisions of a tick of which a bit differs, "" if none does."""
    pairs = zip(_decisions(was).items(), _decisions(now).values(), strict=True)
    return ", ".join(name for (name, then), again in pairs if then != again)


def _decisions(tick: Tick) -> dict[str, str]:
    """Return the decisions of a tick, as text that is equal only if every bit is equal."""
    # The wording of the reason may change; its content is in the saliences.
    return {
        "target": repr(structs.replace(tick.target, why="")),
        "gaze": repr(tick.gaze),
        "desired angles": repr(tick.desired_rad),
        "commanded angles": repr(tick.guard_result.command_rad),
        "level": tick.guard_result.level,
    }


def _recorded_rig(recording: RunRecording, folder: Path) -> Rig:
    """Return the recorded rig.

    Its walk and tracks are the recorded ones, as their files may have changed since then, or be on
    another computer.
    """
    info = recording.info
    whole = _write_text(info.config_yaml, folder / "recorded.yaml")
    try:
        rig = load(whole, Rig)
    except ConfigError as error:
        first = error.faults[0]
        raise BadRecording(
            f"{recording.path} was made with a configuration that this version does not support "
            f"({first.key}: {first.rule})"
        ) from None
    tracks = {name: folder / f"{name}.yaml" for name in info.tracks}
    files = [str(_write_text(info.tracks[name], file)) for name, file in tracks.items()]
    rig = replace(rig, track_files=tuple(files))
    if info.walk_yaml:
        file = str(_write_text(info.walk_yaml, folder / "walk.yaml"))
        scanpath = replace(rig.gaze.scanpath, transition_matrix=file)
        rig = replace(rig, gaze=replace(rig.gaze, scanpath=scanpath))
    return rig


def _write_text(text: str, file: Path) -> Path:
    file.write_text(text, encoding="utf-8")
    return file
