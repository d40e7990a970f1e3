"""Two heads in one world in real time: whatever ends one of them, both park and let go."""

import os
import pickle
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from branch import Branch, gazerig

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install -e '.[world]'")
from gazerig.config.load import shipped_path
from gazerig.drivers.errors import SetupError
from gazerig.features.world.run.head_group import HeadGroup, compose_group
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.robot_group import RobotGroup
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import MIN_HOLD_S, MIN_RESUME_GAP_S, Resume, Stop

pytestmark = [pytest.mark.pty, pytest.mark.slow, pytest.mark.own_timeouts]

LET_GO = "(not )?parked, torque off"
"""On a starved machine the time for parking runs out; that it is skipped is told otherwise."""

ASKED = RunOptions(mock=True, world="two-heads", no_pictures=True, rig="minimal", no_page=True)
COMMAND = ("run", "minimal", "--mock", "--world", "two-heads", "--no-pictures", "--no-page")
branched = pytest.mark.usefixtures("branched_children_here")


@pytest.fixture
def group(tmp_path: Path) -> HeadGroup:
    """Return two heads whose loops are slow, and whose buses are given up after a second."""
    file = tmp_path / "quick.yaml"
    text = shipped_path("rigs", "minimal").read_text(encoding="utf-8")
    file.write_text(
        text.replace("kind: dynamixel,", "kind: dynamixel, dynamixel: {give_up_s: 1.0},")
        + "loop: {rate_hz: 100}\n"
    )
    return compose_group(replace(ASKED, rig=str(file)).check_and_complete())


@branched
def test_a_fault_of_one_head_parks_the_other_and_both_let_go(group: HeadGroup) -> None:
    fault = group.members[0].composed.assembly.inject_fault
    assert fault is not None
    lines, ticks = list[str](), list[float]()

    def watch(tick: Tick) -> None:
        ticks.append(tick.t_s)
        if len(ticks) == 20:
            fault("other: unplug")

    figures = group.run(lambda: None, lines.append, watch=watch)
    heads = figures["heads"]
    assert isinstance(heads, dict)
    why = heads["other"]["stopped_by"]
    assert why.startswith("fault")
    assert figures["stopped_by"] == f"the end of head other ({why})"
    assert any(
        re.fullmatch(rf"stopped by the end of head other \({re.escape(why)}\): {LET_GO}", line)
        for line in lines
    )
    assert any(line.startswith(f"other: stopped by {why}: ") for line in lines)


@branched
def test_a_stop_stops_both_and_a_resume_frees_both(group: HeadGroup) -> None:
    first, other = (member.composed.assembly.robot for member in group.members)
    together = RobotGroup(first, group.members[0].composed.assembly.other_heads)
    asked, lines = Interrupts(signals=False), list[str]()
    asked_s, seen = list[float](), list[tuple[bool, bool]]()

    def watch(tick: Tick) -> None:
        if not asked_s:
            asked_s.append(tick.t_s)
            together.command(Stop("too near", "a test"))
        elif not seen and tick.t_s - asked_s[0] > MIN_HOLD_S + 0.1:
            seen.append((bool(first.stopped), bool(other.stopped)))
        elif seen and not first.stopped and not other.stopped:
            seen.append((False, False))
            asked.request("the test")
        # A late head may have stopped later and refuse: then the request must be repeated.
        if len(seen) == 1 and tick.t_s - asked_s[-1] > MIN_RESUME_GAP_S:
            asked_s.append(tick.t_s)
            together.command(Resume("a test"))
            if len(asked_s) > 20:
                asked.request("the test: it stays stopped")

    group.run(asked, lines.append, watch=watch)
    assert seen == [(True, True), (False, False)]
    ends = [line for line in lines if "stopped by the test: " in line]
    assert len(ends) == 2 and all(re.search(f": {LET_GO}$", line) for line in ends)


@branched
def test_the_page_is_shown_the_other_head_where_it_is(group: HeadGroup) -> None:
    made = group.members[0].composed.assembly
    assert made.room is not None
    shapes = pickle.loads(pickle.dumps(made.room.shapes()))  # as to the page's process
    parts = {part.name: part for part in shapes.parts()}
    head = next(name for name in parts if name.startswith("other_") and "eye" in name)
    assert parts[head].moves and not [name for name in parts if name.startswith("rig_")]
    before, asked = shapes.poses(0.0)[head], Interrupts(signals=False)
    seen, turned = list[Tick](), set[Any]()

    def watch(tick: Tick) -> None:
        seen.append(tick)
        if len(seen) % 10 == 0:
            turned.add(shapes.poses(0.0)[head])
            [other] = made.other_heads
            assert other.describe().headline
        if len(seen) == 100:
            asked.request("the test")

    group.run(asked, lambda line: None, watch=watch)
    assert len(turned) > 5
    for (w, *_), (x_m, _, _) in turned:
        assert x_m == pytest.approx(before[1][0], abs=0.1) and abs(x_m - 0.9) < 0.2
        assert abs(w) < 0.5  # it faces the first head


@branched
def test_a_head_that_cannot_start_ends_the_other(
    group: HeadGroup, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent() -> None:
        raise SetupError("no servo 3")

    monkeypatch.setattr(group.members[1].composed.assembly.robot.body, "start", absent)
    lines: list[str] = []
    with pytest.raises(SetupError, match="no servo 3"):
        group.run(lambda: None, lines.append)
    assert all("torque off" in line for line in lines if line.startswith("stopped by"))


@pytest.fixture
def running(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Return a run of two heads whose heads move already."""
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with Branch(gazerig(*COMMAND), stderr=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stderr is not None
        assert "two-heads" in process.stderr.readline()  # printed with the first tick
        time.sleep(1.0)
        yield process
        process.kill()


def children(pid: int) -> list[int]:
    """Return the processes that one has started, and theirs."""
    found = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    own = [int(one) for one in found]
    return own + [each for one in own for each in children(one)]


@branched
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_request_to_end_parks_both(running: subprocess.Popen[str], number: int) -> None:
    running.send_signal(number)
    _, said = running.communicate(timeout=30)
    name = signal.Signals(number).name
    for head in ("", "other: "):
        assert re.search(rf"^{head}stopped by {name}: {LET_GO}$", said, re.MULTILINE)


def test_of_a_killed_run_nothing_goes_on(running: subprocess.Popen[str], tmp_path: Path) -> None:
    started = children(running.pid)
    assert started  # the emulator with the world and all servos
    running.kill()
    running.wait()
    until_s = time.monotonic() + 20.0
    while any(Path(f"/proc/{pid}").exists() for pid in started) and time.monotonic() < until_s:
        time.sleep(0.05)
    assert not [pid for pid in started if Path(f"/proc/{pid}").exists()]
