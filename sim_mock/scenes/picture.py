"""How a simulated scene looks, for another process to draw: OpenCV is loaded where it is drawn."""

from typing import NamedTuple

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3, Vec3
from gazerig.sim_mock.scenes.scene import Scene


class ScenePicture(NamedTuple):
    """Draws one scene; can be sent to another process."""

    scene: Scene

    def draw(
        self, scene_s: float, lens: Intrinsics, size_px: tuple[int, int], R: Mat3, p_m: Vec3
    ) -> ImageArray:
        """Return what a camera sees, BGR.

        Args:
            scene_s: time since the scene began, seconds.
            lens: of the camera, for pictures of this size.
            size_px: width and height.
            R: rotation of the camera in the world, its axes optical.
            p_m: position of the camera in the world.
        """
        from gazerig.sim_mock.cameras.scene_picture import draw_picture

        return draw_picture(self.scene, scene_s, lens, size_px, R, p_m)
