"""The maker's eyes on a PCA9685: the shipped file with one section changed."""

from pathlib import Path

from gazerig.config.load import shipped_path

SECTION = """bus:
  port: /dev/i2c-1
  kind: pca9685  # mine
  pca9685: {address: 0x40, oscillator_hz: 25000000}

"""


def on_pca9685(folder: Path | str, section: str = SECTION) -> str:
    """Write the file into a folder; return its path."""
    text = shipped_path("rigs", "maker").read_text(encoding="utf-8")
    start, end = text.index("bus:  #"), text.index("geometry:")
    path = Path(folder) / "maker-pca9685.yaml"
    path.write_text(text[:start] + section + text[end:], encoding="utf-8")
    return str(path)
