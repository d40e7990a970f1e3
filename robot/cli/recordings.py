"""Commands rerun and export, for recorded runs."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import Progress
from rich.table import Table

from gazerig.drivers.files.file_output import refuse_existing
from gazerig.robot.cli.console import Console
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import (
    FAULT,
    ForceOption,
    clear_errors,
    complete_rig,
    say,
)

if TYPE_CHECKING:
    from gazerig.robot.loop.loop import Tick
    from gazerig.robot.run.resimulate import Resimulation

app = typer.Typer(add_completion=False)

Recording = Annotated[
    Path, typer.Argument(metavar="FILE", help="A recording of gazerig run --record.")
]


@app.command(cls=RigCommand)
def rerun(
    file: Recording,
    rig: Annotated[
        str | None,
        typer.Argument(
            metavar="RIG",
            help="A rig instead of the recorded one.",
            autocompletion=complete_rig,
        ),
    ] = None,
    character: Annotated[str | None, typer.Option(help="Another character.")] = None,
    joints: Annotated[str | None, typer.Option(help="Recorded or emulated joints.")] = None,
) -> None:
    """Run a recording's input through the present models: same input, same bytes."""
    with clear_errors():
        well = _rerun(file, rig, character, joints)
    if not well:
        raise typer.Exit(FAULT)


@app.command()
def export(
    file: Recording,
    out: Annotated[Path | None, typer.Option(help="The start of the file names.")] = None,
    force: ForceOption = False,
) -> None:
    """Export a run as CSV for eye-tracking tools: samples and events, degrees, + left and + up."""
    with clear_errors():
        from gazerig.robot.recording.export_csv import csv_files, write_csv
        from gazerig.robot.recording.gaze_angles import (
            ESTIMATED,
            collect_gaze_angles,
            find_intervals,
            label_samples,
        )
        from gazerig.robot.recording.read import RunRecording, report_bad_contents

        recording = RunRecording(file)
        stem = out or file.with_suffix("")
        refuse_existing(*csv_files(stem), force=force)
        _warn(recording.note)
        with report_bad_contents(file):
            with _progress("reading", recording.duration_s) as read:
                trace = collect_gaze_angles(_with_progress(recording.ticks(), read))
            labels = label_samples(trace)
            stretches = find_intervals(trace, labels)
        say("\n".join(map(str, write_csv(trace, labels, stretches, stem, force))))
        found = {kind: sum(s.event == kind for s in stretches) for kind in _EVENTS}
        say(
            f"{len(trace.time_s)} samples in {trace.time_s[-1]:.1f} s, "
            + ", ".join(f"{n} {kind}s" for kind, n in found.items())
            + f"; labels are the plan's, {1e3 * labels.lag_s:.0f} ms later, as the eyes follow it"
        )
        if trace.estimated:
            say(f"{', '.join(trace.estimated)}: {ESTIMATED}")


_EVENTS = ("saccade", "fixation", "pursuit", "blink")


def _rerun(file: Path, rig: str | None, character: str | None, joints: str | None) -> bool:
    """Run a recording again and print the result; return False if it differs unexpectedly.

    Results must be identical only if joints are replayed and nothing else has changed.
    """
    from gazerig.robot.recording.read import RunRecording, report_bad_contents
    from gazerig.robot.run import resimulate

    recording = RunRecording(file)
    with report_bad_contents(file), _progress("running again", recording.duration_s) as read:
        count, start_s = 0, 0.0

        def on_tick(tick: "Tick") -> None:
            nonlocal count, start_s
            start_s = tick.t_s if count == 0 else start_s
            count += 1
            if count % 100 == 0:
                read(tick.t_s - start_s)

        result = resimulate.rerun(
            recording, rig=rig, character=character, joints=joints, on_tick=on_tick
        )
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
