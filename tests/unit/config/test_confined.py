"""A person at a browser names shipped files and those in the rig's folder, and no others."""

import os
from dataclasses import replace
from pathlib import Path

import pytest
from fakes.runs import simulated

from gazerig.config.load import ConfigError
from gazerig.config.parameters import AllowedFolder
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.model.parameter import SavedFile
from gazerig.robot.run.requests import RequestHandler


@pytest.fixture
def home(tmp_path):
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig2").mkdir()
    (tmp_path / "secret.yaml").write_text("a: 1\n")
    (tmp_path / "rig" / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    (tmp_path / "rig" / "out").symlink_to(tmp_path)
    return tmp_path / "rig"


def test_files_beside_the_rig_and_shipped_names(home):
    confined = AllowedFolder(home)
    for given in ("mine.yaml", "below/mine.yaml", f"{home}/mine.yaml", "./x/../mine.yaml"):
        path = Path(confined.check_file(given))
        assert path.is_absolute() and path.is_relative_to(home)
    assert confined.check_file("shy", "characters") == "shy"
    confined.check_changes(
        {"gaze.scanpath.transition_matrix": "nakamoto_tsuruno", "gaze.lids.close_ms": 80.0}
    )
    confined.check_changes({"gaze": {"scanpath": {"transition_matrix": f"{home}/walk.yaml"}}})


@pytest.mark.parametrize(
    "given",
    [
        "/etc/shadow", "../secret.yaml", "link.yaml", "out/secret.yaml", "..", ".", "", "/",
        "../rig2/a.yaml", "/dev/zero", "/proc/self/environ", "a.yaml\0", "~root/a.yaml",
        "//etc/passwd",
    ],
)  # fmt: skip
def test_files_elsewhere_are_refused(home, given):
    with pytest.raises(ConfigError, match="only files in|nothing named"):
        AllowedFolder(home).check_file(given, "characters" if given else "")
    if given not in ("", ".", ".."):
        with pytest.raises(ConfigError):
            AllowedFolder(home).check_changes({"gaze.scanpath.transition_matrix": given})
        with pytest.raises(ConfigError):
            AllowedFolder(home).check_changes({"gaze.scanpath": {"transition_matrix": given}})


@pytest.mark.parametrize(
    "changes",
    [
        {"doors": ["wyoming"]}, {"bus.port": "/dev/ttyS0"}, {"bus": {"port": "/dev/ttyS0"}},
        {"buses.eyes.port": "/dev/ttyS0"}, {"sound.voice": "rm -r"}, {"sound": {"voice": ["rm"]}},
    ],
)  # fmt: skip
def test_what_starts_programs_or_opens_devices_is_not_set_from_the_network(home, changes):
    with pytest.raises(ConfigError, match="cannot be set over the network") as caught:
        AllowedFolder(home).check_changes({**changes, "gaze.lids.close_ms": 80.0})
    assert len(caught.value.faults) == 1


def test_the_page_reaches_no_file_elsewhere(home, tmp_path):
    rig = home / "mine.yaml"
    rig.write_text(Path("config/rigs/desk.yaml").read_text())
    made = simulated(str(rig))
    made.options = replace(made.options, rig=str(rig))
    hear = RequestHandler(made, TickFeed(), {}, confined=True).answer
    before = sorted(os.listdir(tmp_path))
    for asked in (
        {"do": "ask", "menu": "character", "choice": "/etc/shadow"},
        {"do": "save", "path": str(tmp_path / "made.yaml")},
        {"do": "save", "path": "~/made.yaml"},
        {"do": "set", "changes": {"gaze.scanpath.transition_matrix": "/etc/shadow"}},
        {"do": "set", "changes": {"sound.folders": ["/etc"]}},
    ):
        words = hear(asked)["refused"]
        assert isinstance(words, str) and "root:" not in words
        assert "only files in" in words and len(words.splitlines()) == 1
    assert sorted(os.listdir(tmp_path)) == before and not (Path.home() / "made.yaml").exists()
    saved = hear({"do": "save", "path": "copy.yaml"})["ok"]
    assert isinstance(saved, SavedFile) and saved.path == home / "copy.yaml"
    made.close()
