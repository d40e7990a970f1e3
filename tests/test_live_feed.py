"""The page's snapshots of a running rig's ticks equal those made next to the loop."""

import socket
from collections.abc import Iterator
from dataclasses import fields
from typing import NamedTuple

import pytest
from fakes.runs import play, simulated
from msgspec import structs
from page_feed import IN_TIME
from shown_page import wait_for

from gazerig.robot.app.assemble import Assembly
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_stream import TickStream
from gazerig.robot.dashboard.feed.live_feed import (
    LiveFeed,
    LiveRig,
    read_waiting,
)
from gazerig.robot.dashboard.feed.page_process import URL, PageProcess
from gazerig.robot.dashboard.feed.publisher import Publisher
from gazerig.robot.dashboard.feed.snapshot import RunState, SnapshotBuilder
from gazerig.robot.model.control_source import TrackState
from gazerig.robot.model.conversation import ConversationState
from gazerig.robot.model.types import Snapshot


class Run(NamedTuple):
    made: Assembly
    ticks: list[Tick]


@pytest.fixture(scope="module", params=["desk", "maker"])
def ran(request: pytest.FixtureRequest) -> Run:
    """Two simulated seconds, so that there are saccades, a fixation and a blink."""
    made, ticks = simulated(request.param), list[Tick]()
    play(made, 2.0, ticks.append)
    return Run(made, ticks)


class Page:
    """A page's process that is a socket here, and what feeds it."""

    def __init__(self, made: Assembly) -> None:
        ours, self.feed = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.page = PageProcess("127.0.0.1", 0)
        self.page.join(ours)
        self.said: list[str] = []
        self.state = RunState({"lost": 3}, "wait", "talking", "shy", timing=IN_TIME)
        self.rigs = 0
        self.publisher = Publisher(
            self.page, lambda: self._rig(made), lambda: self.state, None, self.said.append
        )
        self.stream = TickStream(self.said.append, 0.0399)
        self.stream.add_sink("the page", self.publisher.take)
        self.live = LiveFeed()

    def _rig(self, made: Assembly) -> LiveRig:
        self.rigs += 1
        return LiveRig(made.shown_rig())

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
    direct = SnapshotBuilder(ran.made.shown_rig())
    shots: list[Snapshot] = []
    talk = ConversationState(3, "speaking", 1, 0.5, 6.0, 0.9, "Hello", "agent")
    ticks = [
        structs.replace(tick, conversation=talk, tracks=(TrackState(2, "show", owns=("jaw",)),))
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
    whole = direct.build(page.state)
    assert whole is not None and len(whole.events) > 2
    assert events == whole.events and trail == whole.trail
    for field in fields(Snapshot):
        if field.name not in ("events", "trail", "worst"):
            assert getattr(last, field.name) == getattr(whole, field.name), field.name
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


def test_without_anyone_who_looks_no_image_is_drawn_until_somebody_does(
    ran: Run, page: Page
) -> None:
    page.comes_up()
    page.live.watched = False
    page.stream.update(ran.ticks[-1])
    assert read_waiting(page.feed, page.live).image is None
    page.live.watched = True
    assert page.live.image() is not None


def test_a_page_that_takes_nothing_delays_nothing_and_is_counted(ran: Run, page: Page) -> None:
    page.comes_up()
    for n in range(3):
        for tick in ran.ticks:
            page.stream.update(structs.replace(tick, t_s=tick.t_s + 2.0 * n))
    assert page.page.dropped > 500 and page.said[1:] == []
    (shot,) = page.shown()  # what it had room for, and then the newest
    page.stream.update(structs.replace(ran.ticks[-1], t_s=99.0))
    (newest,) = page.shown()
    assert shot.t_s < 3.0 and newest.t_s == 99.0 and newest.faces
