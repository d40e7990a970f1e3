"""What rows of seeing look at: drawn and rendered material with truth, and real films and photos.

Real ones lie beside the project, where there are any; none of them is needed.
"""

from pathlib import Path

MEDIA = Path(__file__).parents[3] / "shared" / "media"
MODELS = Path(__file__).parents[3] / "shared" / "models"


def at_hand(name: str, folder: Path = MEDIA) -> Path | None:
    """Return a film, photo or model by its file's name, None where it is not there."""
    file = folder / name
    return file if file.is_file() else None
