"""What a camera in a world sees: a view for gazerig.sim_mock.cameras, in the process that draws."""

from collections.abc import Callable, Collection

import mujoco

from gazerig.features.world.renderer import Renderer, RendererParams
from gazerig.gaze.angles import add, compose, rotate
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import IDENTITY, ORIGIN
from gazerig.robot.model.scene_view import PinholeView, Rendered

PlaceBodies = Callable[[mujoco.MjData, float], None]
"""Puts people and joints where they are at a time of the world, seconds: qpos and mocap poses."""


class WorldPicture:
    """A SceneView of a world: everything is put where it is at a time, and rendered.

    The renderer is made with the first picture, in the process and thread that wants it, and made
    anew where a larger one is wanted.

    Args:
        model: the world.
        place: puts people and joints where they are.
        params: what the pictures show.
        hidden: names of bodies that are not shown, with all that hangs on them: the head that
            carries the camera.
        R_world_base: with
        p_world_base_m: where the neck base stands from which the camera's places are given.
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
        """Return what renders, "" before the first picture."""
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
        """Return a renderer that can make pictures of a size."""
        if self._renderer is None or width > self._size[0] or height > self._size[1]:
            wide, high = max(width, self._size[0]), max(height, self._size[1])
            self.close()
            self._renderer = Renderer(self._model, wide, high, self._params, self._hidden)
            self._size = wide, high
        return self._renderer
