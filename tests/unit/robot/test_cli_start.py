"""``gazerig`` alone suggests next steps; errors are one line."""

import logging
from collections.abc import Iterator
from importlib.metadata import version

import pytest
from command_line import typed

from gazerig import __version__
from gazerig.robot.cli.terminal import DEBUG_LOGGER

Terminal = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def as_before(monkeypatch) -> Iterator[None]:
    """Return a terminal of one width; what --debug sets is for one command."""
    monkeypatch.setenv("COLUMNS", "120")
    logger = logging.getLogger(DEBUG_LOGGER)
    level = logger.level
    yield
    logger.setLevel(level)


def test_gazerig_alone_shows_what_next_and_its_version_is_that_of_the_package(capfd):
    assert typed() == 0
    shown = capfd.readouterr()
    assert "What next?" in shown.out and not shown.err
    assert "gazerig run --mock" in shown.out and "gazerig --help" in shown.out
    assert typed("--version") == 0
    assert capfd.readouterr().out == f"gazerig {__version__}\n" == f"gazerig {version('gazerig')}\n"


def test_an_error_is_one_line_and_debug_shows_where_it_comes_from(tmp_path, capfd):
    assert typed("check", str(tmp_path / "none.yaml")) == 2
    short = capfd.readouterr().err
    assert len(short.strip().splitlines()) == 1
    for words in (("--debug", "check"), ("check", "--debug")):
        assert typed(*words, str(tmp_path / "none.yaml")) == 2
        long = capfd.readouterr().err
        assert "Traceback" in long
        assert long.strip().splitlines()[-1] == short.strip()
