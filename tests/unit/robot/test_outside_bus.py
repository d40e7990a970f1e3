"""A bus of another package moves a rig and is checked, drawn and released as ours are."""

import pickle
import re
from typing import Any

import numpy as np
import pytest
from command_line import invoked
from fakes.runs import simulated, ticks
from outside_bus import HEAD, install_example
from outside_package import on_path
from page_feed import info
from present import present

from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.robot.dashboard.feed.rig_feed import LiveRig, RigFeed, rig_message
from gazerig.robot.description.build import describe
from gazerig.robot.guardian.process import releaser
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.run.buses import release_plan
from gazerig.robot.run.emulated import emulated_lines
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.in_process_port import InProcessPort


@pytest.fixture
def example(tmp_path):
    install_example(tmp_path / "site")
    with on_path(tmp_path / "site") as folder:
        yield folder


def test_a_rig_on_it_looks_at_people(example):
    made = simulated(str(HEAD))
    made.robot.start(made.clock)
    seen = ticks(made, 200, 0.025)
    made.robot.stop()
    made.close()
    assert "face" in {tick.target.kind for tick in seen}
    assert all(tick.joints.missing == () and all(tick.joints.torque) for tick in seen)
    assert np.ptp([tick.joints.position_rad for tick in seen], axis=0).min() > 0.05
    assert made.bus.sent_bytes_digest()


def test_its_section_is_checked(example, tmp_path):
    text = HEAD.read_text()
    for old, new, told in (
        ("reply_timeout_ms: 5.0", "reply_timeout_ms: 900.0", "is 900.0, wanted a number"),
        ("kind: lx16a", "kind: lx61a", "did you mean 'lx16a'?"),
        (
            "model: lx-16a",
            "model: sts3215",
            "a sts3215 needs a bus of kind feetech, its bus is of kind lx16a",
        ),
    ):
        file = tmp_path / "head.yaml"
        file.write_text(text.replace(old, new, 1))
        with pytest.raises(ConfigError, match=re.escape(told)):
            load_rig(str(file))


def test_the_guardian_switches_its_torque_off(example):
    rig, clock = load_rig(str(HEAD)), SimulatedClock(1.0)
    device: Any = build(pickle.loads(pickle.dumps(emulated_lines(rig)[""])), clock.now_s)
    port = InProcessPort(device, sleep_until=clock.sleep_until)
    for servo in device.servos.values():
        servo.torque = True
    plan = pickle.loads(pickle.dumps(release_plan(rig, "", "/dev/ttyUSB0")))
    assert releaser(plan)(port) == ()
    assert not any(servo.torque for servo in device.servos.values())
    device.faults.command("lose 3")
    assert releaser(plan)(port) == (3,)


def test_the_page_draws_it(example):
    made = simulated(str(HEAD))
    message = rig_message(LiveRig(made.shown_rig(), info(made)))
    made.close()
    del SERVOS["lx-16a"]  # the page's process loads no package
    feed = RigFeed()
    feed.take(message)
    assert describe(present(feed.rig).shown.shape).joints


def test_what_speaks_to_our_kinds_alone_says_so_in_one_line(example):
    pytest.importorskip("gazerig.features.bringup")
    for words in ("doctor", "setup", "monitor --once", "calibrate joints", "scan"):
        command, *rest = words.split(" --")
        options = [f"--{one}" for one in rest]
        done = invoked(*command.split(), str(HEAD), "--mock", *options)
        told = f"{command} cannot ask the bus 'lx16a' of gazerig-lx16a 0.1.0: run and jog"
        assert told in done.err and done.code != 0, done.err
