"""A drawn scene before a stationary camera: real flow, true faces, and the truth of hands.

Faces come from the truth (with the noise of a detector), since their detection is not tested
here and costs most.
"""

from collections.abc import Iterator
from math import degrees, radians
from typing import NamedTuple

import numpy as np
from fakes.scenes import EmptyScene

from gazerig.config.schema import load_rig
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.gaze.angles import angle_between, rotation, sub
from gazerig.gaze.types import Angles2, Angles3, Mat3, Percept, Vec3
from gazerig.robot.model.frames import CameraMount, PoseHistory
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.perception import Perception
from gazerig.robot.run.cameras import SyntheticMotion
from gazerig.sim_mock.cameras.detections import SceneCamera
from gazerig.sim_mock.cameras.drawn_scene import DrawnScene
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.cameras.rendered import PixelCamera
from gazerig.sim_mock.scenes.faces_scene import HEAD_M
from gazerig.sim_mock.scenes.scene import Scene, ScenePerson, Thing

_HZ = 30.0


class _Standing:
    """A neck that does not turn."""

    def head_pose(self, head_rad: Angles3, base_rad: Angles2 = (0.0, 0.0)) -> tuple[Mat3, Vec3]:
        """Return the pose of the head."""
        return rotation(head_rad), HEAD_M


class _Later(EmptyScene):
    """A scene that begins at another time."""

    def __init__(self, scene: Scene, start_s: float) -> None:
        self._scene, self._start_s = scene, start_s
        self.name, self.round_s, self.behaviours = scene.name, scene.round_s, scene.behaviours

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the people."""
        return self._scene.people(t_s + self._start_s)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the things."""
        return self._scene.things(t_s + self._start_s)


class _TrueFaces:
    """A detector with given faces."""

    found: tuple[DetectedFace, ...] = ()

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return them."""
        return self.found


class Frame(NamedTuple):
    """Content of one frame; hands: their true positions."""

    t_s: float
    percept: Percept
    people: tuple[ScenePerson, ...]
    hands: tuple[Vec3, ...]

    def seen(self, kind: str) -> list[tuple[int, Vec3]]:
        """Return id and place of the bodies of a kind."""
        bodies = self.percept.bodies
        rows = zip(bodies.ids, bodies.kinds, bodies.p_world_m.tolist(), strict=True)
        return [(id, (p[0], p[1], p[2])) for id, one, p in rows if one == kind]


def frames(scene: Scene, start_s: float, end_s: float) -> Iterator[Frame]:
    """Yield what perception makes of the frames of a part of a scene.

    Args:
        scene: what is drawn.
        start_s: from the scene's beginning.
        end_s: likewise.
    """
    rig, later = load_rig("desk"), _Later(scene, start_s)
    mount, rng = CameraMount(rig.camera), np.random.default_rng(0)
    faces = _TrueFaces()

    def still(_: float) -> tuple[Mat3, Vec3]:
        return rotation((0.0, 0.0, 0.0)), HEAD_M

    truth = SceneCamera(FrameParams(latency_ms=0.0), later, mount, still, rng)
    truth.open()
    field = rig.camera.horizontal_field_deg
    drawn = FrameParams(latency_ms=0.0, horizontal_field_deg=field)
    locate = FrameLocator(None, radians(field))
    motion = SyntheticMotion(rig.motion)
    camera = PixelCamera(drawn, DrawnScene(later), mount, still, faces, rng, motion, locate)
    perception = Perception(mount, field)
    poses = PoseHistory(_Standing())  # type: ignore[arg-type]
    poses.remember(0.0, (0.0, 0.0, 0.0))
    for number in range(round(_HZ * (end_s - start_s))):
        t_s = number / _HZ + 1e-6
        found = truth.latest(t_s)
        faces.found = found.faces if found is not None else ()
        percept = perception.see(camera.latest(t_s), poses)
        assert percept is not None
        people, things = later.people(t_s), later.things(t_s)
        hands = [person.hand for person in people if person.hand is not None]
        hands += [thing.p_world_m for thing in things if thing.kind == "hand"]
        yield Frame(start_s + t_s, percept, people, tuple(hands))


def off_deg(a: Vec3, b: Vec3) -> float:
    """Return the angle between two places as seen from the head."""
    return degrees(angle_between(sub(a, HEAD_M), sub(b, HEAD_M)))
