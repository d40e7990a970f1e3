"""An order to find a person: where the head looks, whom it finds, and when it gives up."""

import cv2
import numpy as np
import pytest
from slow_rigs import at_rate

import gazerig
from gazerig.gaze.attention.finding import Sought

pytestmark = pytest.mark.usefixtures("ideal_servos")


def test_a_person_is_found_where_it_is_wanted_or_nobody_in_time(tmp_path):
    rig = at_rate(tmp_path, "desk", 50.0)
    with gazerig.open(rig, fast=True, scene="face-to-face", bus="ideal") as head:
        head.step(1.0)
        wanted: dict[Sought, tuple[float, float]] = {
            "left": (-0.1, 0.6), "right": (-0.6, 0.1), 99: (-0.4, 0.4),
        }  # fmt: skip
        for sought, reach in wanted.items():
            began_s, yaw = head.time_s, list[float]()
            order = head.find(sought)
            while order.outcome is None:
                head.step(0.1)
                yaw.append(head.gaze.head_rad[0])
            assert (order.outcome, order.why) == ("not found", "nobody was found")
            assert head.time_s - began_s < 8.0 and not order.active
            assert min(yaw) < reach[0] + 0.2 and max(yaw) > reach[1] - 0.2
        for order in (head.find(1), head.find()):
            assert order.wait(8.0) in ("arrived", "taken over")
        found = head.state.client_control.found
        assert found is not None and order.why == found.text() and found.person == 1
        head.step(3.0)
        assert head.gaze.target.startswith("face 1") and order.active
        with pytest.raises(gazerig.Refused, match="the scene is not drawn"):
            head.picture()
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((48, 64, 3), 90, np.uint8))
    with gazerig.open(rig, fast=True, video=tmp_path / "grey.png", bus="ideal") as head:
        head.step(0.5)
        assert head.picture().startswith(b"\xff\xd8")  # as a JPEG does
