"""Layers of the scene and the camera image that users can select."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass
class OverlayChoices:
    """Selected layers; users of the page change them."""

    gaze: bool = True
    faces: bool = False
    heat: bool = False
    ghost: bool = False
    sight: bool = False
    camera: bool = False
    eyes: bool = False
    parts: bool = False

    NAMES: ClassVar[dict[str, str]] = {
        "gaze": "picture: where the head looks",
        "faces": "picture: faces and what moves, as found",
        "heat": "picture: where the head has looked",
        "ghost": "ghost of the desired pose",
        "sight": "lines of sight",
        "camera": "what the camera covers",
        "eyes": "what the eyes can attend to",
        "parts": "the eight parts of a face",
    }
