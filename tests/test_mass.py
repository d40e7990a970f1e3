"""Masses of a rig: torques of its weight, rules of its keys, and a neck that does not sag."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest
from described_rigs import shipped
from emulated_rig import EmulatedRig

from gazerig.config.load import ConfigError, shipped_path
from gazerig.config.schema import Rig, load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.bus_wiring import rig_bus
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.rig_description import description_of, sag_compensation, statics_of
from gazerig.robot.app.rig_limits import park_rad
from gazerig.robot.app.rig_weight import rest_park_deg, weight_findings
from gazerig.robot.control.body import Body
from gazerig.robot.description.mjcf import mjcf
from gazerig.robot.model.mass_params import CounterweightParams, HeadMassParams, MassParams

REAL = MassParams(head=HeadMassParams(com_mm=(40.0, 0.0, 30.0)))
"""A realistic skull and jaw."""


def heavy(name: str, mass: MassParams = REAL) -> Rig:
    return replace(shipped(name), mass=mass)


def mujoco_loads_nm(rig: Rig, angles: Mapping[str, float]) -> dict[str, float]:
    import mujoco

    description = description_of(rig, looks=False)
    model = mujoco.MjModel.from_xml_string(mjcf(description, looks=False).xml)
    data = mujoco.MjData(model)
    for name, angle in description.angles(tuple(angles), tuple(angles.values())).items():
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    found = dict.fromkeys(rig.joints, 0.0)
    for joint in description.joints:
        name = joint.follows or joint.name
        at = model.joint(joint.name).dofadr[0]
        found[name] += data.qfrc_passive[at] - data.qfrc_bias[at]
    return found


@pytest.mark.parametrize("name", ["desk", "feetech", "expressive"])
def test_torques_are_those_of_mujoco(name: str) -> None:
    rng = np.random.default_rng(4)
    weights = {"back": CounterweightParams(0.2, (-60.0, 5.0, 20.0))}
    rig = heavy(name, replace(REAL, counterweights=weights))
    statics = statics_of(rig)
    for _ in range(5):
        angles = {
            name: rng.uniform(radians(joint.min_deg), radians(joint.max_deg))
            for name, joint in rig.joints.items()
        }
        expected = mujoco_loads_nm(rig, angles)
        assert statics.load_nm(angles) == pytest.approx(expected, abs=1e-9)
        neck = {name: angle for name, angle in angles.items() if "neck" in name}
        quick = statics_of(rig, of_neck=True).load_nm(neck)
        assert quick == pytest.approx({n: statics.load_nm(neck)[n] for n in quick}, abs=1e-12)


def test_a_head_rests_where_its_weight_has_no_lever_or_on_its_stop() -> None:
    rest = statics_of(shipped("desk")).rest_pose({})
    assert degrees(rest["neck_pitch"]) == pytest.approx(-10.8, abs=0.1)
    statics = statics_of(heavy("desk"))
    assert statics.rest_pose({})["neck_pitch"] == radians(-35.0)
    assert statics.limp_rad("neck_pitch", {"neck_pitch": radians(-12.0)}) == radians(-35.0)
    loads = statics_of(shipped("desk")).load_nm(rest)
    assert loads["neck_pitch"] == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize(
    ("lines", "key", "rule"),
    [
        ("head: {mass_kg: -1}", "mass.head.mass_kg", "to 50 kg"),
        ("head: {mass_kg: 0.02}", "mass.head.mass_kg", "weigh 0.029"),
        ("head: {com_mm: [200, 0, 30]}", "mass.head.com_mm", "outside the head"),
        ("links: {left_eye: {mass_kg: 1}}", "mass.links", "mass.head"),
    ],
)  # fmt: skip
def test_impossible_masses_are_refused(lines: str, key: str, rule: str, tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    text = shipped_path("rigs", "desk").read_text(encoding="utf-8")
    file.write_text(text + f"\nmass:\n  {lines}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_rig(str(file))
    (fault,) = caught.value.faults
    assert (fault.key, fault.line is not None) == (key, True)
    assert rule in fault.rule, fault


class Neck:
    """A neck's pitch on emulated servos, with all other joints at 0."""

    def __init__(self, rig: Rig, compensated: bool = True) -> None:
        self.emulated = EmulatedRig(rig)
        sag = sag_compensation(rig) if compensated else None
        bus = rig_bus(rig, self.emulated.ports)
        self.body = Body(bus, rig.joints, park_rad(rig), sag=sag)
        self.at = self.body.names.index("neck_pitch")
        self.goal = list(self.body.start(self.emulated.clock))
        self.t_s = 0.0

    def hold(self, angle_deg: float, for_s: float) -> list[float]:
        """Turn to an angle at 40 deg/s, hold it, and return the errors in degrees."""
        errors, end_s = [], self.t_s + for_s
        while self.t_s < end_s:
            off = radians(angle_deg) - self.goal[self.at]
            step = radians(0.4)
            self.goal[self.at] += min(max(off, -step), step)
            self.body.write(tuple(self.goal))
            self.t_s += 0.01
            self.emulated.clock.sleep_until(self.t_s)
            state = self.body.read(self.t_s)
            errors.append(degrees(state.position_rad[self.at] - self.goal[self.at]))
        return errors


@pytest.mark.parametrize("name", ["desk", "feetech", "expressive", "nine_xl330"])
def test_a_heavy_head_does_not_sag(name: str) -> None:
    rig = heavy(name)
    plain = Neck(rig, compensated=False)
    made_up = Neck(rig)
    for angle in (0.0, 20.0, -20.0):
        before, after = plain.hold(angle, 3.0)[-1], made_up.hold(angle, 3.0)[-1]
        assert before < -0.35 and abs(after) < 0.25, (angle, before, after)


def test_sag_is_made_up_for_without_a_jump_and_within_the_limits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    neck = Neck(heavy("desk"))
    goals: list[int] = []
    write = neck.body.bus.write

    def note(steps: Sequence[int]) -> None:
        goals.append(steps[neck.at])
        write(steps)

    monkeypatch.setattr(neck.body.bus, "write", note)
    joint = neck.emulated.rig.joints["neck_pitch"]
    goals.append(round(joint.steps(neck.goal[neck.at])))
    neck.hold(degrees(neck.goal[neck.at]), 2.0)
    assert max(abs(b - a) for a, b in zip(goals, goals[1:], strict=False)) <= 1
    assert abs(goals[-1] - goals[0]) > 10
    # At the end of the range nothing is left to make up with: the bus clips the goal.
    assert neck.hold(35.0, 3.0)[-1] < -0.3
    assert neck.emulated.where()["neck_pitch"] <= 35.0


def test_what_a_neck_holds_is_reported_with_its_heat() -> None:
    well = {(one.level, one.joint) for one in weight_findings(shipped("desk"))}
    assert well == {("note", "neck_pitch"), ("note", "neck_roll"), ("ok", "neck_pitch")}
    assert list(weight_findings(shipped("maker"))) == []
    pitch, _, parked = weight_findings(heavy("desk"))
    assert "level with 25% of its stall torque (0.46 A)" in pitch.what and pitch.level == "note"
    assert parked.what == "parked at -12 deg it sinks to -35 deg when torque is switched off"
    twice = MassParams(head=HeadMassParams(1.2, (40.0, 0.0, 30.0)))
    strong = next(iter(weight_findings(heavy("desk", twice))))
    assert strong.level == "warn" and "counterweights" in strong.cure
    assert "63% of its stall" in strong.what and "90 degC" in strong.what


def test_a_head_that_would_sink_is_parked_where_it_rests() -> None:
    assert rest_park_deg(shipped("desk")) == shipped("desk").park_deg
    rig = heavy("desk")
    made = assemble(rig, RunOptions(rig="desk", mock=True, fast=True, scene="visitor"))
    try:
        assert made.notes[-1].startswith("parks neck_pitch at -35 deg")
        at = rig.names.index("neck_pitch")
        made.robot.start(made.clock)
        assert made.robot.park(made.park_rad, made.clock, made.loop)
        assert degrees(made.robot.body.read(made.clock.now_s()).position_rad[at]) < -32.5
    finally:
        made.close()
