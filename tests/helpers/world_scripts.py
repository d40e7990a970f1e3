"""Scripts of worlds for tests, read as the program reads them."""

from pathlib import Path

from gazerig.config.load import load, shipped_path
from gazerig.config.shipped_files import shipped_names
from gazerig.features.world.room import HOME
from gazerig.features.world.timeline import CHECKS
from gazerig.sim_mock.scenes.script import SceneScript

WORLDS = shipped_names("worlds", HOME)


def read(path: Path) -> SceneScript:
    return load(path, SceneScript, checks=CHECKS)


def shipped_world(name: str) -> SceneScript:
    return read(shipped_path("worlds", name, HOME))
