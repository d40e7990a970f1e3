"""A picture of a simulated scene, drawn in another process: only that one loads OpenCV."""

from dataclasses import dataclass

from gazerig.robot.model.scene_view import PinholeView, Rendered, SceneView
from gazerig.sim_mock.scenes.scene import Scene


@dataclass(frozen=True)
class ScenePicture(SceneView):
    """Draws one scene plainly, without distances, for runs whose camera returns no images."""

    scene: Scene

    def draw(
        self, seen_by: PinholeView, *, depth: bool = False, rows: tuple[int, int] | None = None
    ) -> Rendered:
        """Return a camera's view; see ``SceneView.draw``."""
        from gazerig.sim_mock.cameras.scene_picture import draw_picture

        return Rendered(draw_picture(self.scene, seen_by)[slice(*(rows or (None,)))], None)

    def close(self) -> None:
        """Do nothing: there is nothing to free."""
