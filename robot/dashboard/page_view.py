"""Scene and panels of the browsers, drawn from the rig's snapshots."""

from collections.abc import Callable, Mapping, Sequence

import viser

from gazerig.drivers.types import ImageArray
from gazerig.robot.dashboard.door.viser_server import browser_of
from gazerig.robot.dashboard.feed.camera_overlay import encode
from gazerig.robot.dashboard.feed.live_feed import News, OverlayChoices, ShownWorld
from gazerig.robot.dashboard.feed.page_process import (
    CHOICES,
    MESSAGE,
    PARAMS,
    TRACKS,
    VALUES,
)
from gazerig.robot.dashboard.panels.controls import Controls, refused_moves
from gazerig.robot.dashboard.panels.panel import PanelView
from gazerig.robot.dashboard.panels.servo_health import no_data_text
from gazerig.robot.dashboard.requests.outbox import Outbox
from gazerig.robot.dashboard.view.glb import add_lights
from gazerig.robot.dashboard.view.head_view import HeadView
from gazerig.robot.dashboard.view.overlays import OverlayPanel
from gazerig.robot.dashboard.view.people import PeopleView
from gazerig.robot.dashboard.view.viewpoints import NAMES, Viewpoints
from gazerig.robot.dashboard.view.world_view import WorldView
from gazerig.robot.dashboard.widgets.widgets import Widgets
from gazerig.robot.model.control_source import ControlSource, control_sentence
from gazerig.robot.model.moved_opponent import has_opponent
from gazerig.robot.model.types import Snapshot

_REFUSED = "refused: "


class PageView:
    """Scene and panels of one server.

    emulated: whether the rig's servos are emulated; then pointer control is on from the start
    choice: settings chosen for this computer, shown to each new browser; "" shows nothing
    """

    def __init__(
        self,
        server: viser.ViserServer,
        widgets: Widgets,
        outbox: Outbox,
        tell: Callable[[Mapping[str, object]], None],
    ) -> None:
        """Create the empty scene.

        outbox: sends requests of users to the rig; tell: sends state to the stop buttons
        """
        self._server, self._widgets = server, widgets
        self._outbox = outbox
        self._tell = tell
        self._viewpoints = Viewpoints(server, lambda number: browser_of(server, number))
        add_lights(server.scene)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._head = HeadView(server.scene)
        self._people = PeopleView(server.scene)
        self._world = WorldView(server.scene)
        self._panel = PanelView(widgets)
        self._layers = OverlayPanel(server.scene)
        self._controls = Controls(widgets, server.scene, outbox)
        self._newest: Snapshot | None = None
        self._menus: Mapping[str, Sequence[str]] = {}
        self.emulated = False
        self.choice = ""
        widgets.on_join(self._greet)
        self._image: ImageArray | None = None
        self._world_now: ShownWorld | None = None
        self._drawn = self._watched = False
        buttons = self._panel.view.buttons("look from", NAMES, order=-1)
        buttons.on_press(
            lambda name, client: self._viewpoints.choose(widgets.browser(client), name)
        )

    @property
    def choices(self) -> OverlayChoices:
        """Return the selected layers; users change them."""
        return self._panel.layers

    def _greet(self, client: str) -> None:
        """Show a new browser the settings chosen for this computer."""
        if self.choice:
            self._widgets.notify(self.choice, client)

    def watched(self) -> bool:
        """Return whether any browser shows the page."""
        return self._widgets.is_watched or bool(self._server.get_clients())

    def show(self, news: News) -> None:
        """Draw the newest data; without a browser, keep it until one connects."""
        for kind, data in news.others:
            self._take(kind, data)
        self._panel.update(news.snapshots)
        if news.snapshots:
            self._newest = news.snapshots[-1]
            shot = self._newest
            self._tell({
                "stopped": shot.stopped,
                "silent": False,
                # Joints without feedback jump when the torque is switched on.
                "without_feedback": len(shot.estimated),
                "emulated": self.emulated,
                "opponent": self._world_now is not None and has_opponent(self._world_now.shapes),
                "refused": refused_moves(self._menus, shot.joints),
                **headline_json(shot.control_source, shot),
            })  # fmt: skip
        self._image = news.image if news.image is not None else self._image
        self._world_now = news.world
        self._head.shape = news.shape or self._head.shape
        watched = self.watched()
        if watched and not self._watched:  # a new browser may find a rig that sends nothing
            self._panel.draw_all()
        self._watched = watched
        if watched or not self._drawn:
            # Browsers receive all changes of a snapshot together.
            with self._server.atomic(), self._widgets.hold_changes():
                self._draw()

    def _take(self, kind: bytes, data: object) -> None:
        """Apply messages of the rig other than snapshots and frames."""
        if kind == MESSAGE and isinstance(data, list):
            client, text = data
            if text:
                refused = text.startswith(_REFUSED)
                self._widgets.notify(
                    text.removeprefix(_REFUSED), client, self._outbox.name(client), refused=refused
                )
                if refused:
                    self._controls.show_values()
        elif kind == PARAMS and isinstance(data, list):
            self._controls.add_params(data)
        elif kind == TRACKS and isinstance(data, list):
            self._controls.add_tracks(data)
        elif isinstance(data, dict):
            if kind == CHOICES:
                self._menus = data
                self._controls.offer(data)
            elif kind == VALUES:
                self._controls.update_values(data)

    def _draw(self) -> None:
        if self._newest is not None:
            self._viewpoints.fit(self._newest)
            # A simulated world draws its own room and people; then only mark the detections.
            if self._world_now is not None:
                self._world.show(*self._world_now)
            self._head.on_table = self._world_now is not None
            self._people.mark_only(self._world_now is not None)
            layers = self._panel.layers
            self._head.show(self._newest, sight=layers.sight, camera=layers.camera)
            self._people.show(self._newest, parts=layers.parts)
            self._layers.show(self._newest, layers, self._head.lid_edges)
            self._controls.show(self._newest)
            self._drawn = True
        self._panel.show()
        if self._image is not None:
            self._panel.image.show(encode(self._image))
        self._newest = self._image = None

    def silent(self) -> None:
        """Show that no more data arrives, together with the last data."""
        self.show(News((), ended=False))
        if self._drawn:
            self._panel.silence.content = no_data_text()
            self._tell({"stopped": "", "silent": True})


def headline_json(leader: ControlSource, shot: Snapshot) -> dict[str, object]:
    """Return the source of control and the activity of the head, for the page's headline."""
    return {
        "control_kind": leader.kind,
        "control_sentence": control_sentence(leader, shot.t_s),
        "headline": shot.headline,
        "busy": shot.busy,
    }
