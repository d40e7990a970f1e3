"""The page's texts and images: status and camera on one side, reasons and figures on the other.

What the rig does stands above the controls. Reasons, traces, statistics and health are tabs
of a window of their own at the other side, which can be moved, shrunk or closed up.
"""

from collections.abc import Callable
from math import inf

import cv2
import numpy as np
import viser

from gazerig.drivers.types import ImageArray
from gazerig.robot.dashboard.attention_panel import saliences, winner
from gazerig.robot.dashboard.dwell_chart import DwellChart
from gazerig.robot.dashboard.event_timeline import Timeline
from gazerig.robot.dashboard.gaze_map import GazeMap
from gazerig.robot.dashboard.html import frame, heading, note
from gazerig.robot.dashboard.joint_charts import JointCharts, JointSeries
from gazerig.robot.dashboard.main_sequence_chart import MainSequenceChart
from gazerig.robot.dashboard.overlays import OverlayChoices
from gazerig.robot.dashboard.servo_health import health
from gazerig.robot.dashboard.status import silence, status
from gazerig.robot.model.types import SeenFixation, SeenSaccade, Snapshot

# What is shown by and by, in frames of the page, of which there are at most 25 a second.
_WORDS_EVERY, _TRACES_EVERY, _STRIP_EVERY, _FIGURES_EVERY = 3, 4, 8, 25
_WIDTH_PX = 340


class PanelView:
    """Status, camera image, and a window of tabs: why, traces, statistics, health, view.

    layers: what is to be drawn into the scene, as chosen in the tab "view"
    depth: called whenever a user selects the depth image or the plain one
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui = gui
        self._status = gui.add_html(frame("<b>waiting for the rig</b>"), order=1)
        self._image: viser.GuiImageHandle | None = None
        self._shown = 0
        self.depth: Callable[[bool], None] = _ignore
        self._begin()
        window = gui.add_panel()
        window.dock_left()
        window.set_width(_WIDTH_PX)
        with window.add_tab("why"):
            self._winner = gui.add_html(frame("nothing yet"), order=1)
            gui.add_html(frame(heading("the last 30 seconds")), order=2)
            self._strip = gui.add_html("", order=3)
            self._saliences = gui.add_html("", order=4)
        self._traces_view = JointCharts(gui, window.add_tab("traces"))
        self._statistics = window.add_tab("statistics")
        with self._statistics:
            self._of_what = gui.add_html("", order=0)
            self._saccades = gui.add_html("", order=1)
            self._dwells = gui.add_html("", order=2)
            self._add_map_title()
        with window.add_tab("health"):
            self._health = gui.add_html(frame("nothing yet"), order=1)
        with window.add_tab("view"):
            self.layers = self._add_layers()
        self._map_image: viser.GuiImageHandle | None = None
        self._draw_figures()

    def _begin(self) -> None:
        """Start all that is gathered from the snapshots."""
        self._last_s = -inf
        self._traces, self._timeline, self._sequence = (
            JointSeries(),
            Timeline(),
            MainSequenceChart(),
        )
        self._dwell, self._map = DwellChart(), GazeMap()

    def update(self, snapshots: tuple[Snapshot, ...]) -> None:
        """Remember every snapshot for traces and figures, also those that are not drawn.

        One from before the last, of a rig or recording that starts again, resets all.
        """
        for snapshot in snapshots:
            if snapshot.t_s < self._last_s:
                self._begin()
            self._last_s = snapshot.t_s
            self._traces.add(snapshot)
            self._timeline.update(snapshot)
            self._map.update(snapshot)
            for event in snapshot.events:
                if isinstance(event, SeenSaccade):
                    self._sequence.update(event)
                elif isinstance(event, SeenFixation):
                    self._dwell.update(event)

    def show(self, snapshot: Snapshot) -> None:
        """Draw the newest words and, less often, traces, strip and figures."""
        if self._shown % _WORDS_EVERY == 0:
            self._status.content = status(snapshot)
            self._winner.content = winner(snapshot)
            self._saliences.content = saliences(snapshot)
            self._health.content = health(snapshot)
            self._of_what.content = of_what(snapshot)
        if self._shown % _TRACES_EVERY == 0:
            self._traces_view.show(self._traces)
        if self._shown % _STRIP_EVERY == 0:
            self._strip.content = self._timeline.drawing()
        if self._shown % _FIGURES_EVERY == 0:
            self._draw_figures()
        self._shown += 1

    def silent(self) -> None:
        """Show that the rig sends nothing any more."""
        self._status.content = silence()
        self.draw_all()

    def draw_all(self) -> None:
        """Draw everything at the next frame, whichever element is due."""
        self._shown = 0

    def show_frame(self, jpeg: bytes) -> None:
        """Draw a recorded camera image; one that cannot be decoded is skipped."""
        bgr = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        if bgr is not None:
            self.show_image(np.asarray(bgr, np.uint8))

    def show_image(self, bgr: ImageArray) -> None:
        """Draw the camera image."""
        rgb = cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)
        if self._image is None:
            self._image = self._gui.add_image(rgb, label="camera", format="jpeg", order=2)
        self._image.image = rgb

    def _add_map_title(self) -> None:
        says = "where on the face the gaze has been; yellow is where it was longest"
        self._gui.add_html(frame(heading("heat map on the face") + note(says)), order=3)

    def _draw_figures(self) -> None:
        """Draw what grows as the rig runs."""
        self._dwells.content = self._dwell.drawing()
        self._saccades.content = self._sequence.drawing()
        if self._map.seconds <= 0.0:
            return
        image = self._map.image()
        if self._map_image is None:
            with self._statistics:
                self._map_image = self._gui.add_image(image, format="jpeg", order=4)
        else:
            self._map_image.image = image

    def _add_layers(self) -> OverlayChoices:
        layers = OverlayChoices()
        for order, (name, says) in enumerate(OverlayChoices.NAMES.items()):
            box = self._gui.add_checkbox(says, initial_value=getattr(layers, name), order=order)
            box.on_update(_setter(layers, name))
        depth = self._gui.add_checkbox("depth instead of the camera image", False, order=9)

        @depth.on_update
        def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            self.depth(event.target.value)

        return layers


def of_what(snapshot: Snapshot) -> str:
    """Return a remark that eye movements are estimated, "" if they are measured."""
    if not any("eye" in joint for joint in snapshot.estimated):
        return ""
    return frame(
        note(
            "The eyes' servos give no feedback: these are the movements the eyes should make, "
            "estimated from their goals, and no measurements."
        )
    )


def _setter(
    layers: OverlayChoices, name: str
) -> Callable[[viser.GuiEvent[viser.GuiCheckboxHandle]], None]:
    def put(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
        setattr(layers, name, event.target.value)

    return put


def _ignore(wanted: bool) -> None:
    """Do nothing: there is no receiver."""
