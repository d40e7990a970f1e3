"""Range of moving things without depth: it stays at its assumed value, like the gaze."""

from collections.abc import Callable
from dataclasses import replace
from math import cos, degrees, pi, radians, sin, tan
from typing import NamedTuple

import numpy as np
from msgspec import structs
from numpy.typing import NDArray
from stand_in import StandIn

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import Camera, Detections, MovingBlob
from gazerig.gaze.angles import add, norm, scale, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.app.assemble import Assembly, Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.control.tick import cyclopean_direction
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import intrinsics_of_lens, project
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker

SIZE = 640, 400
FIELD_DEG = 69.0
LENS = intrinsics_of_view(radians(FIELD_DEG), *SIZE)
ASSUMED_M, ASSUMED_SD_M = 2.0, 1.0
NOISES_DEG = 1.0, 2.0, 3.0
PICTURE_S = 1.0 / 30.0
BEGIN_S = 1.0
NEAR_M = 0.5
FAR_OUT_DEG = 15.0

_RANGE = (0.95, 1.05)
WANTED = {
    **{
        f"{name}, directions off by {sd:g} deg: {which} range / assumed": _RANGE
        for name in ("still camera", "swinging camera")
        for sd in NOISES_DEG
        for which in ("least", "most")
    },
    "walkers: nearer than 0.5 m, % of things": (0.0, 0.0),
    "walkers: behind the camera, % of things": (0.0, 0.0),
    "walkers: vergence above 15 deg, % of ticks": (0.0, 1.0),
    "walkers: gaze outside the picture, % of ticks": (0.0, 2.0),
}


class _Neck(StandIn):
    """A head that turns about a point 10 cm behind and below its camera."""

    def head_pose(
        self, head_rad: tuple[float, float, float], base_rad: tuple[float, float] = (0.0, 0.0)
    ) -> tuple[Mat3, Vec3]:
        c, s = cos(head_rad[0]), sin(head_rad[0])
        return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), (0.1 * c, 0.1 * s, 0.1)


def still_thing(noise_deg: float, swings: bool, pictures: int, seed: int) -> NDArray[np.float64]:
    """Return the range over the assumed one, picture by picture, of a stationary thing.

    Args:
        noise_deg: standard deviation of its direction on each axis, cut off at the picture's edge.
        swings: the camera turns by 20 deg to both sides, and so moves by 7 cm.
        pictures: how many.
        seed: of the noise.
    """
    mount = CameraMount(CameraParams(position_mm=(0.0, 0.0, 0.0)))
    perception = Perception(mount, FIELD_DEG, Tracker())
    poses, rng, found = PoseHistory(_Neck()), np.random.default_rng(seed), []
    true = np.array([ASSUMED_M, 0.0, 0.1])
    for k in range(1, pictures + 1):
        t_s = k * PICTURE_S
        yaw = radians(20.0) * sin(2.0 * pi * 0.3 * t_s) if swings else 0.0
        poses.remember(t_s, (yaw, 0.0, 0.0))
        R, p = mount.pose(*poses.head_pose(t_s))
        x, y, z = np.array(R).T @ (true - p)
        off = np.clip(rng.normal(0.0, noise_deg, 2), -30.0, 30.0)
        ray = np.array([x / z + tan(radians(off[0])), y / z + tan(radians(off[1])), 1.0])
        p_camera = ASSUMED_M * ray / np.linalg.norm(ray)
        blob = MovingBlob(
            1, "thing", tuple(p_camera.tolist()), 0.05, depth_known=False,
            depth_sd_m=ASSUMED_SD_M, box_px=(0.0, 0.0, 20.0, 20.0),
        )  # fmt: skip
        percept = perception.see(Detections(t_s, k, *SIZE, blobs=(blob,)), poses)
        assert percept is not None and len(percept.bodies) == 1, "it was taken for several"
        believed = norm(sub(tuple(percept.bodies.p_world_m[0].tolist()), p))
        found.append(believed / ASSUMED_M)
    return np.array(found)


class Walkers:
    """A camera before which people walk to and fro, too far off for faces.

    Each is a patch whose middle wanders about in it, with the motion that flow would measure:
    some of them wrong by a third, and growth as noise.
    """

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._newest: Detections | None = None

    def open(self) -> None:
        """Open nothing."""

    def close(self) -> None:
        """Close nothing."""

    def events(self) -> tuple[str, ...]:
        """Return what happened: nothing."""
        return ()

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest picture; there are ten a second, as of a camera in a street."""
        number = int(10.0 * now_s + 1e-6)
        if number >= 1 and (self._newest is None or self._newest.number != number):
            blobs = [self._walker(k, 0.1 * number) for k in range(5)]
            self._newest = Detections(0.1 * number, number, *SIZE, blobs=tuple(blobs))
        return self._newest

    def _walker(self, k: int, t_s: float) -> MovingBlob:
        rng, pace = self._rng, 2.0 * pi * (0.03 + 0.011 * k)
        yaw, rate = radians(28.0) * sin(pace * t_s + k), radians(28.0) * pace * cos(pace * t_s + k)
        # A patch jumps by part of itself when another part of the person is what moves.
        jump = rng.normal(0.0, radians(3.0), 2)
        x, y = tan(yaw + jump[0]), tan(radians(2.0 * k - 4.0) + jump[1])
        loom, flow = rng.normal(0.0, 0.4), rate * (1.0 + rng.normal(0.0, 0.3))
        z = ASSUMED_M
        width, height = SIZE
        focal_px = 0.5 * width / tan(radians(0.5 * FIELD_DEG))
        left_px, top_px = 0.5 * width + focal_px * x - 10.0, 0.5 * height + focal_px * y - 30.0
        return MovingBlob(
            k + 1, "thing", (z * x, z * y, z), 0.15, loom_1_s=loom,
            v_camera_m_s=(z * flow - loom * z * x, -loom * z * y, -loom * z),
            depth_known=False, depth_sd_m=ASSUMED_SD_M, loom_sd_1_s=0.4,
            box_px=(left_px, top_px, 20.0, 60.0),
        )  # fmt: skip


class Believed(NamedTuple):
    """Estimates of things in a run, and its gaze."""

    ranges_m: NDArray[np.float64]
    ahead: NDArray[np.bool_]
    vergence_deg: NDArray[np.float64]
    inside: NDArray[np.bool_]

    def figures(self) -> dict[str, float]:
        """Return the shares that are wanted."""
        found = {
            "nearer than 0.5 m, % of things": 100.0 * (self.ranges_m < NEAR_M).mean(),
            "behind the camera, % of things": 100.0 * (~self.ahead).mean(),
            "vergence above 15 deg, % of ticks": 100.0 * (self.vergence_deg > FAR_OUT_DEG).mean(),
            "gaze outside the picture, % of ticks": 100.0 * (~self.inside).mean(),
            "things a picture": len(self.ranges_m) / max(1, len(self.inside)) * 10.0,
        }
        return {f"walkers: {key}": float(value) for key, value in found.items()}


def believed(seconds: float, seed: int = 0) -> Believed:
    """Run the whole robot before walkers, with a stationary camera."""
    rig = load_rig("desk")
    rig = replace(rig, loop=replace(rig.loop, rate_hz=100.0))
    camera = CameraParams(mount="base", position_mm=(78.0, 0.0, 190.0))
    options = RunOptions(mock=True, fast=True, seed=seed, scene="visitor")
    before: Callable[[Camera], Camera] = lambda own: Walkers(seed)  # noqa: E731
    made = assemble(replace(rig, camera=camera), options, Substitutes(camera=before))
    ticks: list[Tick] = []
    made.robot.start(made.clock)
    try:
        run(made.robot, made.clock, made.loop, lambda t: "end" if t >= seconds else None,
            lambda tick: ticks.append(structs.replace(tick, detections=None)))  # fmt: skip
    finally:
        made.robot.stop()
        made.close()
    return _believed(made, [tick for tick in ticks if tick.t_s >= BEGIN_S])


def _believed(made: Assembly, ticks: list[Tick]) -> Believed:
    straight = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    R, p = (np.array(one) for one in made.mount.pose(straight, (0.0, 0.0, 0.0)))
    lens = intrinsics_of_lens(None, radians(FIELD_DEG), *SIZE)
    seen = {tick.percept.captured_s: tick.percept.bodies for tick in ticks if tick.percept}
    things = [
        bodies.p_world_m[k]
        for bodies in seen.values()
        for k, kind in enumerate(bodies.kinds)
        if kind == "thing"
    ]
    rel = (np.reshape(things, (-1, 3)) - p) @ R
    gaze = np.array([_gaze_point(tick) for tick in ticks])
    in_camera = (gaze - p) @ R
    ahead = in_camera[:, 2] > 1e-3
    pixels = project(np.where(ahead[:, None], in_camera, (0.0, 0.0, 1.0)), lens)
    return Believed(
        np.linalg.norm(rel, axis=1),
        rel[:, 2] > 0.0,
        np.array([degrees(t.pose.eye_right_rad[0] - t.pose.eye_left_rad[0]) for t in ticks]),
        ahead & (pixels >= 0.0).all(axis=1) & (pixels <= np.array(SIZE) - 1.0).all(axis=1),
    )


def _eye(tick: Tick) -> Vec3:
    return scale(add(tick.pose.p_world_eye_left_m, tick.pose.p_world_eye_right_m), 0.5)


def _gaze_point(tick: Tick) -> Vec3:
    """Return the point of the measured gaze, at the distance of its target."""
    eye = _eye(tick)
    return add(eye, scale(cyclopean_direction(tick), norm(sub(tick.target.p_world_m, eye))))


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: longer, with more seeds."""
    figures = {}
    for name, swings in (("still camera", False), ("swinging camera", True)):
        for noise in NOISES_DEG:
            runs = [still_thing(noise, swings, 300, seed) for seed in range(5 if full else 1)]
            ratios = np.concatenate(runs)
            for which, value in (("least", ratios.min()), ("most", ratios.max())):
                figures[f"{name}, directions off by {noise:g} deg: {which} range / assumed"] = value
    figures |= believed(60.0 if full else 20.0).figures()
    return figures
