"""The page's process knows of the rig what its ticks say, and what was sent besides."""

import socket
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
import pytest
from fakes.runs import play, simulated
from msgspec import structs
from page_feed import IN_TIME, info
from present import present
from shown_page import wait_for

from gazerig.robot.dashboard.feed.page_process import URL, PageProcess
from gazerig.robot.dashboard.feed.publisher import Publisher
from gazerig.robot.dashboard.feed.rig_feed import LiveRig, RigFeed
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.head_state import HeadEvent, head_state
from gazerig.robot.loop.tick import Tick
from gazerig.robot.loop.tick_stream import TickStream
from gazerig.robot.model.reply import ConversationState, TrackState
from gazerig.robot.net.topics import RunState
from gazerig.robot.run.run import Run


class FeedRun(NamedTuple):
    made: Run
    ticks: list[Tick]


@pytest.fixture(scope="module", params=["desk", "maker"])
def ran(request: pytest.FixtureRequest) -> FeedRun:
    """Two simulated seconds, so that there are saccades, a fixation and a blink."""
    made, ticks = simulated(request.param), list[Tick]()
    play(made, 2.0, ticks.append)
    return FeedRun(made, ticks)


class Page:
    """A page's process that is a socket here, and what feeds it."""

    def __init__(self, made: Run) -> None:
        ours, self.feed = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.page = PageProcess("127.0.0.1", 0)
        self.page.join(ours)
        self.said: list[str] = []
        self.state = RunState("wait", "talking", "shy", health="bus: lost 3", timing=IN_TIME)
        self.rigs = 0
        self.publisher = Publisher(
            self.page, lambda: self._rig(made), lambda: self.state, self.said.append
        )
        self.stream = TickStream(self.said.append, 0.0399)
        self.stream.sinks.add("the page", self.publisher.take)
        self.live = RigFeed()

    def _rig(self, made: Run) -> LiveRig:
        self.rigs += 1
        return LiveRig(made.shown_rig(), info(made))

    def comes_up(self) -> None:
        before = self.page.started
        self.feed.send(URL + b"http://127.0.0.1:9/?token=x")
        wait_for(lambda: self.page.started > before, "the page")

    def newest(self) -> Tick | None:
        self.live.read_waiting(self.feed)
        return self.live.ticks.newest

    def close(self) -> None:
        self.page.close()
        self.feed.close()


@pytest.fixture
def page(ran: FeedRun) -> Iterator[Page]:
    one = Page(ran.made)
    yield one
    one.close()


def test_states_and_events_are_those_of_the_ticks_themselves(ran, page):
    page.comes_up()
    direct = TickFeed()
    events: list[HeadEvent] = []
    talk = ConversationState(3, "speaking", 1, 0.5, 6.0, 0.9, "Hello", "agent")
    for tick in ran.ticks:
        tracks = (TrackState("show", number=2, owns=("jaw",)),)
        tick = structs.replace(tick, conversation=talk, tracks=tracks)
        page.stream.update(tick)
        direct.update(tick)
        page.newest()
        events += page.live.ticks.events(len(events))
    page.stream.flush()
    state = head_state(present(page.newest()))
    events += page.live.ticks.events(len(events))
    assert state == head_state(present(direct.newest)) and len(state.people) == 1
    assert tuple(events) == direct.events() and len(events) > 2
    assert page.said == ["the page is at http://127.0.0.1:9/?token=x"]


def test_the_servos_silences_are_counted_and_what_is_seen_is_told(ran, page):
    page.comes_up()
    silent = structs.replace(ran.ticks[3].joints, missing=("eyes_pan",))
    for tick in (*ran.ticks[:3], structs.replace(ran.ticks[3], joints=silent)):
        page.stream.update(tick)
    page.stream.flush()
    page.newest()
    run = page.live.run_state()
    assert run.unanswered == {"eyes_pan": 1} and run.health == "bus: lost 3"
    assert "face 1 at" in run.perception or "no frame" in run.perception


def test_nothing_is_sent_before_the_page_is_there_and_everything_again_to_another(ran, page):
    for tick in ran.ticks[:100]:
        page.stream.update(tick)
    assert page.newest() is None and page.rigs == 0
    for n in (1, 2):
        page.comes_up()
        page.live = RigFeed()  # another process
        for tick in ran.ticks[n * 100 : n * 100 + 100]:
            page.stream.update(tick)
        tick = present(page.newest())
        assert page.rigs == n and page.live.run_state().behaviour == "wait"
        assert len(present(tick.percept).faces) == 1, "the percept in force comes again"


def test_a_picture_comes_once_with_what_was_seen_and_where_the_head_looked(ran, page):
    page.comes_up()
    assert page.live.picture() is None
    page.stream.update(ran.ticks[-1])
    page.newest()
    found = present(ran.ticks[-1].detections)
    picture, jpeg = present(page.live.picture())
    assert (picture.number, picture.width_px) == (found.number, found.width_px)
    assert len(picture.faces) == 1 and jpeg.startswith(b"\xff\xd8\xff")
    x, y, width, height = picture.faces[0].box_px  # the head looks at the person
    gaze_x, gaze_y = present(picture.gaze_px)
    assert x < gaze_x < x + width and y < gaze_y < y + height
    assert page.live.picture() is None
    white = np.full((found.height_px, found.width_px, 3), 255, np.uint8)
    found = replace(found, number=found.number + 1, image=white)
    page.stream.update(structs.replace(ran.ticks[-1], t_s=99.0, detections=found))
    page.newest()
    _, jpeg = present(page.live.picture())
    shown = present(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE))
    assert shown.min() > 250


def test_a_page_that_takes_nothing_delays_nothing_and_is_counted(ran, page):
    page.comes_up()
    for n in range(3):
        for tick in ran.ticks:
            page.stream.update(structs.replace(tick, t_s=tick.t_s + 2.0 * n))
    assert page.page.dropped > 500 and page.said[1:] == []
    shown = present(page.newest())  # what it had room for, and then the newest
    page.stream.update(structs.replace(ran.ticks[-1], t_s=99.0))
    newest = present(page.newest())
    assert shown.t_s < 3.0 and newest.t_s == 99.0 and present(newest.percept).faces
