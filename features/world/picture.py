"""The view of a camera in a world, for gazerig.sim_mock.cameras in the rendering process."""

from collections.abc import Callable, Collection

import mujoco

from gazerig.features.world.renderer import Renderer, RendererParams
from gazerig.gaze.angles import add, compose, rotate
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import IDENTITY, ORIGIN
from gazerig.robot.model.scene_view import PinholeView, Rendered

PlaceBodies = Callable[[mujoco.MjData, float], None]
"""Sets people and joints to their poses at a time of the world, seconds: qpos and mocap poses."""


class WorldPicture:
    """A SceneView of a world: everything is set to its pose at a time, and rendered.

    The renderer is created with the first picture, in the process and thread that requests it, and
    created again for a larger picture.

    Args:
        model: the world.
        place: sets people and joints to their poses.
        params: content of the pictures.
        hidden: names of bodies that are not shown, with their descendants: the head that carries
            the camera.
        R_world_base: rotation, and
        p_world_base_m: position of the neck base, the frame of the camera's poses.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        place: PlaceBodies,
        params: RendererParams | None = None,
        hidden: Collection[str] = (),
        R_world_base: Mat3 = IDENTITY,
        p_world_base_m: Vec3 = ORIGIN,
    ) -> None:
        self._base = R_world_base, p_world_base_m
        self._model, self._place, self._hidden = model, place, hidden
        self._params = params or RendererParams()
        self._data = mujoco.MjData(model)
        self._renderer: Renderer | None = None
        self._size = 0, 0

    @property
    def backend(self) -> str:
        """Return the name of the rendering library, "" before the first picture."""
        return self._renderer.backend if self._renderer is not None else ""

    def draw(
        self, seen_by: PinholeView, *, depth: bool = False, rows: tuple[int, int] | None = None
    ) -> Rendered:
        """Return a picture; see ``SceneView.draw``.

        Raises:
            NoRenderer: nothing on this machine can render.
        """
        t_s, lens, size_px, R, p_m = seen_by
        self._place(self._data, t_s)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        renderer = self._fitting(*size_px)
        R_world_base, p_world_base_m = self._base
        R, p_m = compose(R_world_base, R), add(p_world_base_m, rotate(R_world_base, p_m))
        return renderer.render(self._data, lens, R, p_m, size_px, depth=depth, rows=rows)

    def close(self) -> None:
        """Free the renderer; safe to call twice."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer, self._size = None, (0, 0)

    def _fitting(self, width: int, height: int) -> Renderer:
        """Return a renderer for pictures of a size."""
        if self._renderer is None or width > self._size[0] or height > self._size[1]:
            wide, high = max(width, self._size[0]), max(height, self._size[1])
            self.close()
            self._renderer = Renderer(self._model, wide, high, self._params, self._hidden)
            self._size = wide, high
        return self._renderer
