"""What can be drawn into the page's scene beside the rig: desired pose, camera, eyes' field."""

from dataclasses import dataclass
from typing import ClassVar

import viser

from gazerig.robot.dashboard.commanded_pose import CommandedPoseView
from gazerig.robot.dashboard.view_frusta import CameraField, EyeFields
from gazerig.robot.model.types import Snapshot


@dataclass
class OverlayChoices:
    """Which of them are wanted; changed by the users of the page."""

    ghost: bool = False
    sight: bool = False
    camera: bool = False
    eyes: bool = False
    parts: bool = False

    NAMES: ClassVar[dict[str, str]] = {
        "ghost": "ghost of the desired pose",
        "sight": "lines of sight",
        "camera": "what the camera covers",
        "eyes": "what the eyes can attend to",
        "parts": "the eight parts of a face",
    }


class OverlayPanel:
    """The layers in the scene."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._commanded_pose = CommandedPoseView(scene)
        self._camera = CameraField(scene)
        self._eyes = EyeFields(scene)

    def show(self, snapshot: Snapshot, layers: OverlayChoices) -> None:
        """Draw what is wanted and take the rest away."""
        self._commanded_pose.show(snapshot if layers.ghost else None)
        self._camera.show(snapshot if layers.camera else None)
        self._eyes.show(snapshot if layers.eyes else None)
