"""View of a simulated scene through a camera; it can be sent to another process.

Drawing needs OpenCV, which is imported with the first picture.
"""

from typing import NamedTuple

from gazerig.drivers.types import ImageArray
from gazerig.robot.model.scene import PinholeView
from gazerig.sim_mock.scenes.scene import Scene


class DrawnScene(NamedTuple):
    """Draws the people and things of a scene in a room."""

    scene: Scene

    def draw(self, seen_by: PinholeView) -> ImageArray:
        """Return a picture; see ``SceneView.draw``."""
        from gazerig.sim_mock.cameras.picture import draw_picture

        return draw_picture(self.scene, seen_by)

    def close(self) -> None:
        """Do nothing: there is nothing to free."""
