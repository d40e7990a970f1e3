"""The load level of a computer is a function of measured figures; options override it."""

import pytest

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.computer import (
    ComputerFigures,
    load_level,
)
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run_rig import with_options

CARD, SOFTWARE = False, True


@pytest.mark.parametrize(
    ("cores", "late", "share", "software", "level"),
    [
        (8, 0.00, 1.00, CARD, "full"),
        (2, 0.00, 1.00, CARD, "full"),
        (2, 0.00, 1.00, SOFTWARE, "small"),
        (1, 0.00, 1.00, CARD, "small"),
        (8, 0.08, 1.00, CARD, "small"),
        (8, 0.02, 0.70, CARD, "small"),
        (8, 0.30, 0.95, CARD, "busy"),
        (2, 0.02, 0.67, SOFTWARE, "least"),  # two busy processes
        (1, 0.00, 1.00, SOFTWARE, "least"),
    ],
)
def test_the_level_of_a_computer(cores, late, share, software, level):
    assert load_level(ComputerFigures(cores, late, share, software)) == level


@pytest.mark.parametrize(
    ("options", "rate_hz"),
    [
        ({}, 200.0),
        ({"computer": "full"}, 200.0),
        ({"computer": "small"}, 100.0),
        ({"computer": "least"}, 50.0),
        ({"computer": "least", "rate": 150.0}, 150.0),
        ({"rate": 400.0}, 400.0),
    ],
)
def test_the_rate_of_a_level_and_the_option_that_overrides_it(options, rate_hz):
    asked = RunOptions(mock=True, **options)
    assert with_options(load_rig("desk"), asked.check_and_complete()).loop.rate_hz == rate_hz


def test_a_busy_computer_renders_no_pictures_of_a_world():
    for level, bare in (("full", False), ("small", False), ("busy", True), ("least", True)):
        asked = RunOptions(mock=True, world="living-room", computer=level).check_and_complete()
        assert asked.no_pictures is bare
    assert not RunOptions(mock=True, computer="busy").check_and_complete().no_pictures  # in a scene


def test_an_unknown_level_is_refused_with_the_known_ones():
    with pytest.raises(SetupError, match="full, small, busy, least"):
        RunOptions(mock=True, computer="huge").check_and_complete()
