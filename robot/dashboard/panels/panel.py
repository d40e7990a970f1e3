"""Panels that show the rig: camera, reasons, traces and health."""

from functools import partial
from math import inf

from gazerig.robot.dashboard.feed.live_feed import OverlayChoices
from gazerig.robot.dashboard.panels.attention_panel import salience_bars, target_text
from gazerig.robot.dashboard.panels.joint_charts import JointCharts, JointSeries
from gazerig.robot.dashboard.panels.package_panels import PagePanels
from gazerig.robot.dashboard.panels.servo_health import alarms, health_table
from gazerig.robot.dashboard.widgets.html import note
from gazerig.robot.dashboard.widgets.widgets import PANELS, Widgets
from gazerig.robot.model.types import Snapshot

# Frames of the page between two drawings of an element; the page has at most 25 a second.
_WORDS_EVERY, _TRACES_EVERY = 3, 4


class PanelView:
    """Camera image, alarms, and the drawers Watch and Health.

    A drawer that no browser has open is not drawn.

    layers: layers of the scene, as selected by the users
    """

    def __init__(self, widgets: Widgets) -> None:
        self._widgets = widgets
        self._shown = 0
        self._open: frozenset[str] = frozenset()
        self.silence = widgets.panel("watch").html(order=0)
        self.panels = PagePanels(widgets.panel("watch"))
        self._begin()
        self.alarms = widgets.panel("headline").html()
        self.image = widgets.panel("camera").image("what the camera sees", pick=True)
        watch = widgets.panel("watch")
        self.winner = watch.html(note("waiting for the rig"), order=1)
        self.saliences = watch.html(order=2)
        self.traces = JointCharts(watch.section("traces", order=4))
        self.estimation_note = watch.html(order=5)
        self.view = watch.section("view", is_open=False, order=6)
        layers = self.layers = OverlayChoices()

        def select(name: str, is_on: bool, client: str) -> None:
            setattr(layers, name, is_on)

        for order, (name, says) in enumerate(OverlayChoices.NAMES.items()):
            box = self.view.checkbox(says, getattr(layers, name), order=order)
            box.on_change(partial(select, name))
        self.health = widgets.panel("health").html(note("waiting for the rig"))

    def _begin(self) -> None:
        """Reset all data that is collected from snapshots."""
        self._last_s = -inf
        self._last: Snapshot | None = None
        self._traces = JointSeries()
        self.panels.begin()

    def update(self, snapshots: tuple[Snapshot, ...]) -> None:
        """Add snapshots to the traces, also those that are not drawn.

        A snapshot with an earlier time than the last one, after a restart, resets all.
        """
        if snapshots:
            self.silence.content = ""
        for snapshot in snapshots:
            if snapshot.t_s < self._last_s:
                self._begin()
            self._last_s, self._last = snapshot.t_s, snapshot
            self._traces.add(snapshot)
            self.panels.update(snapshot)

    def show(self) -> None:
        """Draw the newest text and, less often, traces and strip."""
        if (snapshot := self._last) is None:
            return
        before, self._open = self._open, frozenset(filter(self._widgets.is_visible, PANELS))
        if self._open - before:
            self.draw_all()
        if self._shown % _WORDS_EVERY == 0:
            self.alarms.content = alarms(snapshot)
            if "watch" in self._open:
                self.winner.content = target_text(snapshot)
                self.saliences.content = salience_bars(snapshot)
                self.estimation_note.content = estimation_note(snapshot)
            if "health" in self._open:
                self.health.content = health_table(snapshot)
        if "watch" in self._open and self._shown % _TRACES_EVERY == 0:
            self.traces.show(self._traces)
        if "watch" in self._open:
            self.panels.draw(self._shown)
        self._shown += 1

    def draw_all(self) -> None:
        """Draw all elements at the next frame."""
        self._shown = 0


def estimation_note(snapshot: Snapshot) -> str:
    """Return a note that the eye movements are estimated, "" if they are measured."""
    if not any("eye" in joint for joint in snapshot.estimated):
        return ""
    return note(
        "The eyes' servos give no feedback: these are the movements the eyes should make, "
        "estimated from their goals, and no measurements."
    )
