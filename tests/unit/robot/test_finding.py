"""An order to find a person: where the head looks, whom it finds, and when it gives up."""

import pytest

import gazerig
from gazerig.robot.model.commands import Find

pytestmark = pytest.mark.usefixtures("ideal_servos")


def test_a_person_is_found_where_it_is_wanted_or_nobody_in_time():
    with gazerig.open("desk", fast=True, scene="face-to-face", bus="ideal") as head:
        head.step(1.0)
        for sought in ("left", "right", 99):
            began_s, yaw = head.time_s, []
            order = head._send(Find(sought, stay=True))
            while order.outcome is None:
                head.step(0.1)
                yaw.append(head.gaze.head_rad[0])
            assert (order.outcome, order.why) == ("not found", "nobody was found")
            assert head.time_s - began_s < 8.0 and not order.active
            reach = {"left": (-0.1, 0.6), "right": (-0.6, 0.1), 99: (-0.4, 0.4)}[sought]
            assert min(yaw) < reach[0] + 0.2 and max(yaw) > reach[1] - 0.2
        for sought in (1, "anybody"):
            order = head._send(Find(sought, stay=True))
            assert order.wait(8.0) == "arrived" and order.why.startswith("person 1: ")
            assert head.state.client_control.found.person == 1
        head.step(3.0)
        assert head.gaze.target.startswith("face 1") and order.active
