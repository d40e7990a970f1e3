"""Scene of the browsers: the head, the people and the world, drawn by viser."""

import viser

from gazerig.robot.dashboard.door.viser_server import browser_of
from gazerig.robot.dashboard.feed.rig_feed import ShownHead, ShownRig, ShownWorld
from gazerig.robot.dashboard.view.glb import add_lights
from gazerig.robot.dashboard.view.head_view import HeadView
from gazerig.robot.dashboard.view.people import PeopleView
from gazerig.robot.dashboard.view.viewpoints import Viewpoints
from gazerig.robot.dashboard.view.world_view import WorldView
from gazerig.robot.model.commands import Layer, ShowView


class HeadScene:
    """Scene of one server."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Create the empty scene."""
        self._server = server
        self._viewpoints = Viewpoints(server, lambda number: browser_of(server, number))
        add_lights(server.scene)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._head = HeadView(server.scene)
        self._people = PeopleView(server.scene)
        self._world = WorldView(server.scene)
        self._layers: tuple[Layer, ...] = ()
        self._rig: ShownRig | None = None

    def change(self, view: ShowView, browser: str) -> None:
        """Show other layers, or another viewpoint to a browser; for any thread."""
        self._layers = self._layers if view.layers is None else view.layers
        if view.look_from is not None:
            self._viewpoints.choose(browser, view.look_from)

    def show(self, head: ShownHead, world: ShownWorld | None) -> None:
        """Draw a tick; without a browser, only the first one."""
        if self._rig is not None and not self._server.get_clients():
            return
        with self._server.atomic():  # browsers receive all changes of a tick together
            if head.rig is not self._rig:
                self._rig = head.rig
                self._viewpoints.fit(head)
            if world is not None:
                self._world.show(*world)
            self._head.on_table = world is not None
            self._head.show(head, sight="sight" in self._layers)
            # A simulated world draws its own people.
            self._people.show(head.tick, people=world is None)
