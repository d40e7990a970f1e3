"""Packages of others, written into a folder as pip installs them: modules and a .dist-info."""

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from textwrap import dedent

from gazerig.drivers import plugins
from gazerig.drivers.bus import servo_models

OURS = frozenset(servo_models.SERVOS)


def install(
    folder: Path,
    package: str,
    parts: Mapping[str, Mapping[str, str]],
    modules: Mapping[str, str],
    version: str = "1.2",
) -> None:
    """Write a package into a folder of the path.

    parts: group -> name -> "module:attribute"; modules: name -> source
    """
    for name, source in modules.items():
        file = folder / f"{name.replace('.', '/')}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(dedent(source), encoding="utf-8")
    info = folder / f"{package.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n")
    groups = [
        "\n".join([f"[{group}]", *(f"{name} = {value}" for name, value in named.items())])
        for group, named in parts.items()
    ]
    (info / "entry_points.txt").write_text("\n\n".join(groups) + "\n")


@contextmanager
def on_path(folder: Path) -> Iterator[Path]:
    """Put a folder on the path; its modules are forgotten after."""
    before = set(sys.modules)
    sys.path.insert(0, str(folder))
    try:
        yield folder
    finally:
        sys.path.remove(str(folder))
        _forget()
        for name in set(sys.modules) - before:
            file = getattr(sys.modules[name], "__file__", None)
            if file is not None and Path(file).is_relative_to(folder):
                del sys.modules[name]


def _forget() -> None:
    """Forget what was loaded: another test has other packages of the same names."""
    plugins._load_cached.cache_clear()
    plugins._package_parts.cache_clear()
    for name in set(servo_models.SERVOS) - OURS:
        del servo_models.SERVOS[name]
