"""Pictures of a MuJoCo world from any camera, without a display.

The camera is the program's own pinhole (gazerig.drivers.camera.pinhole), including the principal
point; gazerig.sim_mock.cameras.rendered adds the effects of the sensor.
"""

import weakref
from collections.abc import Callable, Collection
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import ImageArray
from gazerig.features.world.gl_context import open_context
from gazerig.gaze.angles import add, compose, rotate
from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.description.links import IDENTITY, ORIGIN
from gazerig.robot.model.scene import PinholeView

_NEAREST_M, _FARTHEST_M = 0.02, 60.0
_FONT = 100  # the smallest: no text is drawn
_ALL = 7  # static, dynamic and decorative things
_UNSEEN = 5  # a group of geoms that is not drawn
_SHADOWS_REACH_M = 1.5  # behind the camera


class RendererParams(NamedTuple):
    """Quality of the pictures, which costs time.

    shadow_px: side of the shadow map, 0: no shadows
    samples: samples per pixel against jagged edges, 0: one
    """

    shadow_px: int = 512
    samples: int = 4


DEFAULT_QUALITY = RendererParams()


class Renderer:
    """Renderer of pictures of one model and size.

    Raises:
        NoRenderer: nothing on this machine can render.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        width_px: int,
        height_px: int,
        params: RendererParams = DEFAULT_QUALITY,
        hidden: Collection[str] = (),
    ) -> None:
        self._model = model
        self._size = width_px, height_px
        model.vis.quality.shadowsize = params.shadow_px
        model.vis.quality.offsamples = params.samples
        model.vis.global_.offwidth, model.vis.global_.offheight = width_px, height_px

        def make() -> Any:
            made = mujoco.MjrContext(model, _FONT)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, made)
            return made

        self._context, self._mjr = open_context(make)
        self._mjr.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 64)
        self._option, self._free = mujoco.MjvOption(), mujoco.MjvCamera()
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = params.shadow_px > 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._groups = model.geom_group.copy()
        self._groups[_geoms_of(model, hidden)] = _UNSEEN
        self._shadows = params.shadow_px > 0
        self._finalizer = weakref.finalize(self, _free, self._context, self._mjr)

    def render(
        self, data: mujoco.MjData, lens: Intrinsics, R: ArrayLike, p_m: ArrayLike
    ) -> ImageArray:
        """Return the picture of a camera, without the lens's distortion.

        Args:
            data: the state; its positions must have been computed.
            lens: lens for pictures of this size.
            R: (3, 3) rotation of the camera in the world, its axes optical.
            p_m: (3,) position of the camera in the world.
        """
        width, height = self._size
        rect = mujoco.MjrRect(0, 0, width, height)
        rgb = np.empty((height, width, 3), np.uint8)
        turn, place = np.asarray(R, float), np.asarray(p_m, float)
        # Geoms completely outside the picture are hidden: MuJoCo would draw all their triangles.
        sides, model = _sides(lens, width, height), self._model
        camera = (data.geom_xpos - place) @ turn
        out = (camera @ sides.T > model.geom_rbound[:, None]).any(axis=1)
        if self._shadows:  # a geom outside the picture may cast a shadow into it
            out = camera[:, 2] < -_SHADOWS_REACH_M - model.geom_rbound
        out &= model.geom_rbound > 0.0  # a plane has no size
        model.geom_group[:] = np.where(out, _UNSEEN, self._groups)
        mujoco.mjv_updateScene(model, data, self._option, None, self._free, _ALL, self._scene)
        model.geom_group[:] = self._groups
        self._look(lens, turn, place, width, height)
        with self._context.as_current():
            mujoco.mjr_render(rect, self._scene, self._mjr)
            mujoco.mjr_readPixels(rgb, None, rect, self._mjr)
        return np.ascontiguousarray(rgb[::-1, :, ::-1])

    def close(self) -> None:
        """Free all resources; safe to call twice."""
        self._finalizer()

    def _look(
        self,
        lens: Intrinsics,
        R: Floats,
        p_m: Floats,
        width: int,
        height: int,
    ) -> None:
        """Move the scene's camera, and a light fixed to it, to the pose of the camera."""
        forward, up = R[:, 2], -R[:, 1]
        # Pixels have their centres at integers: the frame extends half a pixel further.
        left = (-0.5 - lens.cx_px) / lens.fx_px * _NEAREST_M
        right = (width - 0.5 - lens.cx_px) / lens.fx_px * _NEAREST_M
        for eye in self._scene.camera:
            eye.pos, eye.forward, eye.up = p_m, forward, up
            eye.frustum_center = 0.5 * (left + right)
            eye.frustum_width = 0.5 * (right - left)
            eye.frustum_top = (lens.cy_px + 0.5) / lens.fy_px * _NEAREST_M
            eye.frustum_bottom = (lens.cy_px + 0.5 - height) / lens.fy_px * _NEAREST_M
            eye.frustum_near, eye.frustum_far = _NEAREST_M, _FARTHEST_M
        for light in self._scene.lights[: self._scene.nlight]:
            if light.headlight:
                light.pos, light.dir = p_m, forward


def _sides(lens: Intrinsics, width: int, height: int) -> Floats:
    """Return the outward unit normals (5, 3) of the view's sides, in the camera's axes."""
    left, right = (-0.5 - lens.cx_px) / lens.fx_px, (width - 0.5 - lens.cx_px) / lens.fx_px
    top, bottom = ((row - 0.5 - lens.cy_px) / lens.fy_px for row in (0, height))
    out = np.array(
        [(-1.0, 0.0, left), (1.0, 0.0, -right), (0.0, -1.0, top), (0.0, 1.0, -bottom), (0, 0, -1.0)]
    )
    return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))


def _geoms_of(model: mujoco.MjModel, bodies: Collection[str]) -> NDArray[np.bool_]:
    """Return a mask (n,) of the geoms of bodies with these names and of their descendants."""
    hidden = np.zeros(model.nbody, bool)
    for name in bodies:
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if number < 0:
            raise ValueError(f"the world has no body {name!r} to be hidden")
        hidden[number] = True
    for number in range(1, model.nbody):  # parents come first
        hidden[number] |= hidden[model.body_parentid[number]]
    return np.asarray(hidden[model.geom_bodyid])


def _free(context: Any, mjr: Any) -> None:
    with context.as_current():
        mjr.free()
    context.free()


PlaceBodies = Callable[[mujoco.MjData, float], None]
"""Sets people and joints to their poses at a time of the world, seconds: qpos and mocap poses."""


class WorldPicture:
    """SceneView of a world: sets all poses for a time, and renders.

    The renderer is created with the first picture, in the process and thread that requests it.

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
        params: RendererParams = DEFAULT_QUALITY,
        hidden: Collection[str] = (),
        R_world_base: Mat3 = IDENTITY,
        p_world_base_m: Vec3 = ORIGIN,
    ) -> None:
        self._base = R_world_base, p_world_base_m
        self._model, self._place, self._hidden = model, place, hidden
        self._params = params
        self._data = mujoco.MjData(model)
        self._renderer: Renderer | None = None

    def draw(self, seen_by: PinholeView) -> ImageArray:
        """Return a picture, all of one size; see ``SceneView.draw``."""
        t_s, lens, size_px, R, p_m = seen_by
        self._place(self._data, t_s)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        if self._renderer is None:
            self._renderer = Renderer(self._model, *size_px, self._params, self._hidden)
        R_world_base, p_world_base_m = self._base
        R, p_m = compose(R_world_base, R), add(p_world_base_m, rotate(R_world_base, p_m))
        return self._renderer.render(self._data, lens, R, p_m)

    def close(self) -> None:
        """Free the renderer; safe to call twice."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
