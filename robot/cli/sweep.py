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
    from gazerig.robot.sweep.fit import Fit
    from gazerig.robot.sweep.outcome import Outcome
    from gazerig.robot.sweep.sweep import Progress, Sweep, SweepSpec

app = typer.Typer(add_completion=False)

_COLUMNS = (
    *("outside", "distance", "fixations", "saccades", "blinks"),
    *("gaze_error_deg.median", "gaze_error_deg.p95"),
)
"""What can be drawn besides the report's measures."""
_MOST_SEEDS = 10_000
_TRIED = 60


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
        typer.Option(
            min=2,
            max=100_000,
            help="A Latin hypercube of N points instead of a grid; with --fit, points to try (60).",
        ),
    ] = None,
    fit: Annotated[
        bool,
        typer.Option(
            "--fit", help="Search for the values with the fewest measures outside people's bands."
        ),
    ] = False,
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

    --fit searches for the values with most measures inside people's bands.
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
        all_seeds = tuple(range(seed, seed + seeds))
        if fit:
            search = {"fit": samples or _TRIED, "seed": seed}
            spec = SweepSpec(varied, asked, tuple(axes), all_seeds, search)
            outcomes = _fitted(spec, out or folder_of(asked, "fit"), jobs, shown)
        else:
            points = grid(axes) if samples is None else latin_hypercube(axes, samples, seed)
            checked(varied, axes, points)
            search = {} if samples is None else {"samples": samples, "seed": seed}
            spec = SweepSpec(varied, asked, tuple(axes), all_seeds, search)
            outcomes = _swept(spec, points, out or folder_of(asked, "sweep"), jobs, shown)
    if all(one.failed for one in outcomes):
        raise typer.Exit(FAULT)


def _swept(
    spec: "SweepSpec", points: "Sequence[Point]", folder: Path, jobs: int | None,
    shown: Sequence[str],
) -> "list[Outcome]":  # fmt: skip
    """Run all points, and write table and picture."""
    with _working(spec, folder, jobs) as (work, runs):
        outcomes = work.run(points, runs)
    _write(spec, folder, outcomes, shown)
    _say_failures(outcomes)
    return outcomes


def _fitted(
    spec: "SweepSpec", folder: Path, jobs: int | None, shown: Sequence[str]
) -> "list[Outcome]":
    """Search for the best point; write it as YAML, with the table and picture of all runs."""
    from gazerig.config.parameters import value_of
    from gazerig.robot.sweep.fit import fit
    from gazerig.robot.sweep.snippet import SNIPPET, snippet_of

    count, seed = int(str(spec.search["fit"])), int(str(spec.search["seed"]))
    start = {axis.key: value_of(spec.rig, axis.key) for axis in spec.axes}
    outcomes: list[Outcome] = []
    with _working(spec, folder, jobs) as (work, runs):
        total = (count + 1) * len(spec.seeds)

        def run(points: "Sequence[Point]") -> "Sequence[Sequence[Outcome]]":
            before = len(outcomes)
            outcomes.extend(work.run(points, lambda done, _: runs(before + done, total)))
            n = len(spec.seeds)
            return [outcomes[i : i + n] for i in range(before, len(outcomes), n)]

        found = fit(run, spec.axes, start, count, seed)
    _write(spec, folder, outcomes, shown)
    write_file(folder / SNIPPET, snippet_of(spec.options, found.best.point), force=True)
    _say_failures(outcomes)
    _say_fit(found, folder / SNIPPET, spec.options)
    return outcomes


def _say_fit(found: "Fit", snippet: Path, asked: RunOptions) -> None:
    """Print the best point beside the rig's own values, and how to run it."""
    own, best = found.start, found.best
    say(
        f"{len(found.counted)} measures count, {len(found.trials)} points tried; outside: "
        f"{own.outside:.3g} with the rig's own values (graded {own.score:.3g}), "
        f"{best.outside:.3g} with the best (graded {best.score:.3g})"
    )
    if best is own:
        say("no point tried is better than the rig's own values")
        return
    for key, value in best.point.items():
        say(f"{key}: {own.point[key]} -> {value}")
    names = ("profile", "rules", "behaviour", "conversation")
    given = "".join(f" --{name} {held}" for name in names if (held := getattr(asked, name)))
    say(f"to run it: gazerig run {asked.rig} --character {snippet}{given}")


def _write(
    spec: "SweepSpec", folder: Path, outcomes: "Sequence[Outcome]", shown: Sequence[str]
) -> None:
    """Write table and picture, and say where."""
    from gazerig.robot.sweep.response_figure import PICTURE, response_png
    from gazerig.robot.sweep.table import write_tables

    files = [*write_tables(folder, outcomes)]
    if not all(one.failed for one in outcomes):
        files.append(folder / PICTURE)
        write_file(files[-1], response_png(spec.axes, outcomes, shown), force=True)
    points = len(outcomes) // len(spec.seeds)
    count = f"{points} points, {len(spec.seeds)} seeds each: {len(outcomes)} runs"
    say(f"{files[0]}: {count}; beside it {', '.join(file.name for file in files[1:])}")


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
                tell(f"{total} runs", done / max(1, total))

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
