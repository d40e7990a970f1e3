"""A world's people and its other heads, in the frame of one of its heads."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gazerig.gaze.angles import add, compose, rotate, rotate_back, rotation, sub, yaw_pitch
from gazerig.gaze.types import Mat3, Vec3
from gazerig.sim_mock.scenes.scene import Event, Scene, ScenePerson, Thing


class RigFrame(NamedTuple):
    """Pose of a rig's neck base in the world; everything in the robot is in this frame."""

    R: Mat3
    p_m: Vec3

    def point(self, p_world_m: Vec3) -> Vec3:
        """Return a point of the world in the frame of the rig."""
        return rotate_back(self.R, sub(p_world_m, self.p_m))

    def way(self, v_world: Vec3) -> Vec3:
        """Return a direction of the world in the frame of the rig."""
        return rotate_back(self.R, v_world)

    def in_world(self, R: Mat3, p_m: Vec3) -> tuple[Mat3, Vec3]:
        """Return a pose in the rig's frame as a pose in the world."""
        return compose(self.R, R), add(self.p_m, rotate(self.R, p_m))


class HeadFace(NamedTuple):
    """The face of a head now, in the world: rotation of the head, tip of the nose."""

    R: Mat3
    nose_m: Vec3


class HeadsScene:
    """A scene in the world's frame and the faces of other heads, in the frame of one rig.

    The events of a scene state expectations of the first head only.

    Args:
        scene: the people of the script.
        frame: of the rig that looks.
        faces: each returns the face of another head now.
        first: whether this is the first head.
    """

    def __init__(
        self, scene: Scene, frame: RigFrame, faces: Sequence[Callable[[], HeadFace]], first: bool
    ) -> None:
        self._scene, self._frame, self._faces, self._first = scene, frame, tuple(faces), first
        self.name, self.round_s = scene.name, scene.round_s
        self.behaviours = scene.behaviours

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the people, and after them the other heads as they are now."""
        own = self._frame
        found = []
        for person in self._scene.people(t_s):
            yaw, pitch = person.face_yaw_pitch_rad
            ahead = rotate(rotation((yaw, pitch, 0.0)), (1.0, 0.0, 0.0))
            hand = None if person.hand is None else own.point(person.hand)
            found.append(
                ScenePerson(own.point(person.p_world_face_m), yaw_pitch(own.way(ahead)), hand)
            )
        for face in self._faces:
            R, nose_m = face()
            ahead = rotate(R, (1.0, 0.0, 0.0))
            found.append(ScenePerson(own.point(nose_m), yaw_pitch(own.way(ahead)), None))
        return tuple(found)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return what else can be looked at."""
        things = self._scene.things(t_s)
        return tuple(one._replace(p_world_m=self._frame.point(one.p_world_m)) for one in things)

    def events(self) -> tuple[Event, ...]:
        """Return the events before the first head; nothing is expected of the other heads."""
        return self._scene.events() if self._first else ()
