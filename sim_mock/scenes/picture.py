"""How a simulated scene looks, for another process to draw: OpenCV is loaded where it is drawn."""

from dataclasses import dataclass

from gazerig.robot.model.scene_view import PinholeView, Rendered, SceneView
from gazerig.sim_mock.scenes.scene import Scene


@dataclass(frozen=True)
class ScenePicture(SceneView):
    """Draws one scene, plainly: for runs whose camera gives no images. It knows no distances."""

    scene: Scene

    def draw(
        self, seen_by: PinholeView, *, depth: bool = False, rows: tuple[int, int] | None = None
    ) -> Rendered:
        """Return what a camera sees; see ``SceneView.draw``."""
        from gazerig.sim_mock.cameras.scene_picture import draw_picture

        return Rendered(draw_picture(self.scene, seen_by)[slice(*(rows or (None,)))], None)

    def close(self) -> None:
        """Do nothing: there is nothing to free."""
