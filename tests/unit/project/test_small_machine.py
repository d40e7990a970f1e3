"""docs/small-computers.md is true: the profile small and the service."""

import configparser
import re
import shutil
import subprocess

import pytest
from papers import ROOT

from gazerig.config.load import shipped_names
from gazerig.config.schema import load_rig
from gazerig.robot.loop.loop import PARK_S

PAPER = (ROOT / "docs/small-computers.md").read_text(encoding="utf-8")
UNIT = ROOT / "docs/gazerig.service"


# ---- the profile


@pytest.mark.parametrize("rig", shipped_names("rigs"))
def test_the_gaze_of_a_small_computer_is_that_of_any(rig):
    small, plain = load_rig(rig, profile="small"), load_rig(rig)
    assert small.gaze == plain.gaze and small.ranges == plain.ranges
    assert small.loop.rate_hz == 100.0


# ---- the service


def unit() -> configparser.ConfigParser:
    """Read the unit."""
    parser = configparser.ConfigParser(interpolation=None, delimiters=("=",))
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read_string(UNIT.read_text(encoding="utf-8"))
    return parser


def test_the_service_parks_before_anything_is_killed():
    service = unit()["Service"]
    assert service["KillSignal"] == "SIGTERM"  # as gazerig.robot.loop.power_down heeds it
    # With any other the guardian would be killed before it has switched the servos off.
    assert service["KillMode"] == "control-group"
    assert float(service["TimeoutStopSec"]) >= 2 * PARK_S + 10
    assert "20 s" in PAPER and service["TimeoutStopSec"] == "20"


def test_systemd_finds_no_fault_in_the_service(tmp_path):
    program = shutil.which("systemd-analyze")
    if program is None:
        pytest.skip("no systemd-analyze here")
    text = UNIT.read_text(encoding="utf-8")
    file = tmp_path / "gazerig.service"
    file.write_text(re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", text, flags=re.MULTILINE))
    done = subprocess.run(
        [program, "--user", "verify", file], env={"XDG_RUNTIME_DIR": str(tmp_path), "HOME": "/tmp"},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0 and not done.stderr, done.stderr
