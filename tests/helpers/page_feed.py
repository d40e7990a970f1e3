"""A running rig's ticks for a page, sent as the control loop sends them."""

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from fakes.runs import play, simulated
from msgspec import structs
from present import present

from gazerig.robot.dashboard.feed.page_process import PageProcess
from gazerig.robot.dashboard.feed.publisher import Publisher
from gazerig.robot.dashboard.feed.rig_feed import LiveRig, ShownHead
from gazerig.robot.loop.tick import Tick
from gazerig.robot.loop.tick_stream import TickStream
from gazerig.robot.model.types import LoopFigures
from gazerig.robot.net.topics import JointInfo, RigInfo, RunState
from gazerig.robot.run.run import Run

IN_TIME = LoopFigures(200.0, 0, 10.0, 0.0, 0.0)
STATE = RunState("wait", "", "shy", health="bus ok", timing=IN_TIME)
GREY = np.full((400, 640, 3), (140, 120, 100), np.uint8)
"""A picture of the size that the scene's camera has."""


@cache
def visit(name: str) -> tuple[Run, Tick]:
    """Return a rig, and its tick after 1.2 s: it looks at the mouth of a person."""
    made, ticks = simulated(name, "face-to-face", bus="ideal"), list[Tick]()
    play(made, 1.2, ticks.append)
    return made, ticks[-1]


def info(made: Run) -> RigInfo:
    """Return what is constant of a rig with emulated servos."""
    joint = JointInfo(-0.6, 0.6, 55.0, 65.0, 4.8, 6.7, 0.5)
    names = made.shown_rig().kinematics.names
    return RigInfo("desk", "/rigs/desk.yaml", True, False, "", "", dict.fromkeys(names, joint))


def shown(name: str = "desk", **changes: Any) -> ShownHead:
    """Return a rig that looks at the mouth of a person, with changes of the tick."""
    made, tick = visit(name)
    return ShownHead(structs.replace(tick, **changes), made.shown_rig())


class PageFeed:
    """Sends ticks of a rig to a page.

    tick: what the next ticks are made of
    state: what ticks do not contain
    """

    def __init__(self, page: PageProcess, rig: str = "desk") -> None:
        self._made, self.tick = visit(rig)
        self.state = STATE
        publisher = Publisher(page, self._rig, lambda: self.state, lambda line: None)
        self._stream = TickStream(_fail, 0.0)
        self._stream.sinks.add("the page", publisher.take)
        self._frame = 1000

    def _rig(self) -> LiveRig:
        return LiveRig(self._made.shown_rig(), info(self._made))

    def turned(self, joints_rad: Mapping[str, float]) -> Tick:
        """Return the tick with other angles of some joints."""
        joints, names = self.tick.joints, self.tick.guard_result.joints
        at = [joints_rad.get(n, x) for n, x in zip(names, joints.position_rad, strict=True)]
        joints = structs.replace(joints, position_rad=tuple(at))
        pose = self._made.shown_rig().kinematics.forward(joints)
        return structs.replace(self.tick, joints=joints, pose=pose, desired_rad=tuple(at))

    def show(self, image: np.ndarray | None = None, **changes: Any) -> Tick:
        """Send a tick that is later than all pauses between messages; return it."""
        t_s = self.tick.t_s + 0.4
        found, percept = present(self.tick.detections), present(self.tick.percept)
        self._frame += 1
        found = replace(found, captured_s=t_s, number=self._frame, image=image)
        percept = structs.replace(percept, captured_s=t_s)
        self.tick = structs.replace(self.tick, t_s=t_s, percept=percept)
        tick = structs.replace(self.tick, detections=found, **changes)
        self._stream.update(tick)
        return tick


@contextmanager
def going_on(show: Callable[[], object]) -> Iterator[None]:
    """Show something every 20 ms from a thread, as a running rig does."""
    done = threading.Event()

    def work() -> None:
        while not done.wait(0.02):
            show()

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def _fail(line: str) -> None:
    raise AssertionError(line)
