"""The command ``gazerig report``: human likeness of the gaze of a run, or of two side by side."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import refuse_existing
from gazerig.robot.cli.options import DEFAULT_RIG, run_option
from gazerig.robot.cli.progress import Steps, progress_bar
from gazerig.robot.cli.terminal import ForceOption, clear_errors, record_signals, say

if TYPE_CHECKING:
    from gazerig.features.lab.report.report import ReportedRun
    from gazerig.robot.run.options import RunOptions

app = typer.Typer(add_completion=False)


@app.command()
def report(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[FILE | RIG]",
            help="A recording of gazerig run --record; with --scene the rig of that run "
            f"(default: {DEFAULT_RIG}).",
        ),
    ] = None,
    other: Annotated[
        Path | None,
        typer.Argument(metavar="[FILE]", help="A second recording, to show side by side."),
    ] = None,
    scene: Annotated[
        str | None, typer.Option(help="Instead of a file: run this scene in simulated time.")
    ] = None,
    seconds: Annotated[float, typer.Option(min=5.0, help="Length of that run, s.")] = 180.0,
    character: Annotated[str | None, run_option("character")] = None,
    profile: Annotated[str | None, run_option("profile")] = None,
    scanpath: Annotated[str | None, run_option("scanpath")] = None,
    bus: Annotated[str | None, run_option("bus")] = None,
    seed: Annotated[int, run_option("seed")] = 0,
    out: Annotated[Path | None, typer.Option(help="HTML page to write.")] = None,
    force: ForceOption = False,
) -> None:
    """Report how human a run's gaze was: gazerig report run.mcap, then open report.html."""
    with clear_errors():
        rig = DEFAULT_RIG
        if scene is not None and file is not None and file.suffix != ".mcap":
            rig, file = str(file), None
        if (file is None) == (scene is None):
            raise SetupError("report takes either a recording or --scene NAME")
        if file is None and other is not None:
            raise SetupError("report compares two recordings: leave --scene out")
        # Drawing and models are slow to import; `--help` does not need them.
        from gazerig.features.lab.report.report import make_report, read_run, report_files
        from gazerig.robot.recording.read import RunRecording
        from gazerig.robot.run.options import RunOptions

        files = [path for path in (file, other) if path is not None]
        default = "compare" if other is not None else f"report-{scene}" if scene else files[0].stem
        target = out or Path(f"{default}.html")
        refuse_existing(*report_files(target), force=force)
        recordings = [RunRecording(path) for path in files]
        with progress_bar() as tell:
            if scene is not None:
                run_options = RunOptions(
                    True, True, seed, scene, scanpath=scanpath, bus=bus, rig=rig,
                    character=character, profile=profile,
                    seconds=seconds,
                ).check_and_complete()  # fmt: skip
                runs = [_simulate_run(run_options, tell)]
            else:
                runs = [read_run(recording, tell) for recording in recordings]
            make_report(runs, target, tell, force)
        for one in runs:
            say(f"{one.name}: {', '.join(f'{n} {word}' for word, n in one.counts.items())}")
            if one.banner:
                say(one.banner)
            for result in one.of("outside"):
                band = result.band
                unit = "" if band.unit in ("", "share") else f" {band.unit}"
                say(
                    f"outside: {band.title}: {result.value:.3g}, people {band.low:g} to "
                    f"{band.high:g}{unit} ({result.measured.events} events)"
                )
        say(f"{target}: the whole report")


def _simulate_run(run_options: "RunOptions", tell: Steps) -> "ReportedRun":
    """Run a scene in simulated time; Ctrl-C ends the run early."""
    from gazerig.features.lab.report.report import describe_run
    from gazerig.features.lab.simulated_run import simulate
    from gazerig.robot.loop.tick import Tick
    from gazerig.robot.run.run_rig import run_info, run_rig

    rig = run_rig(run_options)
    seconds, start_s = run_options.seconds or 0.0, list[float]()

    def watch(tick: Tick) -> None:
        start_s[:] = start_s or [tick.t_s]
        tell(f"simulating {seconds:.0f} s", min(1.0, (tick.t_s - start_s[0]) / seconds))

    with record_signals() as stopped:
        trace = simulate(rig, run_options, stopped, watch).trace
    parts = (run_options.scene, run_options.character, run_options.profile)
    return describe_run(" ".join(filter(None, parts)), run_info(rig, run_options), trace)
