"""Rigs whose emulated buses are served on pseudo-terminals, like real ports."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from board_rig import on_pca9685
from mixed_rig import mixed_text

from gazerig.config.load import shipped_path
from gazerig.config.schema import load_rig
from gazerig.robot.run.emulated import emulated_lines
from gazerig.sim_mock.pty.client import PtyBuses


class Served(NamedTuple):
    """What --port wants, the ports by bus, and what lets things happen on a bus."""

    ports: str
    paths: dict[str, str]
    command: Callable[..., str]


@contextlib.contextmanager
def served(rig: str) -> Iterator[Served]:
    """Serve the buses of a rig."""
    with PtyBuses() as buses:
        paths = dict(buses.start(emulated_lines(load_rig(rig))))
        given = ",".join(f"{name}={path}" if name else path for name, path in paths.items())
        yield Served(given, paths, buses.command)


def rig_files(folder: Path) -> dict[str, str]:
    """Write rigs of one's own; give their paths: desk, feetech, maker, pca9685, mixed."""
    names = ("desk", "feetech", "maker")
    texts = {name: shipped_path("rigs", name).read_text("utf-8") for name in names}
    texts["mixed"] = mixed_text()
    paths = {"pca9685": on_pca9685(folder)}
    for name, text in texts.items():
        paths[name] = str(folder / f"{name}.yaml")
        Path(paths[name]).write_text(text, encoding="utf-8")
    return paths


def hide_real_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let bring-up see none of this computer's ports."""
    for name in ("ports", "scan"):
        module = pytest.importorskip(f"gazerig.features.bringup.cli.{name}")
        monkeypatch.setattr(module, "serial_ports", lambda: ())
