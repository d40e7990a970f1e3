"""Where in the world the thing is that a command says to look at."""

from typing import NamedTuple

from gazerig.drivers.types import Detections
from gazerig.gaze.angles import add, direction, rotate, scale
from gazerig.gaze.types import Face, GazeState, Percept, Vec3
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import (
    Command,
    Look,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
)
from gazerig.robot.perception.pixel_to_world import PixelToWorld


class Known(NamedTuple):
    """What is known before the first tick; after that the newest tick stands in its place."""

    pose: GazeState | None = None
    detections: Detections | None = None
    percept: Percept | None = None


class LookPoints:
    """Finds what commands name.

    known: pose, detections and percept of the newest tick, by which commands are understood

    Args:
        pixels: places pixels in the world.
    """

    def __init__(self, pixels: PixelToWorld) -> None:
        self._pixels = pixels
        self.known: Known | Tick = Known()

    def resolved(self, command: Command) -> Command:
        """Return a command with the point of its pixel, as a recording needs it."""
        found = self.known.detections
        if not isinstance(command, LookAtPixel) or command.p_world_m is not None or found is None:
            return command
        point = self._pixels.point(
            command.pixel_px, found, self.known.percept, command.distance_m, command.captured_s
        )
        return command._replace(p_world_m=point)

    def point(self, command: Look) -> Vec3 | None:
        """Return the point of the world to look at; None: look freely.

        Raises:
            ValueError: it cannot be found now; the message says why.
        """
        pose = self.known.pose
        match command:
            case LookAt(p):
                return p
            case LookAtPixel():
                if command.p_world_m is None:
                    raise ValueError("there is no camera frame to look into yet")
                return command.p_world_m
            case LookAtInHead(p) if pose is not None:
                return add(pose.p_world_head_m, rotate(pose.R_world_head, p))
            case LookAtDirection(angles, frame, distance_m) if pose is not None:
                ahead = scale(direction(angles), distance_m)
                if frame == "head":
                    ahead = rotate(pose.R_world_head, ahead)
                return add(pose.p_world_head_m, ahead)
        raise ValueError("the head has not been measured yet")

    def face(self, command: LookAtPerson) -> tuple[Face, float]:
        """Return the face of a person and when it was seen.

        Raises:
            ValueError: no person of that id is seen; the message says who is.
        """
        percept = self.known.percept
        faces = percept.faces if percept is not None else ()
        for face in faces:
            if face.id == command.id and percept is not None:
                return face, percept.captured_s
        there = ", ".join(str(face.id) for face in faces)
        seen = f"there is {there}" if there else "no one is seen"
        raise ValueError(f"no person {command.id} is seen now; {seen}")
