"""The commands that run a study: its films, a participant's session, and deletion."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.drivers.errors import SetupError
from gazerig.features.study.cli.design import DataOption, StudyArgument, data_folder, design_state
from gazerig.robot.app.options import RunOptions, parse_camera, parse_host_port
from gazerig.robot.cli import run_options as options
from gazerig.robot.cli.browser import is_desktop_here, open_page
from gazerig.robot.cli.progress_bar import progress_bar
from gazerig.robot.cli.terminal import clear_errors, confirm, record_signals, say

if TYPE_CHECKING:
    from gazerig.features.study.data_folder import StudyData
    from gazerig.features.study.run.study_file import LoadedStudy

PAGE = "127.0.0.1:8090"
"""Address of the pages."""

Participant = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, max=999_999, help="Number of the participant; no names."),
]


def run(
    study: StudyArgument = "study.yaml",
    participant: Participant = None,
    data: DataOption = None,
    mock: options.Mock = False,
    port: options.Port = None,
    camera: options.Camera = None,
    oak: options.Oak = False,
    page: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="Address of the pages; for a phone or another computer 0.0.0.0:8090.",
        ),
    ] = PAGE,
    no_browser: options.NoBrowser = False,
    simulate: Annotated[
        int,
        typer.Option(
            metavar="N", min=0, max=5000, help="Simulate N participants instead; 0: none."
        ),
    ] = 0,
    effect: Annotated[
        float,
        typer.Option(min=-3.0, max=3.0, help="With --simulate: d_z of neighbouring conditions."),
    ] = 0.6,
    seed: Annotated[int, typer.Option(min=0, help="With --simulate: seed of the answers.")] = 0,
) -> None:
    """Run a participant's session in the browser; the same command resumes it."""
    with clear_errors(None, port, mock):
        if (participant is None) == (not simulate):
            raise SetupError("say --participant N, or --simulate N for simulated ones")
        from gazerig.features.study.data_folder import StudyData
        from gazerig.features.study.run.study_file import load_checked_study

        found = load_checked_study(study)
        folder = StudyData(data_folder(found, data))
        if participant is None:
            from gazerig.features.study.run.simulated_session import simulate_study
            from gazerig.features.study.simulation import Population

            drawn = Population(effect=effect, seed=seed)
            with progress_bar() as steps:
                simulate_study(
                    found, folder, simulate, drawn, lambda share: steps("participants", share)
                )
            said = f"{simulate} simulated participants, d_z = {effect:g}, seed {seed}"
            print(f"{folder.folder}: {said}")
            print(f"next: gazerig study analyse {folder.folder}")
            return
        design_state(study, found, folder.folder)
        from gazerig.features.study.run.participant import SessionPlan, run_session
        from gazerig.robot.model.clock import RealClock

        asked = RunOptions(
            mock=mock,
            port=port,
            camera=parse_camera(camera),
            oak=oak,
            seed=found.design.presentation.seed,
        )
        head = _head(found, asked)
        films = {} if head is not None else _films(found, folder)
        plan = SessionPlan(found, folder, participant, parse_host_port(page), films, head)
        browse = open_page if not no_browser and is_desktop_here() else None
        with record_signals() as stopped:
            print(run_session(plan, stopped, say, RealClock(), browse))


def film(study: StudyArgument = "study.yaml", data: DataOption = None) -> None:
    """Make the films of a study's conditions; those that are there already are kept."""
    with clear_errors():
        from gazerig.features.study.data_folder import StudyData
        from gazerig.features.study.run.study_file import load_checked_study

        found = load_checked_study(study)
        for key, path in _films(found, StudyData(data_folder(found, data))).items():
            print(f"{key}: {path}")


def delete(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Folder of the study's data.")],
    participant: Annotated[
        int, typer.Option(metavar="N", min=1, max=999_999, help="Number of the participant.")
    ],
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Delete all data of a participant, and the reports made of them; this cannot be undone."""
    with clear_errors():
        from gazerig.features.study.data_folder import StudyData, participant_code

        code = participant_code(participant)
        question = f"Delete all data of {code} in {data}? This cannot be undone."
        if not yes and not confirm(question, err=True):
            raise typer.Exit(1)
        count = StudyData(data).delete(participant)
        print(f"{code}: {count} files deleted; make the report again: gazerig study analyse {data}")


def _head(study: "LoadedStudy", asked: RunOptions) -> RunOptions | None:
    """Return the options of the head's run, None for films.

    Raises:
        SetupError: options of a head with films, or a scene with real servos.
    """
    shown = study.design.presentation
    if shown.on == "film":
        given = [
            name
            for name, said in {
                "--mock": asked.mock, "--port": asked.port, "--camera": asked.camera, "--oak": asked.oak,
            }.items()
            if said
        ]  # fmt: skip
        if given:
            raise SetupError(
                f"{given[0]}: the study shows films, and no head runs (presentation.on: film)"
            )
        return None
    looks = {} if asked.camera_source else {"scene": shown.scene, "world": shown.world}
    return replace(asked, rig=shown.rig, no_page=True, **looks).check_and_complete()  # type: ignore[arg-type]


def _films(study: "LoadedStudy", data: "StudyData") -> Mapping[str, Path]:
    """Return the films of a study; missing ones are rendered."""
    from gazerig.features.study.run.film import films

    with progress_bar(remaining=True) as steps:

        def progress(condition: str) -> Callable[[float], None]:
            return lambda share: steps(f"film of {condition}", share)

        return films(study, data.films, progress)
