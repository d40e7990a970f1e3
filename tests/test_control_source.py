"""The source of control of the head is one value with the same words everywhere."""

import pytest
from commanded_robot import Running

from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_text import head_activity, tick_control_source
from gazerig.robot.dashboard.feed.snapshot import snapshot
from gazerig.robot.dashboard.panels.attention_panel import salience_bars, target_text
from gazerig.robot.dashboard.panels.servo_health import health_table
from gazerig.robot.model.commands import Jog, LookAt, Resume, Stop
from gazerig.robot.model.control_source import ControlSource, control_sentence
from gazerig.robot.model.types import Snapshot

pytestmark = pytest.mark.usefixtures("ideal_servos")


def shown(tick: Tick) -> Snapshot:
    return snapshot(tick)


def test_by_itself_it_says_what_it_looks_at(running: Running) -> None:
    tick = running.go(0.1)[-1]
    assert (
        tick_control_source(tick) == ControlSource()
        and not tick_control_source(tick).overrides_gaze
    )
    shot = shown(tick)
    assert shot.headline.startswith("looks at person 1") and shot.target_kind == "face"


def test_a_held_joint_is_named_with_who_and_since_when_and_nothing_else(running: Running) -> None:
    running.order(Jog((("neck_yaw", 0.3),), who="ann"))
    first = running.go(0.2)[0]
    running.order(Jog((("neck_yaw", 0.1), ("neck_pitch", 0.1)), who="ann"))
    for _ in range(6):
        running.order(Jog((("neck_yaw", 0.3),), who="ann"))
        tick = running.go(0.5)[-1]
    leads = tick_control_source(tick)
    assert (leads.kind, leads.who, leads.since_s) == ("joint", "ann", first.t_s)
    assert leads.joints == ("neck_yaw", "neck_pitch")
    shot = shown(tick)
    assert shot.headline == "ann holds neck_yaw at 17.2 deg, neck_pitch at 5.7 deg, for 3 s"
    assert (shot.target_name, shot.phase) == ("neck_yaw and neck_pitch held", "held")
    assert shot.why == shot.headline
    assert (shot.target_part, shot.saliences) == (None, ())
    for said in (health_table(shot), target_text(shot), salience_bars(shot)):
        assert "face 1" not in said and "person 1" not in said


@pytest.mark.parametrize(
    ("pointer", "kind", "said"),
    [
        (False, "person", "ann makes it look at 1 0.2 0.3, for 2 s"),
        (True, "pointer", "it looks at the pointer of ann, for 2 s"),
    ],
)
def test_a_point_and_a_pointer_are_led_by_who_chose_them(
    running: Running, pointer: bool, kind: str, said: str
) -> None:
    for _ in range(10):
        running.order(LookAt((1.0, 0.2, 0.3), who="ann", pointer=pointer))
        tick = running.go(0.2)[-1]
    assert tick_control_source(tick).kind == kind
    assert head_activity(tick).headline == said


def test_stopped_says_that_and_nothing_else(running: Running) -> None:
    running.order(Jog((("neck_yaw", 0.3),), who="ann"))
    running.go(0.2)
    running.order(Stop("STOP was pressed", who="ann"))
    shot = shown(running.go(0.5)[-1])
    assert shot.control_source.kind == shot.target_name == shot.phase == "stopped"
    assert shot.headline == shot.why == "stopped: STOP was pressed; the torque is off"
    running.go(2.0)
    running.order(Resume(who="ann"))
    assert tick_control_source(running.go(0.1)[-1]) == ControlSource()


def test_parking_is_shown_as_such_and_changes_nothing_of_it(running: Running) -> None:
    running.order(Jog((("neck_yaw", 0.3),), who="ann", stay=True))
    running.go(1.0)
    made = running.made
    ticks: list[Tick] = []
    assert made.robot.park(made.park_rad, made.clock, made.loop, watch=ticks.append)
    assert {tick_control_source(tick).kind for tick in ticks} == {"parking"} and len(ticks) > 5
    assert head_activity(ticks[-1]).headline == control_sentence(ControlSource("parking"), 0.0)
    yaw = [
        tick.joints.position_rad[ticks[0].guard_result.joints.index("neck_yaw")] for tick in ticks
    ]
    assert abs(yaw[-1]) < abs(yaw[0])
