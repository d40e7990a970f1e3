"""Ends of the command run in real time: by a signal, or because the bus is lost."""

import json
import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from branch import Branch, gazerig

LINK = re.compile(rb'"link": "([^"]+)"')
"""The name of an emulated bus, in the command line of its process."""

DESK = Path(__file__).parents[1] / "config" / "rigs" / "desk.yaml"


def rig_at(file: Path, rate_hz: float, give_up_s: float = 60.0) -> str:
    """Write the desk rig with another rate and another time-out of its bus."""
    desk = DESK.read_text(encoding="utf-8")
    # The servo bus comes first in the file; a camera has the same key.
    assert desk.index("give_up_s: 60.0") < desk.index("geometry:")
    assert desk.count("rate_hz: 200.0  # Hz, 20") == 1
    # A machine that does much else may keep answers waiting: that is no fault of a joint here.
    assert desk.count("joint_timeout_ms: 150.0") == 1
    desk = desk.replace("joint_timeout_ms: 150.0", "joint_timeout_ms: 5000.0")
    desk = desk.replace("rate_hz: 200.0  # Hz, 20", f"rate_hz: {rate_hz}  # Hz, 20")
    file.write_text(desk.replace("give_up_s: 60.0", f"give_up_s: {give_up_s}", 1), encoding="utf-8")
    return str(file)


def begun(*words: str) -> "subprocess.Popen[str]":
    """Start a run in a process of its own; give it once torque is on."""
    process = Branch(
        gazerig("run", *words, "--mock", "--verbose", "--no-page", "--summary", "-"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    # Registers set at start-up are reported once torque is on.
    assert process.stderr is not None
    assert any("Indirect Addresses set" in line for line in iter(process.stderr.readline, ""))
    return process


@pytest.mark.slow
def test_signals_park_and_switch_torque_off(tmp_path: Path) -> None:
    rig = rig_at(tmp_path / "rig.yaml", 50.0)
    numbers = (signal.SIGINT, signal.SIGTERM)
    processes = [begun(rig) for _ in numbers]
    time.sleep(2.0)
    for number, process in zip(numbers, processes, strict=True):
        process.send_signal(number)
    for number, process in zip(numbers, processes, strict=True):
        out, err = process.communicate(timeout=30)
        assert process.returncode == 0, err
        name = signal.Signals(number).name
        assert f"stopped by {name}: parked, torque off" in err
        run = json.loads(out)
        assert run["stopped_by"] == name
        assert run["target_share"].get("face", 0.0) > 0.0


def test_losing_the_bus_is_a_fault_with_its_cause(tmp_path: Path) -> None:
    rig = rig_at(tmp_path / "rig.yaml", 100.0, give_up_s=1.0)
    process = begun(rig, "--seconds", "30")
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    for child in children.read_text(encoding="ascii").split():
        # The system gives a freed terminal's number to whoever asks next: another test's servos
        # would answer under this name, were the link to it left.
        for link in LINK.findall(Path(f"/proc/{child}/cmdline").read_bytes()):
            os.unlink(link)
        os.kill(int(child), signal.SIGKILL)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "port lost" in err and "torque-off could not be sent" in err
    assert json.loads(out)["stopped_by"].startswith("fault: ")
