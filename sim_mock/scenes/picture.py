"""How a simulated scene looks, for another process to draw: OpenCV is loaded where it is drawn."""

from dataclasses import dataclass

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.draw_picture import DrawPicture
from gazerig.sim_mock.scenes.scene import Scene


@dataclass(frozen=True)
class ScenePicture(DrawPicture):
    """Draws one scene, plainly: for runs whose camera gives no images."""

    scene: Scene

    def draw(
        self, scene_s: float, lens: Intrinsics, size_px: tuple[int, int], R: Mat3, p_m: Vec3
    ) -> ImageArray:
        """Return what a camera sees; see ``DrawPicture.draw``."""
        from gazerig.sim_mock.cameras.scene_picture import draw_picture

        return draw_picture(self.scene, scene_s, lens, size_px, R, p_m)
