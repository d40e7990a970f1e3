"""The commands under study: from a design to its report."""

import asyncio
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

import gazerig
from gazerig.config.load import shipped_path
from gazerig.config.shipped_files import shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.robot.cli.options import (
    CameraOption,
    MockOption,
    NoBrowserOption,
    OakOption,
    PortOption,
    run_option,
)
from gazerig.robot.cli.progress import progress_bar
from gazerig.robot.cli.run import is_desktop_here, open_page
from gazerig.robot.cli.terminal import clear_errors, record_signals, say
from gazerig.robot.model.clock import RealClock
from gazerig.robot.run.options import parse_camera, parse_host_port

HOME = Path(__file__).parent
app = typer.Typer(
    name="study",
    help="Design, run and analyse a blind study in which people judge two to six styles of gaze.",
    no_args_is_help=True,
)
StudyArgument = Annotated[
    str,
    typer.Argument(
        metavar="STUDY",
        help=f"A study's YAML file, or a shipped one: {', '.join(shipped_names('studies', HOME))}.",
    ),
]


@app.command()
def design(
    study: StudyArgument = "study.yaml",
    example: Annotated[
        bool, typer.Option("--example", help="Write an example with two gazes to STUDY.")
    ] = False,
) -> None:
    """Check a study's YAML."""
    with clear_errors():
        if example:
            write_file(Path(study), shipped_path("studies", "example", HOME).read_bytes())
            print(f"{study}: written; change it, then: gazerig study design {study}")
            return
        from gazerig.features.study.design import load_study

        found = load_study(study).design
        print(f"{study}: good: {found.title!r}, conditions {', '.join(found.conditions)}")
        print(f"next: gazerig study run {study} --simulate {found.participants} --data trial")


@app.command()
def run(
    study: StudyArgument = "study.yaml",
    participant: Annotated[
        int, typer.Option(metavar="N", min=0, help="Number of the participant; no names.")
    ] = 0,
    data: Annotated[
        Path | None, typer.Option(help="Folder of the data; default: NAME-data, after the file.")
    ] = None,
    mock: MockOption = False,
    port: PortOption = None,
    camera: CameraOption = None,
    oak: OakOption = False,
    page: Annotated[str, run_option("page")] = "127.0.0.1:8090",
    no_browser: NoBrowserOption = False,
    simulate: Annotated[
        int, typer.Option(metavar="N", min=0, help="Simulate N participants instead; 0: none.")
    ] = 0,
) -> None:
    """Run a participant's session in the browser; the same command resumes it."""
    with clear_errors(None, port, mock):
        from gazerig.features.study.design import SEED, load_study
        from gazerig.features.study.film import films
        from gazerig.features.study.journal import Journal, StudyFolder
        from gazerig.features.study.server import StudyServer
        from gazerig.features.study.session import StudySession
        from gazerig.features.study.simulate import simulate_study

        if (participant == 0) == (simulate == 0):
            raise SetupError("write --participant N, or --simulate N for simulated participants")
        found = load_study(study)
        folder = StudyFolder(data or Path(f"{Path(study).stem}-data"))
        shown, now_s = found.design.presentation, RealClock().now_s
        with ExitStack() as stack:
            if simulate:
                simulate_study(found, folder, simulate, seed=0)
                print(f"next: gazerig study analyse {folder.path}")
                return
            folder.claim(found)
            head, made = None, dict[str, Path]()
            stopped = stack.enter_context(record_signals())
            journal = Journal(folder.participant(participant))
            stack.callback(journal.close)
            if shown.on == "film":
                with progress_bar() as steps:
                    made = films(found, folder.path / "films", steps)
            else:
                seen = parse_camera(camera)
                drawn = seen is None and not oak
                if drawn and not mock:
                    raise SetupError("the head needs a camera: --camera N, --oak, or --mock")
                opened = gazerig.open(
                    found.rig_name, mock=mock, port=port, camera=seen, oak=oak, say=say,
                    scene=shown.scene if drawn else None, seed=SEED,
                )  # fmt: skip
                head = stack.enter_context(opened)
            session = StudySession(
                found, participant, journal, now_s,
                lambda: datetime.now(UTC).isoformat(timespec="milliseconds"), head,
            )  # fmt: skip
            if session.closed:
                raise SetupError(f"{session.code} has ended the session already: take another")
            server = StudyServer(
                session, parse_host_port(page), folder.participant(participant), made, say
            )
            say(f"participant: {server.url}")
            if not no_browser and is_desktop_here():
                open_page(server.url)
            try:
                asyncio.run(server.serve(stopped))
            except gazerig.Error as lost:
                raise SetupError(f"{lost}; the same command resumes the session") from lost
            if not session.closed:
                print("not over: the same command resumes it")


@app.command()
def analyse(
    data: Annotated[
        Path, typer.Argument(metavar="DATA", help="Folder of the study's data, such as study-data.")
    ],
) -> None:
    """Analyse a study: one page with tests, tables and figures, and the answers as CSV."""
    with clear_errors():
        from gazerig.features.study.analyse import analyse_study
        from gazerig.features.study.report import write_report

        study = analyse_study(data)
        page = write_report(study, data / "report")
        for one in study.decisions:
            what = f"{one.hypothesis.measure}: {one.hypothesis.better} > {one.hypothesis.than}"
            print(f"{what}: {one.verdict} (corrected p = {one.corrected_p:.3g}, n = {one.n})")
        print(f"{page}: the report; answers.csv next to it")
