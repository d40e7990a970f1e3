"""Ends of the command run in real time: by a signal."""

import json
import signal
import subprocess
import time
from pathlib import Path

import pytest
from branch import Branch, gazerig
from slow_rigs import at_rate


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
    assert any("Return Delay Time" in line for line in iter(process.stderr.readline, ""))
    return process


@pytest.mark.slow
def test_signals_park_and_switch_torque_off(tmp_path: Path) -> None:
    rig = at_rate(tmp_path, "desk", 50.0)
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
