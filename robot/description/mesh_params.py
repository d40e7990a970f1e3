"""Parameters of a mesh of the user's own."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds
from gazerig.robot.model.weight import PositionMm

_Degrees = Annotated[float, Bounds(-180, 180)]


@dataclass(frozen=True)
class MeshParams:
    """A mesh file that is shown as one link of the rig."""

    # fmt: off
    file: Annotated[str, "path of an STL, OBJ, PLY, OFF, GLB or glTF file, relative to this file"]
    metres_per_unit: Annotated[float, Bounds(1e-6, 1000), "length of one unit of the file; 0.001: it is in millimetres"] = 0.001
    position_mm: Annotated[PositionMm,
        "where the file's origin is in the link: ahead, left and above"] = (0.0, 0.0, 0.0)
    rotation_deg: Annotated[tuple[_Degrees, _Degrees, _Degrees],
        "how the file is turned in the link: to the left, up, right side down"] = (0.0, 0.0, 0.0)
    # fmt: on
