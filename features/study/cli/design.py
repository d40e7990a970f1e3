"""The command ``gazerig study design``: checks and pre-registers a study."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.config.shipped_files import shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.study.shipped import HOME
from gazerig.robot.cli.examples import complete_shipped
from gazerig.robot.cli.terminal import ForceOption, clear_errors, say

if TYPE_CHECKING:
    from gazerig.features.study.run.study_file import LoadedStudy

DEFAULT, PREREGISTRATION = "study.yaml", "preregistration.md"
EXAMPLE = """\
# A study of two gazes: does blinking look natural? Change it, then: gazerig study design study.yaml
title: Blinking against staring
welcome: # what participants read first; it must not tell what differs
  - You will see short films of a robot's face and answer two questions about each.
conditions: # two to six; each says what differs from the rig below
  blinks: {}
  stares:
    params: # any key of a rig's YAML; gazerig ctl get lists them. Or profile:, character:, scanpath:
      gaze.lids.blinks_per_min: 0.0
      gaze.lids.conversation_per_min: 0.0
presentation:
  on: film # films in the browser; head: the head in the room
  rig: expressive
  scene: face-to-face # what an emulated head looks at
trials:
  seconds: 20
questionnaires: [nakamoto_tsuruno] # or godspeed, rosas, free_text; choice with task: pairwise
hypotheses:
  - measure: nakamoto_tsuruno.naturalness
    better: blinks
    than: stares
plan:
  participants: 26
privacy:
  contact: "" # whom participants write to
"""
"""A design to start from; written by --example."""

StudyArgument = Annotated[
    str,
    typer.Argument(
        metavar="STUDY",
        help=f"A study's YAML file, or a shipped one: {', '.join(shipped_names('studies', HOME))}.",
        autocompletion=complete_shipped("studies", HOME),
    ),
]
DataOption = Annotated[
    Path | None,
    typer.Option("--data", help="Folder of the study's data; default: NAME-data, after the file."),
]


def design(
    study: StudyArgument = DEFAULT,
    data: DataOption = None,
    example: Annotated[
        bool, typer.Option("--example", help="Write an example with two gazes to STUDY.")
    ] = False,
    force: ForceOption = False,
) -> None:
    """Check a study's YAML, compute its sample size, and write its pre-registration."""
    if example:
        with clear_errors():
            write_file(Path(study), EXAMPLE, force)
            print(f"{study}: written; change it, then: gazerig study design {study}")
        return
    with clear_errors():
        if study == DEFAULT and not Path(study).exists():
            raise SetupError(
                f"there is no {study} here: name a study, or gazerig study design --example {study}"
            )
        from gazerig.features.study.run.study_file import load_checked_study

        found = load_checked_study(study)
        for line in design_summary(study, found):
            print(line)
        folder = data_folder(found, data)
        written = write_preregistration(found, folder, force)
        for note in design_notes(found):
            say(f"note: {note}")
        said = "written" if written else "as it was"
        print(f"{folder / PREREGISTRATION}: {said}; sha256 {found.sha256}")
        print(f"next: gazerig study run {study} --participant 1")


def data_folder(study: "LoadedStudy", data: Path | None) -> Path:
    """Return the folder of a study's data."""
    return data if data is not None else Path(f"{study.name}-data")


def write_preregistration(study: "LoadedStudy", folder: Path, force: bool = False) -> bool:
    """Write a study's pre-registration into its data folder; return whether it was new.

    Raises:
        SetupError: the folder has data of another design, or a different pre-registration without
            ``force``, or cannot be written.
    """
    import gazerig
    from gazerig.features.study.data_folder import StudyData
    from gazerig.features.study.preregistration_text import preregistration_text

    sha256, file = StudyData(folder).check(study.canonical), folder / PREREGISTRATION
    changes = {key: study.changes(None, key) for key in study.design.conditions}
    stated = preregistration_text(
        study.design, study.questionnaires, changes, sha256, gazerig.__version__
    )
    if file.is_file() and file.read_text(encoding="utf-8") == stated:
        return False
    make_folder(folder)
    write_file(file, stated, force)
    return True


def design_state(name: str, study: "LoadedStudy", folder: Path) -> None:
    """Make sure that a study is pre-registered before the first participant; report a new one.

    Raises:
        SetupError: the pre-registration or the data there belong to another design.
    """
    from gazerig.features.study.data_folder import StudyData

    data, file = StudyData(folder), folder / PREREGISTRATION
    sha256 = data.check(study.canonical)
    if not file.exists():
        before = "before the first participant"
        if data.numbers():
            before = f"anew after {len(data.numbers())} participants; it was not there any more"
        write_preregistration(study, folder)
        say(f"{file}: written {before}")
    elif sha256 not in file.read_text(encoding="utf-8"):
        raise SetupError(
            f"{file} states another design than {name} is now; nobody has taken part yet, so "
            f"state it anew: gazerig study design {name} --force"
        )


def design_summary(name: str, study: "LoadedStudy") -> list[str]:
    """Return a short description of a study, in lines."""
    from gazerig.features.study.preregistration_text import (
        claims_of,
        hypothesis_sentence,
        minutes,
        size_words,
    )
    from gazerig.features.study.trial_order import participant_order

    design = study.design
    keys = ", ".join(design.conditions)
    trials = len(participant_order(design, 1))
    lines = [
        f"{name}: good: {design.title!r}, {len(design.conditions)} conditions ({keys})",
        f"{design.plan.participants} participants, {trials} trials each, "
        f"about {minutes(design, study.questionnaires)} minutes",
    ]
    for i, (one, found) in enumerate(
        zip(design.hypotheses, claims_of(design, study.questionnaires), strict=True), 1
    ):
        lines += [
            f"hypothesis {i}: {hypothesis_sentence(one, design)}",
            f"  {size_words(design, found)}",
        ]
    return lines


def design_notes(study: "LoadedStudy") -> list[str]:
    """Return remarks about permitted but unusual settings."""
    from gazerig.features.study.preregistration_text import claims_of

    design, found = study.design, []
    claims = claims_of(design, study.questionnaires)
    if not claims:
        found.append("no hypothesis is stated: the study is exploratory and decides nothing")
    needed = [one.needed for one in claims if one.needed is not None]
    if any(one.needed is None or one.needed > one.participants for one in claims):
        enough = f"plan.participants: {max(needed)}" if len(needed) == len(claims) else "see above"
        found.append(
            f"{design.plan.participants} participants are too few for d_z = {design.plan.effect:g} "
            f"with power {design.plan.power:g}: {enough}"
        )
    if not design.privacy.contact:
        found.append("privacy.contact is empty: participants do not know whom to write to")
    if design.privacy.pictures:
        found.append("pictures of participants are kept; the consent page asks them for it")
    for key, one in study.questionnaires.items():
        items = [texts for item in one.items.values() for texts in (item.text, item.low, item.high)]
        if any(texts and design.language not in texts for texts in (one.instruction, *items)):
            found.append(f"{key} is not all in {design.language!r}; English stands where it is not")
    return found
