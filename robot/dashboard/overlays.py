"""What can be drawn into the page's scene beside the rig: desired pose, camera, eyes' field."""

import viser

from gazerig.robot.dashboard.commanded_pose import CommandedPoseView
from gazerig.robot.dashboard.overlay_choices import OverlayChoices
from gazerig.robot.dashboard.view_frusta import CameraField, EyeFields
from gazerig.robot.model.types import Snapshot


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
