"""Registry of the simulated scenes."""

from gazerig.sim_mock.scenes.boxing import Boxing
from gazerig.sim_mock.scenes.face_to_face import FaceToFace
from gazerig.sim_mock.scenes.scene import Scene
from gazerig.sim_mock.scenes.sits_still import SitsStill
from gazerig.sim_mock.scenes.steps_aside import StepsAside
from gazerig.sim_mock.scenes.three_people import ThreePeople
from gazerig.sim_mock.scenes.two_people import TwoPeople
from gazerig.sim_mock.scenes.visitor import Visitor
from gazerig.sim_mock.scenes.walks_past import WalksPast


def scenes() -> dict[str, Scene]:
    """Return the scenes by name."""
    every: tuple[Scene, ...] = (
        Visitor(),
        Boxing(),
        FaceToFace(),
        SitsStill(),
        StepsAside(),
        ThreePeople(),
        TwoPeople(),
        WalksPast(),
    )
    return {scene.name: scene for scene in every}
