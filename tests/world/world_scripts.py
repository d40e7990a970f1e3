"""Scripts of worlds for tests, read as the program reads them."""

from pathlib import Path

from gazerig.config.load import load, shipped
from gazerig.config.shipped import shipped_names
from gazerig.features.world.script import HOME, WorldScript
from gazerig.features.world.script_faults import CHECKS

WORLDS = shipped_names("worlds", HOME)


def read(path: Path) -> WorldScript:
    return load(path, WorldScript, checks=CHECKS)


def shipped_world(name: str) -> WorldScript:
    return read(shipped("worlds", name, HOME))
