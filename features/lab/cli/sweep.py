"""The command ``gazerig sweep``: many simulated runs, and the effect of parameters on figures."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.config.validation import suggestion_text
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.robot.app.options import BUSES, DEFAULT_SCENE, RunOptions
from gazerig.robot.cli import run_options as options
from gazerig.robot.cli.progress_bar import progress_bar
from gazerig.robot.cli.rig_command import RigCommand
from gazerig.robot.cli.terminal import (
    FAULT,
    INTERRUPTED,
    RigArgument,
    clear_errors,
    record_signals,
    say,
)
from gazerig.robot.cli.tune import read_value

if TYPE_CHECKING:
    from gazerig.features.lab.sweep.axes import Point
    from gazerig.features.lab.sweep.fit import SweepFit
    from gazerig.features.lab.sweep.run_outcome import Outcome
    from gazerig.features.lab.sweep.sweep import Progress, Sweep, SweepSpec


_MOST_SEEDS, _MOST_POINTS, _MOST_JOBS = 10_000, 100_000, 512

Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUES",
        help="A key of the rig's YAML and its values: LOW:HIGH:STEPS or A,B,C; with --samples "
        "or --fit also LOW:HIGH. Repeat it for more keys.",
    ),
]
Seeds = Annotated[
    int, typer.Option(min=1, max=_MOST_SEEDS, help="Runs at each point, each with a seed.")
]
FirstSeed = Annotated[
    int, typer.Option(min=0, help="First seed of the runs, and seed of the samples.")
]
Seconds = Annotated[
    float | None, typer.Option(min=0.1, help="Length of a run, s; default: the scene's round.")
]
Samples = Annotated[
    int | None,
    typer.Option(
        min=2,
        max=_MOST_POINTS,
        help="A Latin hypercube of N points instead of a grid; with --fit, points to try (60).",
    ),
]
Fit = Annotated[
    bool,
    typer.Option(
        "--fit", help="Search for the values with the fewest measures outside people's bands."
    ),
]
Out = Annotated[
    Path | None, typer.Option(help="Folder; default: sweep-RIG-SCENE or fit-RIG-SCENE.")
]
Jobs = Annotated[
    int | None,
    typer.Option(min=1, max=_MOST_JOBS, help="Number of processes; default: one per processor."),
]
Show = Annotated[
    list[str] | None,
    typer.Option(
        metavar="MEASURE", help="Draw this measure; default: the most responsive. Repeatable."
    ),
]
Bus = Annotated[str, typer.Option(help=f"Servos: {' or '.join(BUSES)}.")]


app = typer.Typer(add_completion=False)

_COLUMNS = (
    *("outside", "distance", "fixations", "saccades", "blinks"),
    *("gaze_error_deg.median", "gaze_error_deg.p95"),
)
"""Figures that can be drawn in addition to the report's measures."""
_DEFAULT_POINTS = 60
"""Default number of points of a search; the help of --samples names it."""


@app.command(cls=RigCommand)
def sweep(
    rig: RigArgument = "desk",
    setting: Settings = None,
    scene: options.Scene = DEFAULT_SCENE,
    seeds: Seeds = 4,
    seed: FirstSeed = 0,
    seconds: Seconds = None,
    samples: Samples = None,
    fit: Fit = False,
    out: Out = None,
    jobs: Jobs = None,
    show: Show = None,
    bus: Bus = "emulated",
    profile: options.Profile = None,
    character: options.Character = None,
    rules: options.Rules = None,
    behaviour: options.Behaviour = None,
    conversation: options.Conversation = None,
) -> None:
    """Vary parameters over many simulated runs; write a table and a figure of the responses.

    After Ctrl-C the table has the finished runs.

    --fit searches for the values with most measures inside people's bands.
    """
    with clear_errors(rig):
        shown = [_column(name) for name in show or ()]
        asked = RunOptions(
            mock=True, fast=True, scene=scene, seconds=seconds, bus=bus, rig=rig, profile=profile,
            character=character, rules=rules, behaviour=behaviour, conversation=conversation,
        ).check_and_complete()  # fmt: skip
        number = samples if samples is not None or not fit else _DEFAULT_POINTS
        spec, points = _plan_runs(asked, setting or (), range(seed, seed + seeds), number, fit)
        folder = out or Path(f"{'fit' if fit else 'sweep'}-{Path(rig).stem}-{scene}")
        if fit:
            outcomes = _search_best(spec, folder, jobs, shown)
        else:
            with _running_sweep(spec, folder, jobs) as (work, runs):
                outcomes = work.run(points, runs)
            _write(spec, folder, outcomes, shown)
            _say_failures(outcomes)
    if all(one.failure for one in outcomes):
        raise typer.Exit(FAULT)


def _plan_runs(
    asked: RunOptions, settings: Sequence[str], seeds: range, number: int | None, fit: bool
) -> "tuple[SweepSpec, Sequence[Point]]":
    """Return the runs to make, with their points unless a search will find them.

    Raises:
        ConfigError, SetupError: a point or an option cannot be run.
    """
    # Models are slow to import; `--help` does not need them. The figures need an extra; a missing
    # extra is reported before hours of runs, not after them.
    import gazerig.features.lab.sweep.response_figure  # noqa: F401
    from gazerig.features.lab.simulated_run import refuse_unfit
    from gazerig.features.lab.sweep.axes import (
        check_points,
        grid,
        latin_hypercube,
        make_axes,
        vary_one_by_one,
    )
    from gazerig.features.lab.sweep.sweep import SweepSpec
    from gazerig.robot.app.run_rig import run_rig

    rig = run_rig(asked)
    refuse_unfit(rig, asked)
    axes = make_axes(rig, settings, read_value)
    if not axes:
        example = "--set gaze.head.eye_only_range_deg=16:56:7"
        raise SetupError(f"nothing to vary: give --set KEY=VALUES, for example {example}")
    if fit:
        points = vary_one_by_one(axes)
    else:
        points = grid(axes) if number is None else latin_hypercube(axes, number, seeds[0])
    check_points(rig, axes, points)
    how = "fit" if fit else "samples"
    search = {how: number, "seed": seeds[0]} if number is not None else {}
    return SweepSpec(rig, asked, tuple(axes), tuple(seeds), search), points


def _search_best(
    spec: "SweepSpec", folder: Path, jobs: int | None, shown: Sequence[str]
) -> "list[Outcome]":
    """Search for the best point; write it as YAML, with the table and picture of all runs."""
    from gazerig.config.parameters import value_of
    from gazerig.features.lab.sweep.fit import SNIPPET, fit_settings, yaml_snippet

    count, seed = int(str(spec.search["fit"])), int(str(spec.search["seed"]))
    start = {axis.key: value_of(spec.rig, axis.key) for axis in spec.axes}
    outcomes: list[Outcome] = []
    with _running_sweep(spec, folder, jobs) as (work, runs):
        total = (count + 1) * len(spec.seeds)

        def run(points: "Sequence[Point]") -> "Sequence[Sequence[Outcome]]":
            before = len(outcomes)
            outcomes.extend(work.run(points, lambda done, _: runs(before + done, total)))
            n = len(spec.seeds)
            return [outcomes[i : i + n] for i in range(before, len(outcomes), n)]

        found = fit_settings(run, spec.axes, start, count, seed)
    _write(spec, folder, outcomes, shown)
    write_file(folder / SNIPPET, yaml_snippet(spec.options, found.best.point), force=True)
    _say_failures(outcomes)
    _say_fit(found, folder / SNIPPET, spec.options)
    return outcomes


def _say_fit(found: "SweepFit", snippet: Path, asked: RunOptions) -> None:
    """Print the best point, the rig's own values, and the command to run it."""
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
    """Write table and figure, and print their paths."""
    from gazerig.features.lab.sweep.response_figure import PICTURE, response_png
    from gazerig.features.lab.sweep.run_outcome import write_table

    files = [write_table(folder, outcomes)]
    if not all(one.failure for one in outcomes):
        files.append(folder / PICTURE)
        write_file(files[-1], response_png(spec.axes, outcomes, shown), force=True)
    points = len(outcomes) // len(spec.seeds)
    count = f"{points} points, {len(spec.seeds)} seeds each: {len(outcomes)} runs"
    say(f"{files[0]}: {count}" + "".join(f"; also {file.name}" for file in files[1:]))


@contextmanager
def _running_sweep(
    spec: "SweepSpec", folder: Path, jobs: int | None
) -> "Iterator[tuple[Sweep, Progress]]":
    """Yield the sweep and its progress function; after Ctrl-C the table has the finished runs."""
    from gazerig.features.lab.sweep.run_outcome import write_table
    from gazerig.features.lab.sweep.sweep import open_sweep
    from gazerig.features.lab.sweep.worker_pool import SweepInterrupted

    reached = [0, 0]
    with (
        progress_bar(remaining=True) as tell,
        record_signals() as stopped,
        open_sweep(spec, folder, jobs, stopped) as work,
    ):

        def runs(done: int, total: int) -> None:
            reached[:] = done, total
            tell(f"{total} runs", done / max(1, total))

        try:
            yield work, runs
        except SweepInterrupted:
            file = write_table(folder, work.finished)
            say(f"{file}: {reached[0]} of {reached[1]} runs")
            raise typer.Exit(INTERRUPTED) from None


def _column(name: str) -> str:
    """Return the column of a measure.

    Raises:
        SetupError: there is no measure of that name.
    """
    from gazerig.features.lab.analysis.human_norms import BY_KEY  # with NumPy

    if name in BY_KEY or name in _COLUMNS[:2]:
        return f"report.{name}"
    if name in _COLUMNS:
        return name
    known = (*_COLUMNS, *BY_KEY)
    near = suggestion_text(name, known) or ";"
    raise SetupError(f"--show {name}: no such measure{near} there is {', '.join(known)}")


def _say_failures(outcomes: "Sequence[Outcome]") -> None:
    """Print the failed runs, each reason once."""
    reasons = Counter(one.failure for one in outcomes if one.failure)
    for failed, count in reasons.items():
        first = next(one for one in outcomes if one.failure == failed)
        where = ", ".join(f"{key}={value}" for key, value in first.point.items())
        more = f" (and {count - 1} more)" if count > 1 else ""
        say(f"failed: {where}, seed {first.seed}{more}: {failed}")
