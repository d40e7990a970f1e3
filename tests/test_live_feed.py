"""The page's snapshots of a running rig's ticks equal those made next to the loop."""

import socket
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np
import pytest
from present import present
from shown_page import wait_for
from world_shapes import SmallWorld

from gazerig.config.schema import load_rig
from gazerig.drivers.types import BusHealth, Detections
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.camera_factory import scene_start_s
from gazerig.robot.app.options import RunOptions
from gazerig.robot.cli.tune import state_lines
from gazerig.robot.control.loop import run
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_stream import TickStream
from gazerig.robot.control.tick_text import perception_text
from gazerig.robot.dashboard.feed.camera_overlay import background, draw_detections
from gazerig.robot.dashboard.feed.gaze_trail import GAZE_KEPT_S, GazeHistory
from gazerig.robot.dashboard.feed.live_feed import (
    LiveFeed,
    LiveRig,
    RunState,
    gaze_pixel,
    read_waiting,
)
from gazerig.robot.dashboard.feed.page_process import URL, PageProcess
from gazerig.robot.dashboard.feed.publisher import Publisher
from gazerig.robot.dashboard.feed.snapshot import SnapshotBuilder, SnapshotTexts
from gazerig.robot.dashboard.feed.status_line import StatusLine
from gazerig.robot.dashboard.panels.servo_health import health_table
from gazerig.robot.model.commands import Tune
from gazerig.robot.model.control_source import TrackState
from gazerig.robot.model.conversation import ConversationState
from gazerig.robot.model.types import Snapshot
from gazerig.robot.remote.request_handler import LoopMonitor
from gazerig.sim_mock.scenes.scene import ScenePicture


class Run(NamedTuple):
    made: Assembly
    ticks: list[Tick]


@pytest.fixture(scope="module", params=["desk", "maker"])
def ran(request: pytest.FixtureRequest) -> Iterator[Run]:
    """Two simulated seconds, so that there are saccades, a fixation and a blink."""
    options = RunOptions(rig=request.param, mock=True, fast=True, seed=0, scene="visitor")
    made, ticks = assemble(load_rig(request.param), options), list[Tick]()
    made.robot.start(made.clock)
    run(made.robot, made.clock, made.loop, lambda s: "over" if s >= 2.0 else None, ticks.append)
    made.robot.stop()
    yield Run(made, ticks)
    made.close()


class Page:
    """A page's process that is a socket here, and what feeds it."""

    def __init__(self, made: Assembly, every_s: float = 0.0399) -> None:
        ours, self.feed = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.page = PageProcess("127.0.0.1", 0)
        self.page.join(ours)
        self.said: list[str] = []
        self.state = RunState({"lost": 3}, "wait", "talking", "shy", (None, None, 0))
        self.rigs = 0
        self.picture: ScenePicture | None = None
        self.world: SmallWorld | None = None
        self.detector = ""
        self.publisher = Publisher(
            self.page, lambda: self._rig(made), lambda: self.state, None, self.said.append
        )
        self.stream = TickStream(self.said.append, every_s)
        self.stream.add_sink("the page", self.publisher.take)
        self.live = LiveFeed()

    def _rig(self, made: Assembly) -> LiveRig:
        self.rigs += 1
        return LiveRig(200.0, made.shown_rig(), False, self.picture, self.world, self.detector)

    def comes_up(self) -> None:
        before = self.page.started
        self.feed.send(URL + b"http://127.0.0.1:9/?token=x")
        wait_for(lambda: self.page.started > before, "the page")

    def shown(self) -> tuple[Snapshot, ...]:
        return read_waiting(self.feed, self.live).snapshots

    def close(self) -> None:
        self.page.close()
        self.feed.close()


@pytest.fixture
def page(ran: Run) -> Iterator[Page]:
    one = Page(ran.made)
    yield one
    one.close()


def test_a_snapshot_is_that_of_the_ticks_themselves(ran: Run, page: Page) -> None:
    page.comes_up()
    direct = SnapshotBuilder(200.0, ran.made.shown_rig())
    shots: list[Snapshot] = []
    talk = ConversationState(3, "speaking", 1, 0.5, 6.0, 0.9, "Hello", "agent")
    ticks = [
        tick._replace(conversation=talk, tracks=(TrackState(2, "show", owns=("jaw",)),))
        for tick in ran.ticks
    ]
    for tick in ticks:
        page.stream.update(tick)
        direct.update(tick)
        shots += page.shown()
    page.stream.flush()
    shots += page.shown()
    last = shots[-1]
    events = tuple(event for shot in shots for event in shot.events)
    trail = tuple(one for shot in shots for one in shot.trail)
    tick = ticks[-1]
    perception = perception_text(
        tick, ran.made.robot.perception.residual()._replace(speed_deg_s=None)
    )
    whole = direct.build(SnapshotTexts("bus: lost 3 times", "wait", perception, "shy", "talking"))
    assert whole is not None and len(whole.events) > 2
    assert events == whole.events and trail == whole.trail
    for field in fields(Snapshot):
        if field.name not in ("events", "trail", "worst", "timing"):
            assert getattr(last, field.name) == getattr(whole, field.name), field.name
    assert last.timing is not None and last.timing.overruns_ever == 0
    assert page.said == ["the page is at http://127.0.0.1:9/?token=x"]


def test_nothing_is_sent_before_the_page_is_there_and_everything_again_to_another(
    ran: Run, page: Page
) -> None:
    for tick in ran.ticks[:100]:
        page.stream.update(tick)
    assert page.shown() == () and page.rigs == 0
    for n in (1, 2):
        page.comes_up()
        page.live = LiveFeed()  # another process
        for tick in ran.ticks[n * 100 : n * 100 + 100]:
            page.stream.update(tick)
        (shot,) = page.shown()
        assert page.rigs == n
        assert (shot.health, shot.behaviour) == ("bus: lost 3 times", "wait")
        assert len(shot.faces) == 1, "the percept in force comes again"


def test_what_has_not_changed_is_not_sent_again_and_tuning_is(ran: Run, page: Page) -> None:
    page.comes_up()
    for tick in ran.ticks:
        page.stream.update(tick)
        page.shown()
    assert page.rigs == 1
    page.publisher.process_commands((Tune((("camera.yaw_deg", 3.0),)),))
    page.stream.update(ran.ticks[-1]._replace(t_s=ran.ticks[-1].t_s + 1.0))
    assert page.rigs == 2


@pytest.mark.parametrize("depth", [False, True])
def test_the_image_is_drawn_as_the_camera_gave_it(ran: Run, page: Page, depth: bool) -> None:
    page.comes_up()
    page.publisher.depth = depth
    rng = np.random.default_rng(0)
    image = rng.integers(0, 255, (400, 640, 3), np.uint8)
    metres = rng.random((400, 640), np.float32) + 0.5
    tick = ran.ticks[-1]
    assert tick.detections is not None
    found = replace(tick.detections, image=image, depth_m=metres)
    page.stream.update(tick._replace(detections=found))
    news = read_waiting(page.feed, page.live)
    assert news.image is not None
    assert found.located is not None
    lens, poses = found.located.intrinsics, page.live._poses
    assert poses is not None
    R, p_m = ran.made.shown_rig().mount.pose(*poses.head_pose(found.captured_s))
    for gaze_px in (None, gaze_pixel(tick.gaze.gaze_point_world_m, R, p_m, lens)):
        drawn = draw_detections(background(found, depth), found, gaze_px, lens, faces=False)
        if np.array_equal(drawn, news.image):
            break
    else:
        raise AssertionError("another image is drawn")
    assert read_waiting(page.feed, page.live).image is None


def test_a_late_frame_is_drawn_with_the_gaze_of_its_capture() -> None:
    history = GazeHistory()
    for n in range(1000):
        history.add(0.005 * n, (0.001 * n, 0.0, 0.0))
    assert history.at(4.9)[0] == pytest.approx(0.98) and history.at(9.0)[0] == pytest.approx(0.999)
    assert history.at(0.0)[0] == pytest.approx(0.999 - 0.2 * GAZE_KEPT_S, abs=0.002)  # oldest
    history.add(1.0, (7.0, 0.0, 0.0))  # the rig was started again
    assert history.at(4.9) == (7.0, 0.0, 0.0)


def test_a_simulated_scene_is_drawn_as_its_camera_sees_it(ran: Run, page: Page) -> None:
    page.comes_up()
    page.live.choices.gaze = False
    start_s = scene_start_s(ran.made.robot.camera)
    assert start_s is not None and ran.made.scene is not None
    page.picture = ScenePicture(ran.made.scene)
    page.state = page.state._replace(scene_start_s=start_s)
    page.stream.update(ran.ticks[-1])
    image = read_waiting(page.feed, page.live).image
    assert image is not None and image.shape == (400, 640, 3)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 500  # a picture, and no dark ground
    # Detections are at drawn people: hair and skin differ from the wall behind.
    found = ran.ticks[-1].detections
    assert found is not None and found.faces
    x, y = found.faces[0].landmarks_px[2]
    face = image[int(y) - 8 : int(y) + 8, int(x) - 8 : int(x) + 8].reshape(-1, 3).mean(axis=0)
    assert face[2] > face[0] + 20  # red above blue: skin
    plain = image.copy()
    for name in ("faces", "gaze", "heat"):
        setattr(page.live.choices, name, True)
        page.live._new_frame = True
        with_it = page.live.image()
        assert with_it is not None and not np.array_equal(with_it, plain), name
        setattr(page.live.choices, name, False)


def test_without_anyone_who_looks_no_image_is_drawn_until_somebody_does(
    ran: Run, page: Page
) -> None:
    page.comes_up()
    page.live.watched = False
    page.stream.update(ran.ticks[-1])
    assert read_waiting(page.feed, page.live).image is None
    page.live.watched = True
    assert page.live.image() is not None


def test_a_camera_without_images_and_depth_says_so(ran: Run, page: Page) -> None:
    page.comes_up()
    page.live.choices.gaze = False
    page.publisher.depth = True
    page.stream.update(ran.ticks[-1]._replace(detections=Detections(0.0, 1, 640, 400)))
    with_words = read_waiting(page.feed, page.live).image
    page.publisher.depth = False
    page.stream.update(ran.ticks[-1]._replace(t_s=99.0, detections=Detections(0.0, 2, 640, 400)))
    without = read_waiting(page.feed, page.live).image
    assert with_words is not None and without is not None
    white = [bool((image.min(axis=2) > 200).any()) for image in (with_words, without)]
    assert white == [True, False]


def test_a_page_that_takes_nothing_delays_nothing_and_is_counted(ran: Run, page: Page) -> None:
    page.comes_up()
    for n in range(3):
        for tick in ran.ticks:
            page.stream.update(tick._replace(t_s=tick.t_s + 2.0 * n))
    assert page.page.dropped > 500 and page.said[1:] == []
    (shot,) = page.shown()  # what it had room for, and then the newest
    page.stream.update(ran.ticks[-1]._replace(t_s=99.0))
    (newest,) = page.shown()
    assert shot.t_s < 3.0 and newest.t_s == 99.0 and newest.faces


def test_a_world_goes_with_the_time_since_it_began(ran: Run, page: Page) -> None:
    page.world = SmallWorld()
    page.comes_up()
    page.state = page.state._replace(scene_start_s=ran.ticks[0].t_s - 1.5)
    for tick in ran.ticks[:60]:
        page.stream.update(tick)
    page.stream.flush()
    news = read_waiting(page.feed, page.live)
    assert news.world is not None and news.world.shapes == SmallWorld()
    assert news.world.world_s == pytest.approx(1.5 + ran.ticks[59].t_s - ran.ticks[0].t_s)


def test_before_a_world_has_begun_there_is_none(ran: Run, page: Page) -> None:
    page.world = SmallWorld()
    page.comes_up()
    page.stream.update(ran.ticks[0])
    page.stream.flush()
    news = read_waiting(page.feed, page.live)
    assert news.snapshots and news.world is None


def test_the_page_names_the_detector_and_what_it_lacks(ran: Run, page: Page) -> None:
    page.detector = "faces by auto (MTCNN alone): gazerig models fetch yunet"
    page.comes_up()
    page.stream.update(ran.ticks[0])
    page.stream.flush()
    (shot,) = page.shown()
    assert shot.perception.endswith(f" | {page.detector}") and page.detector in health_table(shot)


def test_why_the_camera_sees_badly_is_shown_everywhere(ran: Run, page: Page) -> None:
    why = "the picture is too dark: switch on a light"
    tick = next(one for one in reversed(ran.ticks) if one.detections is not None)
    found = replace(present(tick.detections), conditions=(why,))
    dark = tick._replace(detections=found)
    page.comes_up()
    for one in (ran.ticks[0], dark, dark._replace(t_s=dark.t_s + 1.0)):
        page.stream.update(one)
    page.stream.flush()
    shot = page.shown()[-1]
    assert why in shot.perception and why in health_table(shot)
    lines: list[str] = []
    StatusLine(lines.append, lambda: BusHealth(0, 0, {}), lambda: None).update(dark)
    assert "camera: the picture is too dark" in lines[0] and "switch on" not in lines[0]
    pulse = LoopMonitor(ran.made.clock)
    pulse.update(dark)
    now = {**pulse.as_json(), "unsaved": 0}
    assert f"camera: {why}" in state_lines(now)
