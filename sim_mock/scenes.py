"""The scenes that a simulated robot can be put into."""

from sim_mock.boxing import Boxing
from sim_mock.face_to_face import FaceToFace
from sim_mock.scene import Scene
from sim_mock.sits_still import SitsStill
from sim_mock.steps_aside import StepsAside
from sim_mock.visitor import Visitor
from sim_mock.walks_past import WalksPast


def scenes() -> dict[str, Scene]:
    """Give the scenes by name."""
    every: tuple[Scene, ...] = (
        Visitor(),
        Boxing(),
        FaceToFace(),
        SitsStill(),
        StepsAside(),
        WalksPast(),
    )
    return {scene.name: scene for scene in every}
