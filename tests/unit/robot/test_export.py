"""Exports contain the measured values, and tools of other projects read the same."""

import csv
from collections.abc import Sequence
from math import cos, radians
from pathlib import Path

import pytest
from made_ticks import made_tick
from msgspec.structs import replace

from gazerig.drivers.errors import SetupError
from gazerig.gaze.angles import add, direction, rotation
from gazerig.robot.loop.tick import Tick
from gazerig.robot.recording.export_csv import EVENTS, SAMPLES, GazeExport

Rows = list[dict[str, str]]


def export(ticks: Sequence[Tick], folder: Path) -> tuple[Rows, Rows, str]:
    """Return the samples, the events and the summary of an export."""
    made = GazeExport()
    for tick in ticks:
        made.update(tick)
    said = made.write(folder / "seen")
    samples, events = (
        list(csv.DictReader((folder / f"seen_{kind}.csv").open(newline="")))
        for kind in ("samples", "events")
    )
    return samples, events, said


def numbers(row: dict[str, str], *names: str) -> list[float]:
    return [float(row[name]) for name in names]


def eyes(t_s: float, yaw_deg: float, pitch_deg: float = 0.0, plan_deg: float = 0.0) -> Tick:
    """Return a tick with parallel eyes, and the planned yaw of the gaze."""
    tick = made_tick(t_s, (yaw_deg, pitch_deg, yaw_deg, pitch_deg, *[0.0] * 5))
    ahead = add(tick.pose.p_world_head_m, direction((radians(plan_deg), 0.0)))
    return replace(tick, gaze=replace(tick.gaze, gaze_point_world_m=ahead))


def test_left_and_up_are_positive_and_the_head_carries_the_eyes(tmp_path):
    still = made_tick(0.0, (10.0, 5.0, 6.0, 5.0, *[0.0] * 5))
    turned = made_tick(0.1, (10.0, 0.0, 6.0, 0.0, 0.0, 0.0, 20.0, 0.0, 0.0))
    # Right ear down: what is to its left is now above.
    pose = replace(
        still.pose, R_world_head=rotation((0.0, 0.0, radians(90.0))),
        eye_left_rad=(radians(7.0), 0.0), eye_right_rad=(radians(7.0), 0.0),
    )  # fmt: skip
    rows, _, _ = export((still, turned, made_tick(0.2, pose=pose)), tmp_path)
    assert numbers(rows[0], "left_x_deg", "left_y_deg") == pytest.approx([10.0, 5.0], abs=1e-5)
    assert numbers(rows[0], "right_x_deg", "right_y_deg") == pytest.approx([6.0, 5.0], abs=1e-5)
    assert numbers(rows[0], "x_deg", "y_deg") == pytest.approx([8.0, 5.0], abs=0.01)
    assert numbers(rows[1], "left_x_deg", "x_deg") == pytest.approx([30.0, 28.0], abs=1e-5)
    assert numbers(rows[2], "x_deg", "y_deg") == pytest.approx([0.0, 7.0], abs=1e-5)


SILENT = (
    ("left_eye_tilt",),
    ("neck_roll",),
    ("right_upper_lid",),
    ("eyes_tilt",),
    ("right_eye_pan",),
)
LOST = {
    "left_x_deg": "xx.x.", "right_y_deg": ".x.xx", "x_deg": "xx.xx", "head_yaw_deg": ".....",
    "head_roll_deg": ".x...", "left_lid": ".....", "right_lid": "..x..", "left_lower_lid": "xxxxx",
}  # fmt: skip


def test_cells_of_silent_servos_and_of_joints_that_a_rig_lacks_are_empty(tmp_path):
    ticks = [made_tick(float(n)) for n in range(len(SILENT))]
    ticks = [
        replace(tick, joints=replace(tick.joints, missing=missing))
        for tick, missing in zip(ticks, SILENT, strict=True)
    ]
    rows, _, _ = export(ticks, tmp_path)
    assert {name: "".join(".x"[not row[name]] for row in rows) for name in LOST} == LOST


def test_movements_and_blinks_of_the_plan_are_events_as_late_as_the_eyes(tmp_path):
    """The eyes follow 3 ticks late; a saccade of 10 degrees takes 25 ms, 2 degrees a tick."""
    plan = [min(max(2.0 * (k - 10), 0.0), 10.0) for k in range(-3, 40)]
    ticks = []
    for k in range(40):
        tick = eyes(7.0 + 0.005 * k, plan[k], plan_deg=plan[k + 3])
        phase = "saccade" if 10 <= k < 15 else "fixate" if k < 30 else "pursue"
        seen = replace(tick.target, part="LE" if k >= 10 else None)
        gaze = replace(tick.gaze, phase=phase, blink=20 <= k < 25)
        ticks.append(replace(tick, target=seen, gaze=gaze))
    rows, events, said = export(ticks, tmp_path)
    assert said == "40 samples, 5 events; labels are the plan's, 15 ms later, as the eyes follow it"
    assert tuple(rows[0]) == SAMPLES and tuple(events[0]) == EVENTS
    # A speed is that of the chord over two ticks: of 4 degrees, and of 2 where it ends.
    found = [",".join(row.values()) for row in events]
    assert found == [
        "0.000000,0.065000,fixation,0.000000,0.000000,face 1,",
        "0.065000,0.025000,saccade,8.000000,399.918774,face 1,LE",
        "0.090000,0.075000,fixation,0.000000,199.989846,face 1,LE",
        "0.115000,0.025000,blink,,,face 1,LE",
        "0.165000,0.030000,pursuit,0.000000,0.000000,face 1,LE",
    ]
    names = {"fixation": "f", "saccade": "s", "blink": "b", "pursuit": "p"}
    assert "".join(names[row["event"]] for row in rows) == "f" * 13 + "s" * 5 + (
        "f" * 5 + "b" * 5 + "f" * 5 + "p" * 7
    )
    assert numbers(rows[16], "time_s", "x_deg", "left_lid") == pytest.approx([0.08, 6.0, 0.5])


@pytest.mark.parametrize("pitch_deg", [0.0, 60.0])
def test_a_gaze_that_is_up_turns_about_the_upright_axis_by_less(tmp_path, pitch_deg):
    """At 60 deg of pitch a degree of yaw is half a degree of gaze."""
    _, (event,), _ = export([eyes(0.005 * k, 0.4 * k, pitch_deg) for k in range(60)], tmp_path)
    assert float(event["peak_deg_s"]) == pytest.approx(80.0 * cos(radians(pitch_deg)), rel=1e-3)


def test_a_stopped_head_has_no_movement_and_one_tick_is_no_run(tmp_path):
    ticks = [made_tick(float(n), gaze={"blink": True}, stopped="hand") for n in range(2)]
    rows, events, _ = export(ticks, tmp_path)
    assert {row["event"] for row in rows} == {""} and not events
    with pytest.raises(SetupError, match="fewer than two ticks"):
        export(ticks[:1], tmp_path)
