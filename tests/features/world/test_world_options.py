"""Options of a world on the command line, and refusals in one line."""

import re
from dataclasses import replace

import pytest

from gazerig.config.faults import ConfigError
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError, install_command
from gazerig.features.world.run.run_world import world_of
from gazerig.robot.run.options import RunOptions

ASKED = RunOptions(mock=True, world="living-room")


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"mock": False}, "--world needs --mock"),
        ({"scene": "visitor"}, "--scene and --world exclude each other"),
        ({"bus": "ideal", "fast": False}, "needs --fast: ideal servos"),
        ({"world": None, "no_pictures": True}, "--no-pictures needs --world"),
    ],
)
def test_what_does_not_fit_is_refused(changes, why):
    with pytest.raises(SetupError, match=why):
        replace(ASKED, **changes).check_and_complete()


def test_a_missing_package_says_how_to_install_it(monkeypatch):
    monkeypatch.setattr("gazerig.features.world.run.run_world.find_spec", lambda name: None)
    missing = re.escape(f"mujoco is not installed: {install_command('world')}")
    with pytest.raises(SetupError, match=missing):
        world_of(load_rig("desk"), ASKED)


def test_a_world_that_is_not_there_is_said_with_those_that_are(tmp_path):
    rig = load_rig("desk")
    with pytest.raises(ConfigError, match="living-room"):
        world_of(rig, replace(ASKED, world="living-rom"))
    with pytest.raises(SetupError, match="there is no such file"):
        world_of(rig, replace(ASKED, world=str(tmp_path / "mine.xml")))
