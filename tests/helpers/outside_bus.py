"""The example package of a servo bus, installed as pip would into a folder of the path."""

import tomllib
from pathlib import Path

from outside_package import install

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "gazerig-lx16a"
HEAD = EXAMPLE / "head.yaml"


def install_example(folder: Path) -> None:
    """Write the entry points of its pyproject.toml into a folder, and link its code there."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    folder.mkdir(exist_ok=True)
    install(folder, project["name"], project["entry-points"], {}, project["version"])
    (folder / "gazerig_lx16a").symlink_to(EXAMPLE / "gazerig_lx16a")
