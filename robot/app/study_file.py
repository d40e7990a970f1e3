"""A study checked with all that the program knows: scenes, worlds, measures of the report."""

from collections.abc import Iterator

from gazerig.config.export import suggestion
from gazerig.config.load import shipped_names
from gazerig.config.study_file import LoadedStudy, load_study
from gazerig.robot.analysis.norm_bands import BY_KEY
from gazerig.robot.study.design import StudyDesign
from gazerig.robot.study.rules import objective_rules
from gazerig.sim_mock.scenes.registry import scenes


def checked_study(name_or_path: str) -> LoadedStudy:
    """Return a study by shipped name or path, with every rule checked.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    return load_study(name_or_path, _surroundings, _objective)


def _objective(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Find objective measures that neither the page nor the report has."""
    yield from objective_rules(design, BY_KEY)


def _surroundings(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Find scenes and worlds that there are not."""
    scene, world = design.presentation.scene, design.presentation.world
    known = scenes()
    if scene is not None and scene not in known:
        near = suggestion(scene, known) or ";"
        yield "presentation.scene", f"no scene {scene!r}{near} there is {', '.join(sorted(known))}"
    worlds = shipped_names("worlds")
    if world is not None and "/" not in world and "." not in world and world not in worlds:
        near = suggestion(world, worlds) or ";"
        yield "presentation.world", f"no world {world!r}{near} there is {', '.join(worlds)}"
