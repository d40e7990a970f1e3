"""The command ``gazerig sweep``: many simulated runs as a table."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing, write_file
from gazerig.robot.cli.ctl import read_value
from gazerig.robot.cli.options import run_option
from gazerig.robot.cli.progress import progress_bar
from gazerig.robot.cli.terminal import (
    FAULT,
    INTERRUPTED,
    ForceOption,
    RigArgument,
    clear_errors,
    record_signals,
    say,
)
from gazerig.robot.run.options import DEFAULT_SCENE, RunOptions

app = typer.Typer(add_completion=False)


@app.command()
def sweep(
    rig: RigArgument = "desk",
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUES",
            help="A key of the rig's YAML and its values: LOW:HIGH:STEPS or A,B,C. Repeatable.",
        ),
    ] = None,
    scene: Annotated[str | None, run_option("scene")] = DEFAULT_SCENE,
    seeds: Annotated[int, typer.Option(min=1, help="Runs at each point, each with its seed.")] = 4,
    seed: Annotated[int, typer.Option(min=0, help="First seed.")] = 0,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help="Length of a run, s; default: the scene's round.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="CSV file to write; default: sweep-RIG-SCENE.csv.")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Number of processes; default: one per processor.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT", help="Run on the workers of this Dask scheduler instead."
        ),
    ] = None,
    bus: Annotated[str | None, run_option("bus")] = None,
    profile: Annotated[str | None, run_option("profile")] = None,
    character: Annotated[str | None, run_option("character")] = None,
    force: ForceOption = False,
) -> None:
    """Vary parameters over many simulated runs; write a table of all runs as CSV.

    After Ctrl-C the table has the finished runs.
    """
    with clear_errors(rig):
        # Models are slow to import; `--help` does not need them.
        from gazerig.features.lab.sweep.points import check_points, grid
        from gazerig.features.lab.sweep.runs import FAILED, open_executor, run_all, table_text
        from gazerig.robot.run.run import Run
        from gazerig.robot.run.run_rig import run_rig

        run_options = RunOptions(
            mock=True, fast=True, scene=scene, seconds=seconds, bus=bus, rig=rig, profile=profile,
            character=character,
        ).check_and_complete()  # fmt: skip
        points = grid(setting or (), read_value)
        if points == [{}]:
            example = "--set gaze.head.eye_only_range_deg=16:56:7"
            raise SetupError(f"nothing to vary: give --set KEY=VALUES, for example {example}")
        table = out or Path(f"sweep-{Path(rig).stem}-{Path(scene or '').stem}.csv")
        refuse_existing(table, force=force)
        own = run_rig(run_options)
        Run(own, run_options).close()
        check_points(own, points)
        runs = [(point, seed + number) for point in points for number in range(seeds)]
        with (
            progress_bar() as tell,
            record_signals() as stopped,
            open_executor(jobs, scheduler) as executor,
        ):
            text = f"{len(runs)} runs"
            rows = run_all(
                executor, own, run_options, runs, stopped,
                lambda done: tell(text, done / len(runs)),
            )  # fmt: skip
        write_file(table, table_text(rows), force)
        say(f"{table}: {len(points)} points, {seeds} seeds each: {len(rows)} of {text}")
        for reason, count in Counter(row[FAILED] for row in rows if row[FAILED]).items():
            say(f"{count} failed: {reason}")
    if len(rows) < len(runs):
        raise typer.Exit(INTERRUPTED)
    if all(row[FAILED] for row in rows):
        raise typer.Exit(FAULT)
