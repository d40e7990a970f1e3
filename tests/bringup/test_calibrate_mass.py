"""calibrate mass: what the loads of a neck give, what is written, and how it ends."""

import os
import signal
import time
from contextlib import nullcontext
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import invoked
from commands_started import hear, start
from emulated_rig import EmulatedRig

from gazerig.config.load import shipped_path
from gazerig.config.schema import Rig, load_rig
from gazerig.features.bringup.calibration.joint_calibration import CalibrationRefused
from gazerig.features.bringup.calibration.mass_calibration import (
    SWEPT,
    HeadBalance,
    LoadRecorder,
    LoadSample,
    fit_balance,
    sweep,
)
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.features.bringup.cli import manual_session as session
from gazerig.features.bringup.cli.calibrate import mass as command
from gazerig.features.bringup.cli.calibrate.mass import mass_changes
from gazerig.features.bringup.cli.ports import RigPorts
from gazerig.features.bringup.manual_control import JogParams, ManualControl
from gazerig.robot.app.bus_wiring import rig_bus
from gazerig.robot.app.rig_description import description_of, statics_of
from gazerig.robot.app.rig_limits import limits, park_rad
from gazerig.robot.control.body import Body
from gazerig.robot.model.mass_params import CounterweightParams, LinkMassParams, MassParams
from gazerig.robot.safety.guard import Guard


def measured(true: Rig, known: Rig, stop_after_s: float = 1e9) -> HeadBalance:
    """Measure an emulated head with the file of another."""
    emulated = EmulatedRig(true)
    statics = statics_of(known, of_neck=True)
    recorder = LoadRecorder(statics)
    params = JogParams(speed_deg_s=20.0, near_deg=3.0)
    control = ManualControl(
        Body(rig_bus(known, emulated.ports), known.joints, park_rad(known)),
        Guard(known.guard, limits(known.joints), known.names, period_s=0.01),
        emulated.clock,
        params,
        lambda: "Ctrl-C" if emulated.clock.now_s() > stop_after_s else None,
        recorder.watch,
    )
    control.start()
    try:
        sweep(control, statics, recorder)
    finally:
        control.stop()
    return fit_balance(recorder.samples, statics, description_of(known, looks=False))


def heavy(name: str, **mass: Any) -> Rig:
    return replace(load_rig(name), mass=MassParams(**mass))


def neck_of(rig: Rig) -> Rig:
    """The same head without servos for its eyes and lids, which is simulated faster."""
    necks = {name: joint for name, joint in rig.joints.items() if "neck" in name}
    return replace(rig, joints=necks, park_deg={"neck_pitch": -12.0})


def moving_loads(true: Rig, friction_nm: float = 0.03) -> list[LoadSample]:
    """The loads of an ideal neck, moved up and down."""
    statics, found = statics_of(true, of_neck=True), []
    for name in (name for name in SWEPT if name in statics.joints):
        for angle_deg in range(-25, 26, 5):
            for way in (1.0, -1.0, 1.0, -1.0):
                pose = {**dict.fromkeys(statics.joints, 0.0), name: radians(angle_deg)}
                held = -statics.load_nm(pose)[name]
                found.append(LoadSample(name, pose, held + way * friction_nm, way))
    return found


def fitted(true: Rig, known: Rig) -> HeadBalance:
    statics = statics_of(known, of_neck=True)
    return fit_balance(moving_loads(true), statics, description_of(known, looks=False))


@pytest.mark.parametrize("name", ["desk", "feetech", "expressive"])
def test_loads_of_both_directions_give_balance_and_friction(name: str) -> None:
    true = heavy(name, head=LinkMassParams(0.9, (40.0, 3.0, 30.0)))
    found = fitted(true, load_rig(name))
    changes = mass_changes(load_rig(name), found, 0.9)
    aside = 3.0 if "neck_roll" in true.joints else 0.0  # only roll shows it
    assert changes["mass.head.com_mm"] == pytest.approx((40.0, aside, 30.0), abs=0.1)
    assert [*found.friction_nm.values()] == pytest.approx([0.03] * len(found.friction_nm))
    # Without a scale the mass is the rig's own, and the product is right.
    unweighed = mass_changes(load_rig(name), found, None)
    kg, (x, _, _) = unweighed["mass.head.mass_kg"], unweighed["mass.head.com_mm"]
    assert kg * x == pytest.approx(36.0, rel=0.01)


def test_counterweights_and_springs_that_are_known_are_left_out() -> None:
    weights = {"back": CounterweightParams(0.2, (-80.0, 0.0, 20.0))}
    known = heavy("desk", counterweights=weights)
    pitch = replace(known.joints["neck_pitch"], spring_nm_deg=0.004, spring_rest_deg=5.0)
    known = replace(known, joints={**known.joints, "neck_pitch": pitch})
    head = LinkMassParams(0.8, (35.0, 0.0, 30.0))
    true = replace(known, mass=MassParams(head=head, counterweights=weights))
    com = mass_changes(known, fitted(true, known), 0.8)["mass.head.com_mm"]
    assert com == pytest.approx((35.0, 0.0, 30.0), abs=0.1)


def test_a_lower_neck_gives_the_mass_too() -> None:
    base = load_rig("desk")
    lower = replace(base.joints["neck_pitch"], id=20)
    geometry = replace(base.geometry, pitch_axis_height_mm=120.0, lower_pitch_axis_height_mm=20.0)
    known = replace(base, joints={**base.joints, "lower_neck_pitch": lower}, geometry=geometry)
    true = replace(known, mass=MassParams(head=LinkMassParams(0.9, (10.0, 0.0, 40.0))))
    found = fitted(true, known)
    assert found.mass_kg == pytest.approx(0.9)
    assert mass_changes(known, found, None)["mass.head.com_mm"] == (10.0, 0.0, 40.0)


@pytest.mark.slow
def test_an_emulated_head_is_measured_within_a_tenth() -> None:
    com = (40.0, 0.0, 30.0)
    known = neck_of(load_rig("desk"))
    true = neck_of(heavy("desk", head=LinkMassParams(0.9, com)))
    found = measured(true, known)
    changes = mass_changes(known, found, 0.9)
    off = np.subtract(changes["mass.head.com_mm"], com)
    assert np.linalg.norm(off) < 0.1 * np.linalg.norm(com), changes
    assert all(0.0 < nm < 0.1 for nm in found.friction_nm.values()), found


def test_a_request_to_end_ends_it() -> None:
    rig = neck_of(load_rig("desk"))
    with pytest.raises(CalibrationStopped, match="Ctrl-C"):
        measured(rig, rig, stop_after_s=1.5)


def test_too_few_loads_are_refused() -> None:
    rig = load_rig("desk")
    statics = statics_of(rig, of_neck=True)
    with pytest.raises(CalibrationRefused, match="neck_pitch: only 0 loads"):
        fit_balance([], statics, description_of(rig, looks=False))


@pytest.mark.parametrize(
    ("rig", "why"), [("maker", "no neck_pitch"), ("six_xl330", "no neck_pitch")]
)
def test_rigs_without_a_neck_are_refused(rig: str, why: str) -> None:
    done = invoked("calibrate", "mass", rig, "--mock", "--dry-run")
    assert done.code != 0 and why in done.err


def own_rig(folder: Path) -> Path:
    file = folder / "own.yaml"
    text = shipped_path("rigs", "desk").read_text(encoding="utf-8")
    file.write_text(text + "\nmass:\n  head: {com_mm: [40, 0, 30]}\n", encoding="utf-8")
    return file


@pytest.mark.slow
def test_what_is_found_is_written_and_the_torque_is_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In simulated time; the test below has a process and a terminal."""
    file = own_rig(tmp_path)
    emulated = EmulatedRig(load_rig(str(file)))
    monkeypatch.setattr(command, "rig_ports", lambda *_: nullcontext(RigPorts({}, None)))
    monkeypatch.setattr(session, "RealClock", lambda: emulated.clock)
    monkeypatch.setattr(session, "guarded_rig_bus", lambda rig, _: rig_bus(rig, emulated.ports))
    words = ("--mock", "--yes", "--weight-kg", "0.6", "--speed", "30")
    done = invoked("calibrate", "mass", str(file), *words)
    assert done.code == 0, done.err
    assert "parked" in done.err and "torque off on all servos" in done.err, done.err
    device: Any = emulated.devices[""]
    assert not any(servo.torque for servo in device.servos)
    head = load_rig(str(file)).mass.head
    assert head.mass_kg == 0.6 and head.com_mm is not None
    assert np.allclose(head.com_mm, (40.0, 0.0, 30.0), atol=4.0)


@pytest.mark.slow
def test_ctrl_c_parks_switches_off_and_writes_nothing(tmp_path: Path) -> None:
    file = own_rig(tmp_path)
    before = file.read_text(encoding="utf-8")
    with start("calibrate", "mass", str(file), "--mock", "--yes") as started:
        hear(started.stderr, "nods and tilts")
        time.sleep(0.5)
        os.kill(started.pid, signal.SIGINT)
        assert started.stderr is not None
        text = started.stderr.read()
        code = started.wait(60.0)
    assert code != 0 and "parked" in text and "torque off on all servos" in text, text
    assert "nothing written" in text and file.read_text(encoding="utf-8") == before
