"""``gazerig`` alone suggests next steps; help has examples that parse; errors are one line."""

import logging
import signal
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import pytest
from command_line import gazerig, typed

from gazerig import __version__
from gazerig.robot.cli.command_list import Commands
from gazerig.robot.cli.terminal import DEBUG_LOGGER, exit_on_signals

Terminal = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def as_before(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Return a terminal of one width; what --debug sets is for one command."""
    monkeypatch.setenv("COLUMNS", "120")
    logger = logging.getLogger(DEBUG_LOGGER)
    level = logger.level
    yield
    logger.setLevel(level)


def test_gazerig_alone_shows_it_and_is_no_error():
    done = gazerig()
    assert done.returncode == 0 and "What next?" in done.stdout and not done.stderr
    assert "gazerig run --mock" in done.stdout and "gazerig --help" in done.stdout


def test_the_list_of_commands_is_that_of_their_modules():
    listed = Commands()
    for name, entry in listed.entries.items():
        command = listed[name]
        assert command.name == name and command.rich_help_panel == entry.panel
        first = " ".join(command.help.split("\n\n")[0].split())
        assert entry.summary == first, f"{name}: mend cli/command_list.py"


def test_the_version_is_that_of_the_package(capfd: Terminal):
    assert typed("--version") == 0
    assert capfd.readouterr().out == f"gazerig {__version__}\n" == f"gazerig {version('gazerig')}\n"


def test_an_error_is_one_line_and_debug_shows_where_it_comes_from(tmp_path: Path, capfd: Terminal):
    assert typed("check", str(tmp_path / "none.yaml")) == 2
    short = capfd.readouterr().err
    assert len(short.strip().splitlines()) == 1
    for words in (("--debug", "check"), ("check", "--debug")):
        assert typed(*words, str(tmp_path / "none.yaml")) == 2
        long = capfd.readouterr().err
        assert "Traceback" in long
        assert long.strip().splitlines()[-1] == short.strip()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_request_to_end_while_a_run_is_made_ends_it_in_order(number: signal.Signals):
    before = signal.signal(number, signal.SIG_DFL)
    tidied = False
    try:
        with pytest.raises(SystemExit) as end, exit_on_signals():
            try:
                signal.raise_signal(number)
            finally:
                tidied = True
        assert (end.value.code, tidied) == (128 + number, True)
        assert signal.getsignal(number) == signal.SIG_DFL
    finally:
        signal.signal(number, before)
