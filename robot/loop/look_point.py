"""World position of the target in a look command."""

from typing import NamedTuple

from msgspec import structs

from gazerig.drivers.types import Detections
from gazerig.gaze.angles import add, direction, rotate, scale
from gazerig.gaze.types import Face, GazeState, Percept, Vec3
from gazerig.params import unknown_text
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import (
    Command,
    Look,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPixel,
)
from gazerig.robot.perception.pixel_to_world import PixelToWorld


class LastObservation(NamedTuple):
    """Placeholder observations before the first tick, which replaces them."""

    pose: GazeState | None = None
    detections: Detections | None = None
    percept: Percept | None = None


class LookPoints:
    """A finder of the points and faces in commands.

    Attributes:
        newest: Pose, detections and percept of the newest tick, which commands refer to.

    Args:
        pixels: Converts pixels to points in the world.
    """

    def __init__(self, pixels: PixelToWorld) -> None:
        self._pixels = pixels
        self.newest: LastObservation | Tick = LastObservation()
        self._known: set[int] = set()

    def see(self, tick: Tick) -> None:
        """Take the newest tick."""
        self.newest = tick
        if tick.percept is not None:
            self._known.update(face.id for face in tick.percept.faces)

    def refuse_unknown(self, person: int) -> None:
        """Refuse the number of a person who was never seen; one may be out of view.

        Raises:
            ValueError: No person has had that id; the message lists the visible people.
        """
        if person not in self._known:
            self.face(person)

    def resolve_pixel(self, command: Command) -> Command:
        """Return a command with the world point of its pixel, which a recording needs."""
        found = self.newest.detections
        if not isinstance(command, LookAtPixel) or command.p_world_m is not None or found is None:
            return command
        point = self._pixels.point(
            command.pixel_px, found, self.newest.percept, command.distance_m, command.captured_s
        )
        return structs.replace(command, p_world_m=point)

    def point(self, command: Look) -> Vec3 | None:
        """Return the point in the world to look at, None to free the gaze.

        Raises:
            ValueError: The point cannot be found now; the message gives the reason.
        """
        pose = self.newest.pose
        match command:
            case LookAt(p):
                return p
            case LookAtPixel():
                if command.p_world_m is None:
                    raise ValueError("there is no camera frame yet")
                return command.p_world_m
            case LookAtInHead(p) if pose is not None:
                return add(pose.p_world_head_m, rotate(pose.R_world_head, p))
            case LookAtDirection(angles, frame, distance_m) if pose is not None:
                ahead = scale(direction(angles), distance_m)
                if frame == "head":
                    ahead = rotate(pose.R_world_head, ahead)
                return add(pose.p_world_head_m, ahead)
        raise ValueError("the head has not been measured yet")

    def face(self, id: int) -> tuple[Face, float]:
        """Return the face of a person and the time of its frame.

        Raises:
            ValueError: No visible person has that id; the message lists the visible people.
        """
        percept = self.newest.percept
        faces = percept.faces if percept is not None else ()
        for face in faces:
            if face.id == id and percept is not None:
                return face, percept.captured_s
        visible = [str(face.id) for face in faces]
        raise ValueError(unknown_text("visible person", str(id), visible, "nobody"))
