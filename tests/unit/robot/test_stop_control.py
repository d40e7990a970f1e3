"""Who may resume after a stop, when, and what is said of it; torque stays off meanwhile."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from gazerig.drivers.errors import BusLost, DriverError, ServoFault, SetupError
from gazerig.robot.loop.body import StopControl
from gazerig.robot.model.commands import Resume, Stop
from gazerig.robot.model.reply import CommandReply

GOALS = (0.1, 0.2)
CONFIRM = ": another client must confirm that no hand is in the mechanism"
MANY = "too many requests to resume: wait 1 s between two"


class Joints:
    """Two joints whose torque is switched, or an error that prevents it."""

    names = ("jaw", "neck")

    def __init__(self) -> None:
        self.did = ""
        self.error: DriverError | None = None

    def disable_torque(self) -> None:
        self.did += "-"
        if self.error is not None:
            raise self.error

    def enable_torque(self) -> tuple[float, ...]:
        if self.error is not None:
            raise self.error
        self.did += "+"
        return GOALS


class Stops:
    """A stop at 10 s by some clients."""

    def __init__(self, *who: str, why: str = "a hand") -> None:
        self.joints = cast(Any, Joints())
        self.said: list[str] = []
        self.control = StopControl(self.joints, self.said)
        for one in who:
            self.control.halt(Stop(why, who=one), 10.0)

    def ask(self, t_s: float, who: str = "ann", confirmed: bool = False) -> str:
        answer = self.control.resume(Resume(confirmed, who=who), t_s)
        assert answer == GOALS or isinstance(answer, CommandReply)
        return answer.refused if isinstance(answer, CommandReply) else ""


@pytest.mark.parametrize(
    ("stoppers", "who", "confirmed", "t_s", "refused"),
    [
        (["ann"], "ann", False, 11.75, "a stop lasts at least 2 s: try again in 0.2 s"),
        (["ann"], "ann", False, 12.0, ""),
        (["ann"], "bob", True, 12.0, ""),
        (["ann"], "bob", False, 12.0, f"stopped by ann{CONFIRM}"),
        (["bob", "ann"], "ann", False, 12.0, f"stopped by ann and bob{CONFIRM}"),
        ([""], "", False, 12.0, ""),
        ([""], "ann", False, 12.0, f"another client stopped it{CONFIRM}"),
        (["", "ann"], "", False, 12.0, f"stopped by ann{CONFIRM}"),
    ],
)
def test_who_stopped_alone_or_confirms_resumes_after_two_seconds(
    stoppers, who, confirmed, t_s, refused
):
    stops = Stops(*stoppers)
    by = f" by {who}" if who else ""
    assert stops.ask(t_s, who, confirmed) == refused
    assert stops.control.reason == ("a hand" if refused else "")
    assert stops.joints.did == "-" * len(stoppers) + "+" * (not refused)
    said = (
        f"resume{by} refused: {refused}" if refused else f"torque on again{by}: continuing slowly"
    )
    first = f" by {stoppers[0]}" if stoppers[0] else ""
    assert stops.said == [f"stopped{first}: a hand; torque off", said]


def test_requests_within_a_second_are_refused_and_count_and_are_said_once():
    stops = Stops("ann")
    stops.control.halt(Stop("", who="ann"), 11.0)  # renews it
    hold = "a stop lasts at least 2 s: try again in {} s".format
    asked = [stops.ask(t_s) for t_s in (11.0, 11.9, 12.8, 13.7)]
    assert asked == [hold("2.0"), MANY, MANY, MANY] and stops.control.reason == "stopped"
    assert stops.ask(13.8, confirmed=True) == stops.control.reason == ""  # counts by itself
    assert [line for line in stops.said if "refused" in line] == [
        f"resume by ann refused: {hold('2.0')}", f"resume by ann refused: {MANY}"
    ]  # fmt: skip
    for t_s in (14.0, 17.0):
        stops.control.halt(Stop("", who="bob"), t_s)
        assert stops.ask(t_s + 2.0, "bob") == ""  # ann's stop is over
    assert stops.joints.did == "--+-+-+" and "stopped by bob: stopped; torque off" in stops.said


@pytest.mark.parametrize("error", [SetupError("x"), ServoFault("x"), BusLost("x")])
def test_torque_that_cannot_be_switched_is_said(error):
    stops = Stops()
    stops.joints.error = error
    stops.control.halt(Stop("a hand"), 10.0)
    assert stops.ask(12.0, "") == "still stopped: x" and stops.control.reason == "a hand"
    assert stops.said[1:] == [
        "the stop is pending, torque is NOT YET off: x", "still stopped: x"
    ]  # fmt: skip


def test_servos_that_still_have_torque_lose_it_every_half_second():
    stops = Stops("ann")
    rows = (
        (10.4, (True, True), (), "-"),
        (10.5, (True, False), (), "--"),
        (10.9, (True, True), (), "--"),
        (11.1, (True, False), ("jaw",), "--"),
        (11.2, (True, True), (), "---"),
    )
    for t_s, torque, missing, did in rows:
        state: Any = SimpleNamespace(torque=torque, missing=missing)
        stops.control.keep_released(state, t_s)
        assert stops.joints.did == did
    still = "stopped, but {} still had torque: switched off again".format
    assert stops.said[1:] == [still("jaw"), still("jaw, neck")]
