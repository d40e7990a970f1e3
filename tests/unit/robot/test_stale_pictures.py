"""A camera that stops giving pictures: hold, search, come to rest, and begin again."""

from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from math import degrees, radians

import numpy as np
import pytest
from desk import GAZE_JOINTS
from fakes.runs import play, simulated
from fakes.scenes import EmptyScene

from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.types import Camera, Detections
from gazerig.gaze.angles import angle_between, sub
from gazerig.gaze.attention.attention import STALE_S
from gazerig.gaze.attention.idle import SEARCH_S
from gazerig.gaze.types import Vec3
from gazerig.robot.loop.loop import Tick
from gazerig.robot.run import surroundings
from gazerig.robot.safety.guard import FRAME_TIMEOUT_S
from gazerig.sim_mock.scenes.scene import ScenePerson

pytestmark = pytest.mark.usefixtures("ideal_servos")

GONE_S, BACK_S, END_S = 2.0, 9.0, 12.0
LOST, FOUND = "camera lost: trying it again", "camera back after 7.0 s"
NECK = slice(GAZE_JOINTS.index("neck_yaw"), GAZE_JOINTS.index("neck_roll") + 1)


class Passer(EmptyScene):
    """A scene: a person who walks from one side to the other, and on."""

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        y = 0.8 - 0.25 * t_s
        return (ScenePerson((1.2, y, 0.2), (float(np.arctan2(-y, -1.2)), 0.0), None),)


class BackAndForth(Passer):
    """A scene: a person aside who steps back and forth."""

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        y = 0.35 + 0.1 * float(np.sin(2.0 * t_s))
        return (ScenePerson((1.2, y, 0.2), (float(np.arctan2(-y, -1.2)), 0.0), None),)


PASSER, ASIDE = Passer(), BackAndForth()


@dataclass
class Unplugged:
    """A camera that gives nothing new for a while, as one whose cable is out."""

    camera: Camera
    newest: Detections | None = None
    reported: list[str] = field(default_factory=list)
    now_s: float = 0.0

    def open(self) -> None:
        self.camera.open()

    def latest(self, now_s: float) -> Detections | None:
        self.now_s = now_s
        found = self.camera.latest(now_s)
        if found is not None and not GONE_S <= found.captured_s < BACK_S:
            self.newest = found
        return self.newest

    def events(self) -> tuple[str, ...]:
        for at_s, line in ((GONE_S, LOST), (BACK_S, FOUND)):
            if self.now_s >= at_s and line not in self.reported:
                self.reported.append(line)
                return (line,)
        return ()

    def close(self) -> None:
        self.camera.close()


@cache
def watched(scene: Passer) -> tuple[Rig, list[Tick]]:
    """Run the rig before a scene, its camera unplugged for a while."""
    rig = load_rig("desk")
    rig = replace(rig, loop=replace(rig.loop, rate_hz=50.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(surroundings, "load_scene", lambda name, seed: scene)
        made = simulated(rig, scene.name, 3)
    made.robot.camera = Unplugged(made.robot.camera)
    ticks: list[Tick] = []
    play(made, END_S, ticks.append)
    return rig, ticks


LAST_LOOK_S = 0.4
"""What is looked at when the search is over is looked at to its end."""
RUNS = pytest.mark.parametrize("scene", [PASSER, ASIDE])


def between(ticks: list[Tick], start_s: float, end_s: float) -> list[Tick]:
    chosen = [tick for tick in ticks if start_s <= tick.t_s < end_s]
    assert chosen
    return chosen


def last_picture_s(ticks: list[Tick]) -> float:
    percepts = [tick.percept for tick in ticks if tick.t_s < BACK_S and tick.percept]
    return max(percept.captured_s for percept in percepts)


def phases(rig: Rig, ticks: list[Tick]) -> tuple[float, float, float]:
    """Return when the last picture is stale, when the search begins and when it ends."""
    stale_s = last_picture_s(ticks) + STALE_S
    search_s = stale_s + rig.gaze.idle.hold_ms / 1e3
    return stale_s, search_s, search_s + SEARCH_S


@RUNS
def test_hold_then_search_then_rest(scene):
    rig, ticks = watched(scene)
    stale_s, search_s, over_s = phases(rig, ticks)
    assert over_s < BACK_S - 1.0
    slack = 0.02
    before = between(ticks, GONE_S, stale_s - slack)
    assert {tick.target.kind for tick in before} == {"face"}
    assert all("lost" not in tick.target.why for tick in before)
    # A look away from a face may fall into the wait.
    waits = between(ticks, stale_s + slack, search_s - slack)
    held = [tick for tick in waits if tick.target.kind != "away"]
    assert len(held) > 0.6 * len(waits)
    assert all(tick.target.why.endswith("lost, waiting") for tick in held)
    assert len({tick.target.centre_world_m for tick in held}) == 1  # its parts are looked at
    assert {tick.target.v_world_m_s for tick in held} == {(0.0, 0.0, 0.0)}
    searching = between(ticks, search_s + slack, over_s - slack)
    assert {tick.target.kind for tick in searching} == {"search"}
    assert len({tick.target.id for tick in searching}) >= 3
    after = between(ticks, over_s + LAST_LOOK_S, BACK_S)
    assert after[0].target.kind == "rest"
    assert {tick.target.kind for tick in after} <= {"rest", "glance"}


@RUNS
def test_the_neck_does_not_move_on_a_stale_picture(scene):
    """From the guard's age on it stands, whatever search and rest wish."""
    _, ticks = watched(scene)
    blind_s = last_picture_s(ticks) + FRAME_TIMEOUT_S
    blind = between(ticks, blind_s + 0.02, BACK_S)
    commands = {tick.guard_result.command_rad[NECK] for tick in blind}
    assert len(commands) == 1
    assert all("neck_yaw: stale frame" in tick.guard_result.reasons for tick in blind)
    wishes = [degrees(tick.desired_rad[NECK][0]) for tick in blind]
    assert max(wishes) - min(wishes) > 3.0  # it would have moved
    eyes = [degrees(tick.joints.position_rad[0]) for tick in blind]
    assert max(eyes) - min(eyes) > 3.0  # the eyes do search


def test_who_was_walking_is_waited_for_ahead_not_where_the_last_picture_showed_them():
    rig, ticks = watched(PASSER)
    stale_s, search_s, _ = phases(rig, ticks)
    held = between(ticks, stale_s + 0.02, search_s - 0.02)
    percept, centre = held[0].percept, held[0].target.centre_world_m
    assert percept is not None and centre is not None
    shown, v = percept.faces[0].p_world_m, percept.faces[0].v_world_m_s
    assert v[1] == pytest.approx(-0.25, abs=0.08)
    assert centre[1] - shown[1] == pytest.approx(v[1] * 0.2, abs=1e-6)


def test_it_goes_on_with_the_first_new_pictures():
    """Without a restart, without a jerk, and with the eyes back on the face."""
    rig, ticks = watched(ASIDE)
    back = between(ticks, BACK_S + 0.5, END_S)
    kinds = [tick.target.kind for tick in back]
    assert set(kinds) <= {"face", "away"} and kinds.count("face") > 0.6 * len(kinds)
    back = [tick for tick in back if tick.target.kind == "face"]
    last = back[-1]
    assert angle_between(look(last), sub(last.target.p_world_m, last.pose.p_world_head_m)) < 0.05
    fastest = max(
        abs(b.guard_result.command_rad[NECK][0] - a.guard_result.command_rad[NECK][0])
        / (b.t_s - a.t_s)
        for a, b in pairwise(between(ticks, BACK_S, END_S))
    )
    assert 0.0 < fastest <= radians(rig.joints["neck_yaw"].max_speed_deg_s) + 1e-6


def look(tick: Tick) -> Vec3:
    """Return the intended direction of the eyes, from the head."""
    return sub(tick.gaze.gaze_point_world_m, tick.pose.p_world_head_m)
