"""Tracks from the command line, from Python, on the page, from menus and by rules."""

from collections.abc import Iterator

import pytest
from slow_rigs import slowed
from ticked_rig import TickedRig, connected, gazerig

from gazerig.config.schema import load_rig
from gazerig.robot.model.commands import Jog, Play, Resume, Stop, set_client
from gazerig.robot.net.client import RequestRejected, RobotClient
from gazerig.robot.run import session
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run

pytestmark = pytest.mark.usefixtures("ideal_servos")


@pytest.fixture
def rig(monkeypatch) -> Iterator[TickedRig]:
    yield from connected(monkeypatch)


def test_tracks_from_the_command_line_and_of_a_head_that_is_stopped_or_led_by_hand(rig):
    assert "nod takes 1.0 s" in gazerig("ctl", "play", "nod")
    assert set_client(rig.commands[-1], "") == Play("nod")
    before = rig.tick(20)["neck_pitch"]
    assert min(rig.tick(5)["neck_pitch"] for _ in range(10)) < before - 2.0
    assert "laugh takes 3.5 s" in gazerig(
        "ctl", "do", '{"do": "play", "track": "laugh", "times": 2, "speed": 1.2}'
    )
    assert "slower by 2.67 for neck_pitch" in gazerig(
        "ctl", "do", '{"do": "play", "track": "nod", "speed": 4}'
    )
    assert "all tracks end" in gazerig("ctl", "play", "none")
    listed = gazerig("ctl", "play")
    assert "brow_shrug    who knows: the brows go up (1.2 s)" in listed and "nod " in listed
    assert "no track 'wink'; available: brow_shrug" in gazerig("ctl", "play", "wink")
    rig.command(Play("nod"))
    rig.tick(40)
    rig.command(Stop("test", who="me"))
    with pytest.raises(RequestRejected, match="stopped"):
        RobotClient.connect().send(Play("nod"))
    rig.tick(410)
    reply = rig.command(Resume(who="me", confirmed=True)).wait(0.0)
    assert reply is not None and not reply.refused, reply
    assert rig.made.robot.menus()["track"][0] == "none"  # the stop has ended the nod
    rig.command(Jog((("jaw", 0.1),), who="me", stay=True))
    with pytest.raises(RequestRejected, match="held at their angles"):
        RobotClient.connect().send(Play("nod"))


def test_a_visitor_who_waves_is_nodded_to():
    options = RunOptions(
        rig="desk", mock=True, fast=True, scene="visitor", seconds=20, rules="greeting"
    )
    said: list[str] = []
    rig = load_rig("desk")
    rig = slowed(rig, 50.0)
    session.Session(Run(rig, options), lambda: None, said.append).run()
    (nod,) = [line for line in said if "track" in line]
    at_s = float(nod.split(" s: ")[0])
    assert 17.5 < at_s < 19.0 and "for rule wait: nod takes 1.0 s" in nod  # the wave begins at 17.5
