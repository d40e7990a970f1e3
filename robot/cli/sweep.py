"""The command ``gazerig sweep``: many simulated runs, and what parameters do to their figures."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.config.export import suggestion
from gazerig.drivers.errors import SetupError
from gazerig.drivers.file_output import write_file
from gazerig.robot.app.options import BUSES, DEFAULT_SCENE, RunOptions
from gazerig.robot.cli import run_options as options
from gazerig.robot.cli.progress_bar import progress_bar
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import FAULT, INTERRUPTED, RigArgument, clear_errors, say, signals
from gazerig.robot.cli.tune import read_value
from gazerig.robot.report.norm_bands import BY_KEY

if TYPE_CHECKING:
    from gazerig.robot.sweep.axes import Point
    from gazerig.robot.sweep.outcome import Outcome
    from gazerig.robot.sweep.sweep import Progress, Sweep, SweepSpec

app = typer.Typer(add_completion=False)

_COLUMNS = (
    *("outside", "distance", "fixations", "saccades", "blinks"),
    *("gaze_error_deg.median", "gaze_error_deg.p95"),
)
"""What can be drawn besides the report's measures."""
_MOST_SEEDS = 10_000


@app.command(cls=RigCommand)
def sweep(
    rig: RigArgument = "desk",
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUES",
            help="A key of the rig's YAML and what it takes: LOW:HIGH:STEPS or A,B,C; with --samples "
            "or --fit also LOW:HIGH. Repeat it for more keys.",
        ),
    ] = None,
    scene: options.Scene = DEFAULT_SCENE,
    seeds: Annotated[
        int, typer.Option(min=1, max=_MOST_SEEDS, help="Runs at each point, each with a seed.")
    ] = 4,
    seed: Annotated[int, typer.Option(min=0, help="The first of them, and of the samples.")] = 0,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help="Length of a run; default: the scene's round.")
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(min=2, max=100_000, help="A Latin hypercube of N points instead of a grid."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder; default: sweep-RIG-SCENE or fit-RIG-SCENE.")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, max=512, help="Processes; default: one a processor.")
    ] = None,
    show: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MEASURE", help="Draw this one; default: those that respond most. Repeatable."
        ),
    ] = None,
    bus: Annotated[str, typer.Option(help=f"Servos: {' or '.join(BUSES)}.")] = "emulated",
    profile: options.Profile = None,
    character: options.Character = None,
    rules: options.Rules = None,
    behaviour: options.Behaviour = None,
    conversation: options.Conversation = None,
) -> None:
    """Vary parameters over many simulated runs: a table, and a picture of what responds.

    Every finished run is kept at once: the same command goes on after Ctrl-C.
    """
    with clear_errors(rig):
        shown = [_column(name) for name in show or ()]
        # Models and drawing are heavy; `--help` does without them.
        from gazerig.robot.app.simulated_run import refuse_unfit
        from gazerig.robot.sweep.axes import axes_of, checked, grid, latin_hypercube
        from gazerig.robot.sweep.sweep import SweepSpec, folder_of
        from gazerig.robot.sweep.worker import rig_of

        asked = RunOptions(
            mock=True, fast=True, scene=scene, seconds=seconds, bus=bus, rig=rig, profile=profile,
            character=character, rules=rules, behaviour=behaviour, conversation=conversation,
        ).checked()  # fmt: skip
        varied = rig_of(asked)
        refuse_unfit(varied, asked)
        axes = axes_of(varied, setting or (), read_value)
        if not axes:
            raise SetupError("nothing to vary: give --set KEY=VALUES, for example "
                             "--set gaze.head.comfort_deg=4:16:7")  # fmt: skip
        points = grid(axes) if samples is None else latin_hypercube(axes, samples, seed)
        checked(varied, axes, points)
        search = {} if samples is None else {"samples": samples, "seed": seed}
        spec = SweepSpec(varied, asked, tuple(axes), tuple(range(seed, seed + seeds)), search)
        outcomes = _swept(spec, points, out or folder_of(asked, "sweep"), jobs, shown)
        _say_failures(outcomes)
    if all(one.failed for one in outcomes):
        raise typer.Exit(FAULT)


def _swept(
    spec: "SweepSpec", points: "Sequence[Point]", folder: Path, jobs: int | None,
    shown: Sequence[str],
) -> "list[Outcome]":  # fmt: skip
    """Run all points, and write table and picture."""
    from gazerig.robot.sweep.response_figure import PICTURE, response_png
    from gazerig.robot.sweep.table import write_tables

    with _working(spec, folder, jobs) as (work, runs):
        outcomes = work.run(points, runs)
    files = [*write_tables(folder, outcomes)]
    if not all(one.failed for one in outcomes):
        files.append(folder / PICTURE)
        write_file(files[-1], response_png(spec.axes, outcomes, shown), force=True)
    count = f"{len(points)} points, {len(spec.seeds)} seeds each: {len(outcomes)} runs"
    say(f"{files[0]}: {count}; beside it {', '.join(file.name for file in files[1:])}")
    return outcomes


@contextmanager
def _working(
    spec: "SweepSpec", folder: Path, jobs: int | None
) -> "Iterator[tuple[Sweep, Progress]]":
    """Return what runs points and what draws how far it is; Ctrl-C ends it and keeps its runs."""
    from gazerig.robot.sweep.sweep import working
    from gazerig.robot.sweep.worker_pool import SweepInterrupted

    reached = [0, 0]
    try:
        with (
            progress_bar(remaining=True) as tell,
            signals() as stopped,
            working(spec, folder, jobs, stopped) as work,
        ):

            def runs(done: int, total: int) -> None:
                reached[:] = done, total
                tell("simulating", done / max(1, total))

            yield work, runs
    except SweepInterrupted:
        say(f"{reached[0]} of {reached[1]} runs are kept in {folder}: the same command goes on")
        raise typer.Exit(INTERRUPTED) from None


def _column(name: str) -> str:
    """Return the column of a measure that can be drawn.

    Raises:
        SetupError: there is none of that name.
    """
    if name in BY_KEY or name in _COLUMNS[:2]:
        return f"report.{name}"
    if name in _COLUMNS:
        return name
    known = (*_COLUMNS, *BY_KEY)
    near = suggestion(name, known) or ";"
    raise SetupError(f"--show {name}: no such measure{near} there is {', '.join(known)}")


def _say_failures(outcomes: "Sequence[Outcome]") -> None:
    """Print which runs failed, each reason once."""
    reasons = Counter(one.failed for one in outcomes if one.failed)
    for failed, count in reasons.items():
        first = next(one for one in outcomes if one.failed == failed)
        where = ", ".join(f"{key}={value}" for key, value in first.point.items())
        more = f" (and {count - 1} more)" if count > 1 else ""
        say(f"failed: {where}, seed {first.seed}{more}: {failed}")
