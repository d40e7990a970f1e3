"""The scenes that a simulated robot can be put into."""

from sim_mock.boxing import Boxing
from sim_mock.face_to_face import FaceToFace
from sim_mock.scene import Scene
from sim_mock.visitor import Visitor


def scenes() -> dict[str, Scene]:
    """Give the scenes by name."""
    every: tuple[Scene, ...] = (Visitor(), Boxing(), FaceToFace())
    return {scene.name: scene for scene in every}
