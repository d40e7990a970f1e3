"""Scene of the browsers: the head, the people and the world, drawn by viser."""

import viser

from gazerig.robot.dashboard.feed.rig_feed import ShownHead, ShownRig, ShownWorld
from gazerig.robot.dashboard.view.glb import add_lights
from gazerig.robot.dashboard.view.head_view import HeadView
from gazerig.robot.dashboard.view.people import PeopleView
from gazerig.robot.dashboard.view.viewpoint import View, face_view
from gazerig.robot.dashboard.view.world_view import WorldView


class HeadScene:
    """Scene of one server."""

    def __init__(self, server: viser.ViserServer) -> None:
        """Create the empty scene."""
        self._server = server
        add_lights(server.scene)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._head = HeadView(server.scene)
        self._people = PeopleView(server.scene)
        self._world = WorldView(server.scene)
        self._view: View | None = None
        self._rig: ShownRig | None = None

    def show(self, head: ShownHead, world: ShownWorld | None) -> None:
        """Draw a tick; without a browser, only the first one."""
        if self._rig is not None and not self._server.get_clients():
            return
        with self._server.atomic():  # browsers receive all changes of a tick together
            if head.rig is not self._rig:
                self._rig = head.rig
                self._look(face_view(head))
            if world is not None:
                self._world.show(*world)
            self._head.on_table = world is not None
            self._head.show(head)
            # A simulated world draws its own people.
            self._people.show(head.tick, people=world is None)

    def _look(self, view: View) -> None:
        """Begin with a view in new browsers; if it is another one, show it in all."""
        if view == self._view:
            return
        self._view, start = view, self._server.initial_camera
        start.position, start.look_at, start.fov = view
        for client in self._server.get_clients().values():
            camera = client.camera
            camera.position, camera.look_at, camera.fov = view
