"""What a websocket sends besides states and events: rig, run and pictures."""

from collections.abc import Mapping
from typing import NamedTuple

from msgspec import Struct

from gazerig.robot.model.types import LoopFigures

Pixel = tuple[float, float]


class JointInfo(Struct, frozen=True):
    """Limits of a joint and of its servo.

    Attributes:
        low_rad, high_rad: Range.
        warm_c, hot_c: Temperatures at which the guard slows the joint down and stops it.
        low_v, high_v: Voltages outside which the guard slows the joint down, None without a limit.
        heavy_load: Share of the stall torque that is allowed continuously.
    """

    low_rad: float
    high_rad: float
    warm_c: float
    hot_c: float
    low_v: float
    high_v: float | None
    heavy_load: float


class RigInfo(Struct, frozen=True):
    """A running rig, apart from its state.

    Attributes:
        name: Name of the rig.
        path: File that save writes, "" without one.
        emulated: Whether its servos are emulated.
        opponent: Whether a boxing world has an opponent that a person can move.
        detector: Detector of faces and people, and what it lacks; "" if none runs.
        choice: Settings chosen for this computer, in one line; "" if nothing was measured.
        joints: Limits of the joints by name.
    """

    name: str
    path: str
    emulated: bool
    opponent: bool
    detector: str
    choice: str
    joints: Mapping[str, JointInfo]


class RunState(Struct, frozen=True):
    """State of a run that changes seldom.

    Attributes:
        behaviour, conversation, character, expression: The present ones, "" without any.
        health: State of the bus as text.
        version: Number of changes of the parameters.
        timing: Timing of the loop, None if unknown.
        busy: Text if the computer is too busy, otherwise "".
        scene_start_s: Start of a simulated scene, None before it and without one.
        perception: Age of the frame, conditions of the camera, distances and their sources.
        unanswered: Ticks without an answer of a joint's servo since the page's start.
    """

    behaviour: str = ""
    conversation: str = ""
    character: str = ""
    expression: str = ""
    health: str = ""
    version: int = 0
    timing: LoopFigures | None = None
    busy: str = ""
    scene_start_s: float | None = None
    perception: str = ""
    unanswered: Mapping[str, int] = {}


class SeenFace(Struct, frozen=True):
    """A face in a picture: x, y, width, height; the five landmarks of the detector."""

    box_px: tuple[float, float, float, float]
    landmarks_px: tuple[Pixel, ...]
    confidence: float


class SeenPerson(Struct, frozen=True):
    """A person in a picture, from the head to the hips."""

    box_px: tuple[float, float, float, float]
    head_px: Pixel
    confidence: float


class SeenThing(Struct, frozen=True):
    """A moving thing or a hand in a picture."""

    kind: str
    centre_px: Pixel
    radius_px: float


class Picture(Struct, frozen=True):
    """A picture of the camera; its JPEG follows. All pixels are those of the full frame.

    Attributes:
        number: Number of the frame.
        captured_s: Time of its exposure, as ``HeadState.t_s``.
        width_px, height_px: Size of the full frame; the JPEG may be smaller.
        gaze_px: Gaze point at the exposure, None if it is behind the camera.
        faces, people, things: What was detected.
        conditions: Conditions that impair the picture, each with its remedy.
    """

    number: int
    captured_s: float
    width_px: int
    height_px: int
    gaze_px: Pixel | None
    faces: tuple[SeenFace, ...]
    people: tuple[SeenPerson, ...]
    things: tuple[SeenThing, ...]
    conditions: tuple[str, ...] = ()


class ShownPicture(NamedTuple):
    """A picture with its JPEG."""

    picture: Picture
    jpeg: bytes


class PanelContent(Struct, frozen=True):
    """Content of a package's panel: HTML without scripts."""

    title: str
    html: str
