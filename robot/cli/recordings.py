"""Commands rerun and export, for recorded runs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.drivers.files.file_output import refuse_existing
from gazerig.robot.cli.terminal import FAULT, ForceOption, clear_errors, say

if TYPE_CHECKING:
    from gazerig.robot.run.rerun import Rerun

app = typer.Typer(add_completion=False)

Recording = Annotated[
    Path, typer.Argument(metavar="FILE", help="A recording of gazerig run --record.")
]


@app.command()
def rerun(file: Recording) -> None:
    """Run a recording's input through the present models: same input, same bytes."""
    with clear_errors():
        from gazerig.robot.recording.read import RunRecording, report_bad_contents
        from gazerig.robot.run.rerun import rerun as run_again

        recording = RunRecording(file)
        with report_bad_contents(file):
            result = run_again(recording)
        for line in (*result.notes, agreement_text(result)):
            say(line)
    if not result.is_same:
        raise typer.Exit(FAULT)


@app.command()
def export(
    file: Recording,
    out: Annotated[Path | None, typer.Option(help="The start of the file names.")] = None,
    force: ForceOption = False,
) -> None:
    """Export a run as CSV for eye-tracking tools: samples and events, degrees, + left and + up."""
    with clear_errors():
        from gazerig.robot.recording.export_csv import GazeExport, csv_files
        from gazerig.robot.recording.read import RunRecording, report_bad_contents

        recording = RunRecording(file)
        stem = out or file.with_suffix("")
        refuse_existing(*csv_files(stem), force=force)
        if recording.note:
            say(recording.note)
        gaze = GazeExport()
        with report_bad_contents(file):
            for tick in recording.ticks():
                gaze.update(tick)
        summary = gaze.write(stem, force)
        say("\n".join(map(str, (*csv_files(stem), summary))))
        if gaze.estimated:
            say(f"estimated from commands, not measured: {', '.join(gaze.estimated)}")


def agreement_text(result: "Rerun") -> str:
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
    return text
