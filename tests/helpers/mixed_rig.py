"""A rig of three kinds of bus: the maker's eyes on a neck of two smart servos."""

from pathlib import Path

from board_rig import on_pca9685

from gazerig.config.schema import Rig, load_rig

MAKER = Path(__file__).parents[2] / "config" / "rigs" / "maker.yaml"

# Its head is balanced, so that a limp neck stays where a hand has turned it.
NECK = """
mass: {head: {com_mm: [0, 0, 0]}}
buses:
  neck:
    port: /dev/ttyUSB0
    kind: dynamixel
  tilt:
    port: /dev/ttyACM1
    kind: feetech
"""
NECK_JOINTS = """
  neck_yaw: {id: 7, model: xc330-m288, bus: neck, min_deg: -60.0, max_deg: 60.0,
    max_speed_deg_s: 200.0, max_accel_deg_s2: 2000.0, gains: [2000, 0, 14000]}
  neck_pitch: {id: 1, model: sts3215, bus: tilt, min_deg: -25.0, max_deg: 25.0,
    max_speed_deg_s: 150.0, max_accel_deg_s2: 1500.0, gains: [32, 0, 64]}
"""


def mixed_text() -> str:
    """Write the maker's eyes on a neck of one Dynamixel and one Feetech servo."""
    text = MAKER.read_text(encoding="utf-8")
    text = text.replace("\njoints:", f"{NECK}\njoints:")
    return text.replace("\nlid_joints:", f"{NECK_JOINTS}\nlid_joints:")


def mixed_rig(folder: Path) -> Rig:
    """Load that rig from a file that is written into a folder."""
    path = folder / "mixed.yaml"
    path.write_text(mixed_text(), encoding="utf-8")
    return load_rig(str(path))


def rig_of(name: str, folder: Path) -> Rig:
    """Load a shipped rig, the mixed one, or the maker's on a PCA9685."""
    if name == "mixed":
        return mixed_rig(folder)
    return load_rig(on_pca9685(folder) if name == "pca9685" else name)
