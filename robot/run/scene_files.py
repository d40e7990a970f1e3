"""Files of simulated scenes, by a shipped name or by a user's path."""

from functools import lru_cache
from pathlib import Path

from gazerig.config.load import find_file, load
from gazerig.config.shipped_files import is_path, shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.sim_mock.scenes.faces_scene import FacesScene, faults
from gazerig.sim_mock.scenes.script import SceneScript

KIND = "scenes"
"""Folder of the shipped scenes."""


def scene_names() -> tuple[str, ...]:
    """Return the names of the shipped scenes."""
    return shipped_names(KIND)


def load_scene(name_or_path: str, seed: int = 0) -> FacesScene:
    """Return a simulated scene.

    Args:
        name_or_path: name of a shipped scene, or path of a script.
        seed: Seed of acts with a random time.

    Raises:
        gazerig.config.load.ConfigError: the file has faults.
        SetupError: the name is unknown.
    """
    if not is_path(name_or_path) and name_or_path not in scene_names():
        raise SetupError(
            f"--scene {name_or_path}: unknown; scenes: {', '.join(scene_names())}; "
            "or give the path of a script (.yaml)"
        )
    script = _read(*script_file(KIND, name_or_path))
    return FacesScene(Path(name_or_path).stem, script, seed)


def script_file(
    kind: str, name_or_path: str, home: Path | None = None
) -> tuple[Path, tuple[int, int, int] | None]:
    """Return the path of a script, and the version of its content, None if it cannot be read.

    Raises:
        gazerig.config.load.ConfigError: no shipped script has this name.
    """
    path = find_file(kind, name_or_path, home)
    try:
        facts = path.stat()
    except OSError:
        return path, None
    return path, (facts.st_ino, facts.st_mtime_ns, facts.st_size)


@lru_cache(maxsize=8)
def _read(path: Path, version: tuple[int, int, int] | None) -> SceneScript:
    """Read a script, with a cache, as a run requests it several times."""
    return load(path, SceneScript, checks=(faults,))
