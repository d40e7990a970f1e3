"""Layers of the page's scene around the rig: desired pose, camera, field of the eyes."""

import viser

from gazerig.robot.dashboard.feed.live_feed import OverlayChoices
from gazerig.robot.dashboard.view.commanded_pose import CommandedPoseView
from gazerig.robot.dashboard.view.lid_edges import LidEdges
from gazerig.robot.dashboard.view.view_frusta import CameraField, EyeFields
from gazerig.robot.model.types import Snapshot


class OverlayPanel:
    """Layers of the scene."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._commanded_pose = CommandedPoseView(scene)
        self._camera = CameraField(scene)
        self._eyes = EyeFields(scene)

    def show(self, snapshot: Snapshot, layers: OverlayChoices, edges: LidEdges) -> None:
        """Draw the selected layers and remove the others.

        Args:
            snapshot: of the rig.
            layers: what is wanted.
            edges: of the rig's lids.
        """
        self._commanded_pose.show(snapshot if layers.ghost else None, edges)
        self._camera.show(snapshot if layers.camera else None)
        self._eyes.show(snapshot if layers.eyes else None)
