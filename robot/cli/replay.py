"""Commands replay and export, for recorded runs."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import Progress
from rich.table import Table

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing
from gazerig.drivers.process.own_folder import OwnFolder
from gazerig.robot.app.options import parse_host_port
from gazerig.robot.cli.console import Console
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import (
    FAULT,
    ForceOption,
    clear_errors,
    complete_rig,
    record_signals,
    say,
)

if TYPE_CHECKING:
    from gazerig.robot.app.resimulate import Resimulation
    from gazerig.robot.control.loop import Tick
    from gazerig.robot.dashboard.feed.snapshot import ShownRig
    from gazerig.robot.description.world_shapes import WorldShapes
    from gazerig.robot.recording.read import RunRecording

app = typer.Typer(add_completion=False)

Recording = Annotated[
    Path, typer.Argument(metavar="FILE", help="A recording of gazerig run --record.")
]


@app.command(cls=RigCommand)
def replay(
    file: Recording,
    rig: Annotated[
        str | None,
        typer.Argument(
            metavar="RIG",
            help="With --rerun: a rig instead of the recorded one.",
            autocompletion=complete_rig,
        ),
    ] = None,
    page: Annotated[str, typer.Option(help="HOST:PORT of the page.")] = "127.0.0.1:8080",
    play: Annotated[bool, typer.Option(help="Start playing immediately.")] = False,
    rerun: Annotated[
        bool,
        typer.Option(help="Run the recorded input through the present models, without a page."),
    ] = False,
    character: Annotated[str | None, typer.Option(help="With --rerun: another character.")] = None,
    joints: Annotated[
        str | None, typer.Option(help="With --rerun: recorded or emulated joints.")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=0.0, help="Stop after S seconds; otherwise at Ctrl-C.")
    ] = None,
) -> None:
    """Show a recorded run on the page, with a time slider; or run it again with --rerun."""
    with clear_errors():
        if rerun:
            well = _rerun(file, rig, character, joints)
        elif rig is not None or character is not None or joints is not None:
            raise SetupError(
                "another RIG, --character and --joints need --rerun; replays show the recorded run"
            )
        else:
            with record_signals() as stopped:
                well = _show(file, parse_host_port(page), play, seconds, stopped)
    if not well:
        raise typer.Exit(FAULT)


@app.command()
def export(
    file: Recording,
    csv: Annotated[
        bool, typer.Option("--csv", help="Tables of samples, events and fixations.")
    ] = False,
    bids: Annotated[bool, typer.Option("--bids", help="A BIDS data set (version 1.11.1).")] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="For --csv the start of the file names, for --bids the folder."),
    ] = None,
    subject: Annotated[
        str | None, typer.Option(help="BIDS: name of the participant (default: the rig's).")
    ] = None,
    task: Annotated[
        str | None, typer.Option(help="BIDS: name of the task (default: the scene's).")
    ] = None,
    force: ForceOption = False,
) -> None:
    """Export a recorded run for eye-tracking tools: degrees, + left and + up."""
    with clear_errors():
        if csv == bids:
            raise SetupError("export takes one of --csv and --bids")
        if csv and (subject is not None or task is not None):
            raise SetupError("--subject and --task name files of --bids")
        from gazerig.robot.control.feedback_basis import ESTIMATED
        from gazerig.robot.recording.export_bids import DatasetDescription, write_bids
        from gazerig.robot.recording.export_csv import csv_files, write_csv
        from gazerig.robot.recording.gaze_angles import (
            collect_gaze_angles,
            find_intervals,
            label_samples,
        )
        from gazerig.robot.recording.read import RunRecording, report_bad_contents

        recording = RunRecording(file)
        stem = out or file.with_suffix("")
        if not bids:
            refuse_existing(*csv_files(stem), force=force)
        _warn(recording.note)
        with report_bad_contents(file):
            with _progress("reading", recording.duration_s) as read:
                trace = collect_gaze_angles(_with_progress(recording.ticks(), read))
            labels = label_samples(trace)
            stretches = find_intervals(trace, labels)
        if bids:
            info = recording.info
            about = DatasetDescription(
                subject or Path(info.rig).stem,
                task or info.scene or "live",
                info.rate_hz,
                info.started_utc,
                ", ".join(f"{name} {version}" for name, version in sorted(info.versions.items())),
            )
            root = out or file.with_name(f"{file.stem}_bids")
            made = write_bids(trace, labels, stretches, about, root, force)
            say(f"{len(made)} files in {root}")
        else:
            made = write_csv(trace, labels, stretches, stem, force)
            say("\n".join(map(str, made)))
        found = {kind: sum(s.event == kind for s in stretches) for kind in _EVENTS}
        say(
            f"{len(trace.time_s)} samples in {trace.time_s[-1]:.1f} s, "
            + ", ".join(f"{n} {kind}s" for kind, n in found.items())
            + f"; labels are the plan's, {1e3 * labels.lag_s:.0f} ms later, as the eyes follow it"
        )
        if trace.estimated:
            say(f"{', '.join(trace.estimated)}: {ESTIMATED}")


_EVENTS = ("saccade", "fixation", "pursuit", "blink")


def _show(
    file: Path,
    address: tuple[str, int],
    play: bool,
    seconds: float | None,
    stopped: Callable[[], str | None],
) -> bool:
    """Serve the page until stopped; return False if it cannot start."""
    from gazerig.robot.dashboard.feed.live_feed import LiveRig, RunState, rig_message, state_message
    from gazerig.robot.dashboard.feed.page_process import PageProcess
    from gazerig.robot.model.clock import RealClock
    from gazerig.robot.recording.playback import PlaybackState, Replay, SnapshotIndex
    from gazerig.robot.recording.read import RunRecording, report_bad_contents

    recording, clock = RunRecording(file), RealClock()
    _warn(recording.note)
    built, rate_hz = _recorded_rig(recording.info.config_yaml), recording.info.rate_hz
    with report_bad_contents(file), _progress("reading", recording.duration_s) as read:
        frames = SnapshotIndex(
            recording.ticks(), recording.frames(), rate_hz, recording.info.character or "", built,
            read,
        )  # fmt: skip
    world = _recorded_world(recording)
    start_s = recording.world.start_s if recording.world is not None else None
    replaying = Replay(frames, clock)
    page = PageProcess(*address, replaying.handle_request)
    began_s, urls, starts = clock.now_s(), [""], [0]

    def over(_: PlaybackState) -> bool:
        if (note := page.notice()) is not None:
            say(note)
        url = page.url()
        if page.started != starts[-1]:
            starts.append(page.started)
            if built is not None:
                page.send(rig_message(LiveRig(rate_hz, built, world=world)))
                page.send(state_message(RunState({}, "", "", "", (None, None, 0), start_s)))
            replaying.send_introduction_again()
        if url is not None and url != urls[-1]:
            urls.append(url)
            say(f"{frames.duration_s:.1f} s of {file} on {url}: Ctrl-C stops")
        past = seconds is not None and clock.now_s() - began_s >= seconds
        return page.gone or past or stopped() is not None

    say(page.open())
    if play:
        replaying.ask({"play": True})
    try:
        replaying.run(page, over)
        return not page.gone
    finally:
        page.close()
        frames.close()


def _recorded_world(recording: "RunRecording") -> "WorldShapes | None":
    """Return the world of the recorded run; None without one, or with a message if it is lost."""
    if recording.world is None:
        return None
    from gazerig.robot.app.surroundings import surroundings

    try:
        world = surroundings(recording.world.name)
        return world.replay_shapes(recording.world, recording.info.placement)
    except SetupError as error:
        say(str(error))
        return None


def _recorded_rig(config_yaml: str) -> "ShownRig | None":
    """Return the shapes of the recorded rig; None, with the reason, if they are unknown."""
    from gazerig.config.load import ConfigError, load
    from gazerig.config.rig import Rig
    from gazerig.robot.app.gaze_models import kinematics_and_oculomotor
    from gazerig.robot.app.rig_description import shape_of
    from gazerig.robot.dashboard.feed.snapshot import ShownRig
    from gazerig.robot.model.frames import CameraMount

    with OwnFolder("replay") as folder:
        file = Path(folder) / "recorded.yaml"
        file.write_text(config_yaml, encoding="utf-8")
        try:
            rig = load(file, Rig)
        except ConfigError as error:
            first = str(error).splitlines()[0].replace(f"{folder}/", "")
            say(
                f"no ghost of the desired pose: the recorded configuration is no longer valid ({first})"
            )
            return None
    return ShownRig(
        kinematics_and_oculomotor(rig, 0)[0],
        tuple(rig.joints[name].limit() for name in rig.names),
        rig.guard.health,
        CameraMount(rig.camera),
        radians(rig.camera.horizontal_field_deg),
        rig.gaze.field_of_view,
        shape_of(rig, without_lost_meshes=True),
    )


def _rerun(file: Path, rig: str | None, character: str | None, joints: str | None) -> bool:
    """Run a recording again and print the result; return False if it differs unexpectedly.

    Results must be identical only if joints are replayed and nothing else has changed.
    """
    from gazerig.robot.app.resimulate import rerun
    from gazerig.robot.recording.read import RunRecording, report_bad_contents

    recording = RunRecording(file)
    with report_bad_contents(file), _progress("running again", recording.duration_s) as read:
        count, start_s = 0, 0.0

        def on_tick(tick: "Tick") -> None:
            nonlocal count, start_s
            start_s = tick.t_s if count == 0 else start_s
            count += 1
            if count % 100 == 0:
                read(tick.t_s - start_s)

        result = rerun(recording, rig=rig, character=character, joints=joints, on_tick=on_tick)
    for line in result.notes:
        say(line)
    say(agreement_text(result))
    table = Table("", "recorded", "run again", title=f"{file.name} run again")
    for name, was, now in compare_figures(result.recorded_figures, result.rerun_figures):
        table.add_row(name, was, now, style=None if was == now else "bold")
    Console().print(table)
    changed = rig is not None or character is not None
    return result.is_same or result.joints != "recorded" or changed


def agreement_text(result: "Resimulation") -> str:
    """Return how far a rerun agrees with the recorded run, as text."""
    text = f"{result.agreeing_ticks} of {result.ticks} ticks are bit-identical"
    if result.first_difference_s is not None:
        text += (
            f"; the first difference is at {result.first_difference_s:.3f} s: {result.difference}"
        )
    if result.sent_bytes_same is not None:
        text += (
            f"; the bytes on the bus are {'the same' if result.sent_bytes_same else 'different'}"
        )
    return f"joints {result.joints}: {text}"


def compare_figures(
    was: Mapping[str, object], now: Mapping[str, object], within: str = ""
) -> Iterator[tuple[str, str, str]]:
    """Return the figures of two runs side by side: name and both values as text."""
    for name in dict.fromkeys((*was, *now)):
        one, other = was.get(name), now.get(name)
        if isinstance(one, Mapping) or isinstance(other, Mapping):
            inner = [value if isinstance(value, Mapping) else {} for value in (one, other)]
            yield from compare_figures(inner[0], inner[1], f"{within}{name} ".replace("_", " "))
        else:
            yield f"{within}{name}".replace("_", " "), _value_text(one), _value_text(other)


def _warn(note: str) -> None:
    if note:
        say(note)


def _value_text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, list | tuple):
        return f"{len(value)} of them"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _with_progress(ticks: Iterable["Tick"], read: Callable[[float], None]) -> Iterator["Tick"]:
    """Yield ticks and show the progress."""
    start_s = None
    for number, tick in enumerate(ticks):
        start_s = tick.t_s if start_s is None else start_s
        if number % 100 == 0:
            read(tick.t_s - start_s)
        yield tick


@contextmanager
def _progress(text: str, total_s: float) -> Iterator[Callable[[float], None]]:
    """Draw a progress bar on a terminal; elsewhere nothing."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task(text, total=total_s)
        yield lambda at_s: bar.update(task, completed=at_s)
