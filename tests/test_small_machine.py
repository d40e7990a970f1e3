"""docs/raspberry-pi.md is true: the profile small, the service, and the list of wheels."""

import configparser
import re
import shlex
import shutil
import subprocess
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from command_line import figures, parse
from papers import ROOT

from gazerig.config.load import shipped_names
from gazerig.config.parameters import value_of
from gazerig.config.schema import Rig, load_rig

PAPER = (ROOT / "docs/raspberry-pi.md").read_text(encoding="utf-8")
UNIT = ROOT / "docs/gazerig.service"


def rows(title: str) -> list[list[str]]:
    """Return the cells of the table that follows a line."""
    table = PAPER.split(f"{title}\n")[1].split("\n\n")[0]
    return [
        [cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[1:]
    ]


# ---- the profile


def test_the_table_of_the_profile_is_what_it_changes() -> None:
    small, plain = load_rig("desk", profile="small"), load_rig("desk")
    told = {}
    for keys, new, old in rows("| key | value | instead of |"):
        names = re.findall(r"`([\w.]+)`", keys)
        for key, value, before in zip(names, new.split(", "), old.split(", "), strict=True):
            told[key] = (float(value), float(before))
    assert told == {key: (value_of(small, key), value_of(plain, key)) for key in told}
    sections = {key.split(".")[0] for key in told}
    changed = {f.name for f in fields(Rig) if getattr(small, f.name) != getattr(plain, f.name)}
    assert changed - {"profile"} == sections
    text = (ROOT / "config/profiles/small.yaml").read_text(encoding="utf-8")
    assert len(re.findall(r"^  \w+:", text, re.MULTILINE)) == len(told) + 3  # and the ranges


@pytest.mark.parametrize("rig", shipped_names("rigs"))
def test_the_gaze_of_a_small_computer_is_that_of_any(rig: str) -> None:
    small, plain = load_rig(rig, profile="small"), load_rig(rig)
    assert small.gaze == plain.gaze and small.ranges == plain.ranges
    assert small.loop.rate_hz == 100.0


@pytest.mark.usefixtures("ideal_servos")
def test_a_head_looks_at_a_visitor_at_half_the_rate() -> None:
    found: dict[str, Any] = figures(
        "--profile", "small", "--scene", "face-to-face", "--seconds", "6"
    )
    assert found["ticks"] == pytest.approx(600, abs=2)
    assert found["faces_seen"] > 60 and found["stopped_by"] == "seconds"


# ---- the service


def unit() -> configparser.ConfigParser:
    """Read the unit."""
    parser = configparser.ConfigParser(interpolation=None, delimiters=("=",))
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read_string(UNIT.read_text(encoding="utf-8"))
    return parser


def test_the_service_runs_what_the_command_line_takes() -> None:
    program, *words = shlex.split(unit()["Service"]["ExecStart"])
    assert program.endswith("/bin/gazerig")
    parse(words)
    assert "small" in words


def test_the_service_parks_before_anything_is_killed() -> None:
    service = unit()["Service"]
    assert service["KillSignal"] == "SIGTERM"  # as gazerig.robot.control.interrupts heeds it
    # With any other the guardian would be killed before it has switched the servos off.
    assert service["KillMode"] == "control-group"
    slowest = max(load_rig(name).loop.park_s for name in shipped_names("rigs"))
    assert float(service["TimeoutStopSec"]) >= 2 * slowest + 10
    assert "20 s" in PAPER and service["TimeoutStopSec"] == "20"


def test_the_service_comes_back_after_a_fault_and_starts_at_boot() -> None:
    parsed = unit()
    assert parsed["Service"]["Restart"] == "on-failure"
    assert parsed["Unit"]["StartLimitIntervalSec"] == "0"  # or it gives up after five times
    assert parsed["Install"]["WantedBy"] == "default.target"
    assert f"every {parsed['Service']['RestartSec']} s" in PAPER


def test_systemd_finds_no_fault_in_the_service(tmp_path: Path) -> None:
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


# ---- the wheels


def test_the_list_of_wheels_is_that_of_the_dependencies() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = {}
    extras = project["optional-dependencies"]
    optional = [one for name in ("oak", "people", "report", "world") for one in extras[name]]
    for dependency in (*project["dependencies"], *optional):
        match = re.match(r"([\w.-]+)[><=!~]+([\d.]+)", dependency)
        assert match is not None, dependency
        wanted[match[1]] = match[2]
    told = {
        name: oldest
        for name, oldest, _, _ in rows("| package | oldest | newest then | wheel for aarch64 |")
    }
    assert set(told) == set(wanted), "check the wheel, and add it to docs/raspberry-pi.md"
    for name, oldest in told.items():
        assert oldest == wanted[name] or oldest.startswith(f"{wanted[name]}."), name
