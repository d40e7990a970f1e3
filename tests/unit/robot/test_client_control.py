"""Control by a client: its words, how long it lasts, and when it has arrived."""

from math import degrees, radians

import pytest
from gaze_targets import target
from made_ticks import made_tick
from msgspec.structs import replace

from gazerig.gaze.types import ORDERED, Face
from gazerig.robot.loop.client_control import ClientControl
from gazerig.robot.loop.head_state import head_state
from gazerig.robot.model.commands import (
    Find,
    Jog,
    LookAt,
    LookAtDirection,
    LookAtPerson,
    LookAtPixel,
)
from gazerig.robot.model.reply import ControlState, TrackState

POINT = (1.0, 0.2, 0.346)
STILL = (0.0, 0.0, 0.0)
FACE = Face(3, POINT, STILL, ((1.0, 0.0, 0.0),) * 3, (STILL,) * 8, 1.0)
ASIDE = (radians(10.0), radians(-5.0))


@pytest.mark.parametrize(
    ("look", "kind", "words"),
    [
        (LookAt(POINT), "person", "look at 1 0.2 0.35"),
        (LookAt(POINT, pointer=True), "pointer", "look at 1 0.2 0.35"),
        (LookAtDirection(ASIDE), "person", "look in direction 10.0 -5.0 deg"),
        (LookAtDirection(ASIDE, "head"), "person", "look in direction 10.0 -5.0 deg of the head"),
        (LookAtPerson(3), "person", "look at person 3"),
        (Find(3), "person", "find person 3"),
        (Find("left"), "person", "find left"),
        (LookAtPixel((200.4, 150.6)), "person", "look at pixel 200 151"),
    ],
)
def test_a_look_is_named_and_ends_with_the_next(look, kind, words):
    control = ClientControl(("jaw",))
    assert control.needs_camera and not control.has_target
    control.look(replace(look, who="ann"), 10.0, POINT)
    state = control.state
    assert (state.number, state.kind, state.client) == (1, kind, f"ann: {words}")
    assert control.has_target and not control.needs_camera
    control.look(LookAt(None), 11.0)
    assert control.state == ControlState(1, end_reason="a client looks elsewhere")
    assert control.needs_camera and not control.has_target


LOOKS = {"rest": "looks ahead: nobody is visible", "glance": "looks around: nobody is visible",
         "search": "looks for a person who has left", "away": "looks away for a moment",
         "thing": "looks at a moving object", "hand": "looks at a hand",
         ORDERED: "looks at its point"}  # fmt: skip
LED = ControlState(1, True, who="ann", description="look at 1 0 0")
POINTED, HELD = replace(LED, kind="pointer"), replace(LED, kind="joint", joints=("jaw", "neck"))
NODS = (TrackState("nod", who="ann", number=1),)
HOT = replace(made_tick().guard_result, level="torque_off", critical_reasons=("jaw: hot", "b: hot"))


@pytest.mark.parametrize(
    ("changes", "headline", "gaze"),
    [
        ({}, "looks at person 1", ("face 1", "fixate", "face")),
        *(({"seen": target(kind=kind)}, words, (f"{kind} 1", "fixate", kind))
          for kind, words in LOOKS.items() if kind != "thing"),
        ({"seen": target(kind="thing")}, LOOKS["thing"], ("motion 1", "fixate", "thing")),
        ({"client_control": LED}, "ann makes it look at 1 0 0", ("face 1", "fixate", "person")),
        ({"client_control": replace(LED, limited="5 deg off")},
         "ann makes it look at 1 0 0; 5 deg off", ("face 1", "fixate", "person")),
        ({"client_control": POINTED}, "it looks at the pointer of ann",
         ("face 1", "fixate", "pointer")),
        ({"client_control": HELD}, "ann holds look at 1 0 0", ("jaw and neck held", "held", "joint")),
        ({"tracks": NODS}, "it plays nod for ann, and looks at person 1",
         ("face 1", "fixate", "face")),
        ({"parking": True}, "it moves to its parking pose, then the torque goes off",
         ("parking", "parking", "parking")),
        ({"guard_result": HOT}, "the torque is off: jaw: hot", ("face 1", "fixate", "face")),
        ({"stopped": "a hand", "guard_result": HOT}, "stopped: a hand; the torque is off",
         ("stopped", "stopped", "stopped")),
    ],
)  # fmt: skip
def test_who_controls_the_head_is_said(changes, headline, gaze):
    state = head_state(made_tick(**changes))
    shown = state.gaze
    assert (state.headline, (shown.target, shown.phase, shown.kind)) == (headline, gaze)
    if "seen" not in changes and gaze[2] != "face" or "guard_result" in changes:
        assert shown.reason == headline


@pytest.mark.parametrize(
    ("order", "lasts_s", "why"),
    [
        (LookAt(POINT, who="ann"), 1.0, "not renewed"),
        (LookAt(POINT, who="ann", stay=True), 1e9, ""),
        (LookAt(POINT, who="ann", stay=True, for_s=0.5), 0.499, "its time is over"),
        (LookAtPerson(3, who="ann", stay=True), 1.5, "person 3 is gone"),
        (Jog((("jaw", 0.1),), who="ann"), 1.0, "not renewed"),
    ],
)
def test_control_ends_when_it_is_not_renewed_or_its_time_is_over(order, lasts_s, why):
    control = ClientControl(("jaw", "neck"))
    for t_s in (10.0, 20.0):
        if isinstance(order, Jog):
            control.jog(order, (0.0, 0.0), t_s)
        else:
            face = FACE if isinstance(order, LookAtPerson) else None
            control.look(order, t_s, None if face else POINT, face, t_s - 0.5)
        assert [control.expiry_reason(t_s + s) for s in (lasts_s, lasts_s + 0.01)] == ["", why]
    assert not control.renew("bob", 20.9) and control.renew("ann", 20.9)
    if why == "not renewed":
        assert [control.expiry_reason(t_s) for t_s in (21.9, 21.91)] == ["", why]
    control.end("enough")
    assert control.expiry_reason(1e9) == "" and not control.renew("ann", 21.0)


def test_jogged_joints_are_held_and_arrive_within_a_degree():
    control, tick = ClientControl(("jaw", "neck")), made_tick()

    def measured(jaw_deg: float, neck_deg: float = 0.0) -> ControlState:
        at = radians(jaw_deg), radians(neck_deg)
        return control.measure(tick.target, tick.pose, tick.gaze, at, True, 0.0)

    control.look(LookAt(POINT, who="ann"), 0.0, POINT)
    control.jog(Jog((("jaw", radians(4.0)),), who="ann"), (0.1, radians(30.0)), 0.0)
    assert control.pose_rad == (radians(4.0), radians(30.0)) and control.has_target
    assert control.state.client == "ann: jaw at 4.0 deg"
    assert not measured(5.1).arrived and degrees(measured(5.1).error_rad) == pytest.approx(1.1)
    control.jog(Jog((("neck", radians(-2.0)),), who="ann"), STILL[:2], 0.0)
    state = control.state
    assert (state.number, state.kind, state.joints) == (3, "joint", ("jaw", "neck"))
    assert state.description == "jaw at 4.0 deg, neck at -2.0 deg"
    assert not measured(4.9, -0.9).arrived and measured(4.9, -1.1).arrived
    assert measured(9.0).arrived  # once is enough
    for who, client in (("ann", "ann: look at 1 0.2 0.35"), ("bob", "")):
        control.jog(Jog((), who=who), STILL[:2], 0.0)
        assert control.state.client == client and not control.pose_rad
        control.jog(Jog((("jaw", 0.0),), who="bob"), STILL[:2], 0.0)
        assert not control.has_target and control.state.client == "bob: jaw at 0.0 deg"
