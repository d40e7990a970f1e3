"""Reading of an animation file by its kind."""

from pathlib import Path

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.features.animation import bottango, gltf_reader, servo_positions, table
from gazerig.features.animation.animation import LARGEST, ImportedAnimation, JointMap


def read_animation(
    path: Path,
    rig: Rig,
    names: JointMap,
    *,
    fps: float | None = None,
    clip: str = "",
    centre_deg: float | None = None,
) -> ImportedAnimation:
    """Return the animation of a file, by its kind.

    Args:
        path: path of the file.
        rig: rig that it moves.
        names: joints by the names in the file.
        fps: frames per second, for tables with frame numbers.
        clip: name of the animation, for files with several.
        centre_deg: position straight ahead, for servo positions in degrees; None for the servo's
            own unit.

    Raises:
        SetupError: the file cannot be read or has no motion for this rig.
    """
    try:
        data = read_limited(path, LARGEST)
    except OSError as error:
        raise SetupError(f"{path} cannot be read: {error.strerror}") from None
    if data[:4] == b"glTF":
        found = gltf_reader.read(path, data, rig, names, clip)
    elif path.suffix.lower() in (".glb", ".gltf", ".fbx", ".bvh", ".blend"):
        raise SetupError(
            f"{path} is no GLB: export glTF as .glb, the JSON of Bottango or of Blender's add-on "
            "Servo Animation, or CSV"
        )
    elif data.lstrip()[:1] == b"[":
        found = bottango.read(path, data, rig, names, clip)
    elif data.lstrip()[:1] == b"{":
        found = servo_positions.read(path, data, rig, names, centre_deg)
    else:
        series = table.read_table(path, data, fps, names)
        found = ImportedAnimation(series, (), poses=False)
    if not found.series:
        raise SetupError(
            f"{path} moves no joint of {rig.name}: {'; '.join(found.notes) or 'no keys'}: {names.hint()}"
        )
    return found
