"""Shows a running robot to people, beside the control loop and never inside it.

The loop leaves its newest tick in one slot. A thread turns it into the status line,
the page's snapshots and the camera image with what was found in it; a slow terminal
or browser delays only itself.
"""

import contextlib
import threading
from collections.abc import Callable, Iterator
from math import radians
from typing import NamedTuple

import numpy as np

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import BusHealth, Detections
from gazerig.gaze.angles import rotate_back, sub
from gazerig.robot.control.loop import Tick
from gazerig.robot.control.tick_text import (
    guard_text,
    health_text,
    lead_text,
    perception_text,
    target_name,
)
from gazerig.robot.dashboard.camera_overlay import draw_detections, encode, ground
from gazerig.robot.dashboard.page_process import PageProcess
from gazerig.robot.dashboard.param_feed import ParamFeed
from gazerig.robot.dashboard.snapshot import SnapshotBuilder, SnapshotTexts
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.model.intrinsics import intrinsics_of_lens, project
from gazerig.robot.perception.egomotion_residual import ResidualFigures

_SNAPSHOT_S = 0.04
_FRAME_S = 0.1
_LINE_S = 0.2


class InForce(NamedTuple):
    """What people have chosen from the menus."""

    behaviour: str
    conversation: str
    character: str


def _drop(text: str) -> None:
    """Drop a message: there is no page."""


class Publisher:
    """A thread that publishes the newest tick to the page and the status line.

    Args:
        page: the page; None: there is none.
        say: rewrites the status line; None: there is none.
        snapshots: builds what the page shows.
        health: returns the present state of the bus.
        in_force: returns the present choices.
        residual: returns the present ego-motion residual.
        mount: where the camera sits.
        poses: the poses of the head.
        horizontal_field_deg: returns the camera's present field of view.
        feed: sends the parameters to the page.
        tell: prints a line that stays, such as the page's address.
    """

    def __init__(
        self,
        page: PageProcess | None,
        say: Callable[[str], None] | None,
        snapshots: SnapshotBuilder,
        health: Callable[[], BusHealth],
        in_force: Callable[[], InForce],
        residual: Callable[[], ResidualFigures],
        mount: CameraMount,
        poses: PoseHistory,
        horizontal_field_deg: Callable[[], float],
        feed: ParamFeed | None = None,
        tell: Callable[[str], None] = _drop,
    ) -> None:
        self._page = page
        self._say = say
        self._snapshots = snapshots
        self._health = health
        self._in_force = in_force
        self._residual = residual
        self._feed = feed
        self._tell = tell
        self._mount = mount
        self._poses = poses
        self._field_deg = horizontal_field_deg
        self.depth = False
        self._url_told = False
        self._failed: set[str] = set()
        self._page_started = 0
        self._slot: Tick | None = None
        self._ticks = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="publisher", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def update(self, tick: Tick) -> None:
        """Leave the newest tick; called by the loop."""
        self._slot = tick
        self._ticks += 1
        if self._page is not None:
            self._snapshots.update(tick)

    def stop(self) -> None:
        """Stop looking."""
        self._over.set()
        self._thread.join(timeout=2.0)

    def _watch(self) -> None:
        rate = _Rate()
        round_number, frame_number = 0, 0
        while not self._over.wait(_SNAPSHOT_S):
            tick = self._slot
            if tick is None:
                continue
            round_number += 1
            rate.update(tick.t_s, self._ticks)
            with self._spared("the page's figures"):
                if self._page is not None:
                    shot = self._snapshots.take(self._said(tick))
                    if shot is not None:
                        self._page.show(shot)
            with self._spared("the page's notices"):
                if self._page is not None:
                    self._tell_of(self._page)
            with self._spared("the page's frame"):
                if round_number % round(_FRAME_S / _SNAPSHOT_S) == 0:
                    frame_number = self._show_frame(tick, frame_number)
            with self._spared("the status line"):
                if self._say is not None and round_number % round(_LINE_S / _SNAPSHOT_S) == 0:
                    self._say(self._line(tick, rate.hz))

    @contextlib.contextmanager
    def _spared(self, name: str) -> Iterator[None]:
        """Go on whatever the block raises; say so once."""
        try:
            yield
        except Exception as error:
            if name not in self._failed:
                self._failed.add(name)
                if self._tell is not None:
                    self._tell(f"{name} failed ({type(error).__name__}: {error}); the rig runs on")

    def _said(self, tick: Tick) -> SnapshotTexts:
        """Gather what the tick itself does not tell."""
        now = self._in_force()
        text, perception = health_text(self._health()), perception_text(tick, self._residual())
        return SnapshotTexts(text, now.behaviour, perception, now.character, now.conversation)

    def _tell_of(self, page: PageProcess) -> None:
        """Send the page its parameters, and print the page's address."""
        if self._feed is not None:
            if page.started != self._page_started and self._page_started:
                self._feed.begin_anew()
            self._page_started = page.started
            self._feed.step()
        if not self._url_told and (url := page.url()) is not None:
            self._url_told = True
            self._tell(f"the page is at {url}")
        while (note := page.notice()) is not None:
            self._tell(note)

    def _show_frame(self, tick: Tick, shown: int) -> int:
        """Send the camera image unless it was sent already; give its number."""
        found = tick.detections
        if self._page is None or found is None or found.number == shown:
            return shown
        field_rad = radians(self._field_deg())
        lens = intrinsics_of_lens(None, field_rad, found.width_px, found.height_px, found.lens)
        drawn = draw_detections(
            ground(found, self.depth), found, self._gaze_px(tick, found, lens), lens.fx_px
        )
        self._page.show_frame(encode(drawn))
        return found.number

    def _gaze_px(
        self, tick: Tick, found: Detections, lens: Intrinsics
    ) -> tuple[float, float] | None:
        """Return where in the image the gaze goes, None when it is outside."""
        R, p = self._mount.pose(*self._poses.head_pose(found.captured_s))
        x, y, z = rotate_back(R, sub(tick.gaze.gaze_point_world_m, p))
        if z < 0.05:
            return None
        u, v = project(np.array([[x, y, z]]), lens)[0].tolist()
        return (u, v)

    def _line(self, tick: Tick, rate_hz: float) -> str:
        parts = [
            f"{rate_hz:5.1f} Hz",
            f"{target_name(tick.target)} - {tick.target.why}",
            *([f"led by {lead_text(tick)}"] if tick.led else []),
            guard_text(tick.guard_result),
            health_text(self._health()),
        ]
        return " | ".join(parts)


class _Rate:
    """Ticks a second over the last second."""

    def __init__(self) -> None:
        self.hz = 0.0
        self._from: tuple[float, int] | None = None

    def update(self, t_s: float, ticks: int) -> None:
        if self._from is None:
            self._from = (t_s, ticks)
        elif t_s - self._from[0] >= 1.0:
            self.hz = (ticks - self._from[1]) / (t_s - self._from[0])
            self._from = (t_s, ticks)
