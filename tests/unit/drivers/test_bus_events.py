"""Events of a bus drawn together."""

from gazerig.robot.loop.events import group_events


def test_the_same_done_to_several_servos_is_one_line():
    events = [f"joint{i} (servo {i}): Return Delay Time 250 -> 0" for i in (1, 2)]
    events += ["neck_yaw (servo 7): Drive Mode 4 -> 0", "port lost", "servo 9: a: b"]
    assert group_events(events) == [
        "joint1 (servo 1), joint2 (servo 2): Return Delay Time 250 -> 0",
        "neck_yaw (servo 7): Drive Mode 4 -> 0",
        "port lost",
        "servo 9: a: b",
    ]
    assert group_events([]) == []
