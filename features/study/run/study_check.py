"""Complete check of a study, including scenes, worlds, and measures of the report."""

from collections.abc import Iterator
from functools import partial
from os.path import isfile

from gazerig.config.export import suggestion
from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.film_writer import film_seconds
from gazerig.features.study.design import StudyDesign
from gazerig.features.study.rules import objective_rules
from gazerig.features.study.run.study_file import LoadedStudy, load_study
from gazerig.features.study.study_run import WHOLE_SHARE
from gazerig.robot.analysis.human_norms import BY_KEY
from gazerig.robot.app.scene_files import scene_names
from gazerig.robot.app.surroundings import surroundings_names
from gazerig.robot.recording.read import BadRecording, RunRecording


def checked_study(name_or_path: str) -> LoadedStudy:
    """Return a study by shipped name or path, with every rule checked.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    return load_study(
        name_or_path, _surroundings, partial(objective_rules, known=BY_KEY), _recordings, _films
    )


def _surroundings(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield unknown scenes and worlds."""
    scene, world = design.presentation.scene, design.presentation.world
    known = scene_names()
    if scene is not None and scene not in known:
        near = suggestion(scene, known) or ";"
        yield "presentation.scene", f"no scene {scene!r}{near} there is {', '.join(known)}"
    worlds = surroundings_names()
    if world is not None and "/" not in world and "." not in world and world not in worlds:
        near = suggestion(world, worlds) or ";"
        there = ", ".join(worlds) or "none"
        yield "presentation.world", f"no world {world!r}{near} there is {there}"


def _recordings(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield recordings that the rig cannot repeat for a whole trial."""
    for key, one in design.conditions.items():
        if one.recording is None or not isfile(one.recording):
            continue
        try:
            run = RunRecording(one.recording)
            names = next(run.ticks()).guard_result.joints
            rig = load_rig(one.rig or design.presentation.rig)
        except ConfigError:
            continue  # reported at the rig
        except (BadRecording, StopIteration) as error:
            yield f"conditions.{key}.recording", str(error) or "holds no tick; record it again"
            continue
        if names != rig.names:
            other = ", ".join(sorted({*names} ^ {*rig.names}))
            rule = (
                f"is of a rig with other joints ({other}); name that rig, or record with this one"
            )
            yield f"conditions.{key}.recording", rule
        if run.duration_s < design.trials.seconds:
            rule = (
                f"lasts {run.duration_s:.1f} s, and a trial {design.trials.seconds:g} s: shorten "
                "trials.seconds, or record longer"
            )
            yield f"conditions.{key}.recording", rule


def _films(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield films that are too short for a presentation."""
    wanted_s = design.trials.seconds
    for key, one in design.conditions.items():
        if one.film is None or not isfile(one.film):
            continue
        try:
            seconds = film_seconds(one.film)
        except SetupError as error:
            yield f"conditions.{key}.film", str(error)
            continue
        if seconds < WHOLE_SHARE * wanted_s:
            rule = (
                f"lasts {seconds:.1f} s, and a trial {wanted_s:g} s: shorten trials.seconds, or "
                "take a longer film"
            )
            yield f"conditions.{key}.film", rule
