"""The command ``gazerig report``: human likeness of the gaze of a run, or of two side by side."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.config.faults import ConfigError
from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.progress_bar import Steps, progress_bar
from gazerig.robot.cli.rig_command import DEFAULT_RIG, RigCommand
from gazerig.robot.cli.terminal import ForceOption, clear_errors, record_signals, say

if TYPE_CHECKING:
    from gazerig.config.rig import Rig
    from gazerig.features.lab.report.gaze_trace import GazeTrace
    from gazerig.features.lab.report.page import RunHeader
    from gazerig.gaze.scanpath.scanpath import Walk
    from gazerig.robot.app.options import RunOptions
    from gazerig.robot.recording.read import RunRecording

app = typer.Typer(add_completion=False)

_PAGES = {".html", ".htm"}


@app.command(cls=RigCommand)
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
    character: Annotated[str | None, typer.Option(help="Character applied over the rig.")] = None,
    profile: Annotated[str | None, typer.Option(help="Style of gaze.")] = None,
    scanpath: Annotated[
        str | None, typer.Option(help="Face scanpath instead of the rig's.")
    ] = None,
    saccade: Annotated[
        str | None, typer.Option(help="Saccade profile instead of the rig's.")
    ] = None,
    conversation: Annotated[
        str | None, typer.Option(help="Conversation: talk, listen or think.")
    ] = None,
    bus: Annotated[
        str | None, typer.Option(help="With --scene: emulated servos (default) or ideal ones.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")] = 0,
    out: Annotated[
        Path | None, typer.Option(help="Page to write; .html is added if it is missing.")
    ] = None,
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
        if file is not None and bus is not None:
            raise SetupError("--bus needs --scene: a recording already has its bus")
        if file is not None and other is not None:
            _compare(file, other, out, force)
            return
        # Drawing and models are slow to import; `--help` does not need them.
        from gazerig.features.lab.report.page import banner, refuse_foreign, report_files
        from gazerig.features.lab.report.report import FIGURE_KEYS, make_report, read_run
        from gazerig.robot.recording.read import RunRecording, report_bad_contents

        default = Path(f"report-{scene}.html") if file is None else file.with_suffix(".html")
        target = page_file(out or default)
        refuse_foreign(report_files(target, FIGURE_KEYS), force)
        with progress_bar() as tell:
            if file is not None:
                recording = RunRecording(file)
                about = _recording_header(recording, file.stem)
                with report_bad_contents(file):
                    run = read_run(recording.ticks(), about, tell)
            else:
                from gazerig.robot.app.options import RunOptions

                options = RunOptions(
                    True, True, seed, scene, scanpath=scanpath, saccade=saccade, bus=bus, rig=rig,
                    character=character, profile=profile, conversation=conversation,
                    seconds=seconds,
                ).check_and_complete()  # fmt: skip
                about, run = _simulate_run(options, tell)
            made = make_report(run, about, target, tell, force)
        if text := banner(run.joints):
            say(text)
        for finding in made.findings:
            if finding.verdict == "outside":
                band = finding.band
                unit = "" if band.unit in ("", "share") else f" {band.unit}"
                say(
                    f"outside: {band.title}: {finding.value:.3g}, people {band.low:g} to "
                    f"{band.high:g}{unit} ({finding.measured.events} events)"
                )
        counts = Counter(finding.verdict for finding in made.findings)
        say(
            f"{counts['pass']} pass, {counts['outside']} outside, "
            f"{counts['too few events']} with too few events"
        )
        say(f"{made.page}: the whole report; {len(made.figures)} figures in the folder next to it")


def _compare(first: Path, second: Path, out: Path | None, force: bool) -> None:
    """Write a page with two recorded runs side by side."""
    from gazerig.features.lab.report.compare import compare
    from gazerig.features.lab.report.page import refuse_foreign, report_files
    from gazerig.features.lab.report.report import FIGURE_KEYS
    from gazerig.robot.recording.read import RunRecording, report_bad_contents

    target = page_file(out or Path("compare.html"))
    refuse_foreign(report_files(target, FIGURE_KEYS), force)
    recordings = RunRecording(first), RunRecording(second)
    names = _names(first, second)
    abouts = (
        _recording_header(recordings[0], names[0]),
        _recording_header(recordings[1], names[1]),
    )
    with report_bad_contents(Path(f"{first} or {second}")), progress_bar() as tell:
        ticks = recordings[0].ticks(), recordings[1].ticks()
        made = compare(ticks, abouts, target, tell, force)
    if made.warning:
        say(made.warning)
    for one in made.differences:
        if one.a.verdict != one.b.verdict:
            unit = "" if one.a.band.unit in ("", "share") else f" {one.a.band.unit}"
            verdicts = f"{one.a.verdict}, {one.b.verdict}"
            say(f"{one.a.band.title}: {one.a.value:.3g} and {one.b.value:.3g}{unit} ({verdicts})")
    say(f"{made.page}: {len(made.differences)} measures of both runs beside those of people")


def _simulate_run(options: "RunOptions", tell: Steps) -> "tuple[RunHeader, GazeTrace]":
    """Run a scene in simulated time; Ctrl-C ends the run early."""
    from gazerig.config.schema import load_walk
    from gazerig.features.lab.simulated_run import simulate
    from gazerig.robot.app.run_rig import run_rig
    from gazerig.robot.control.tick import Tick

    rig = run_rig(options)
    seconds, start_s = options.seconds or 0.0, list[float]()
    text = f"simulating {seconds:.0f} s"

    def watch(tick: Tick) -> None:
        start_s[:] = start_s or [tick.t_s]
        tell(text, min(1.0, (tick.t_s - start_s[0]) / seconds))

    with record_signals() as stopped:
        run = simulate(rig, options, stopped, watch)
    layers = ("rig", options.rig), ("character", options.character), ("profile", options.profile)
    facts = (
        *((name, value) for name, value in layers if value is not None),
        ("scene", f"{options.scene}, simulated"),
        ("seed", str(options.seed)),
    )
    walk = load_walk(rig.gaze.scanpath.transition_matrix)
    name = " ".join(filter(None, (options.scene, options.character, options.profile)))
    return _run_header(name, facts, rig, walk), run.trace


def _recording_header(recording: "RunRecording", name: str) -> "RunHeader":
    """Describe a recorded run."""
    from gazerig.features.lab.report.page import RunHeader

    info = recording.info
    known = (
        ("recording", str(recording.path)),
        ("rig", info.rig),
        ("character", info.character or "none"),
        ("profile", info.profile),
        ("saw", f"scene {info.scene}" if info.scene else info.eyes),
        ("servos", info.bus if info.mock else "real"),
        ("time", "simulated" if info.fast else "real"),
        ("seed", str(info.seed)),
        ("started", info.started_utc.isoformat()),
        ("versions", ", ".join(f"{name} {v}" for name, v in sorted(info.versions.items()))),
    )
    warnings = (recording.note,) if recording.note else ()
    try:
        rig, walk = _load_config(info.config_yaml, info.walk_yaml)
    except ConfigError as error:
        first = str(error).splitlines()[0]
        cannot = f"the recorded configuration is not valid today, so no notes on it: {first}"
        return RunHeader(name, known, warnings=(*warnings, cannot), duration_s=recording.duration_s)
    made = _run_header(name, known, rig, walk)
    return replace(made, warnings=warnings, duration_s=recording.duration_s)


def _load_config(config_yaml: str, walk_yaml: str) -> "tuple[Rig, Walk]":
    """Read the configuration in a recording.

    Raises:
        gazerig.config.load.ConfigError: it is not valid in this version.
    """
    from gazerig.config.load import load
    from gazerig.config.rig import Rig
    from gazerig.config.schema import RULES, load_walk
    from gazerig.gaze.scanpath.scanpath import Walk

    with TemporaryDirectory(prefix="gazerig-report-") as folder:
        rig_file, walk_file = Path(folder) / "recorded.yaml", Path(folder) / "walk.yaml"
        rig_file.write_text(config_yaml, encoding="utf-8")
        rig = load(rig_file, Rig, checks=RULES)
        if not walk_yaml:
            return rig, load_walk(rig.gaze.scanpath.transition_matrix)
        walk_file.write_text(walk_yaml, encoding="utf-8")
        return rig, load(walk_file, Walk)


def _run_header(
    name: str,
    facts: tuple[tuple[str, str], ...],
    rig: "Rig",
    walk: "Walk",
) -> "RunHeader":
    """Return a run's description with the style of its gaze."""
    from gazerig.features.lab.report.face import rig_walk
    from gazerig.features.lab.report.page import RunHeader
    from gazerig.features.lab.report.servo_saccades import eye_servo_text

    gaze = rig.gaze
    styles = (
        f"saccade {gaze.saccade.profile}",
        f"scanpath {gaze.scanpath.model}",
    )
    servo = eye_servo_text(rig)
    shown = (
        ("saccades", gaze.saccade.profile),
        *(() if servo is None else (("eye servo", servo),)),
        ("face scanpath", f"{gaze.scanpath.model}, walk {gaze.scanpath.transition_matrix}"),
    )
    return RunHeader(name, (*facts, *shown), frozenset(styles), rig_walk(gaze.scanpath, walk))


def _names(first: Path, second: Path) -> tuple[str, str]:
    """Return two different short names."""
    if first.stem != second.stem:
        return first.stem, second.stem
    return f"{first.stem} (A)", f"{second.stem} (B)"


def page_file(out: Path) -> Path:
    """Return the file of a page, with a suffix that browsers open as a page."""
    if out.suffix.lower() in _PAGES:
        return out
    # Not with_suffix: the part after the dot of "evening-0.5" is not a suffix.
    return out.with_name(f"{out.name}.html")
