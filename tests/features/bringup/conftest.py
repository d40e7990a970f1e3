"""Rigs of one's own and no port of this computer, for tests of bring-up."""

from pathlib import Path

import pytest
from served_rigs import hide_real_ports, rig_files


@pytest.fixture
def no_real_ports(monkeypatch) -> None:
    hide_real_ports(monkeypatch)


@pytest.fixture
def rigs(tmp_path) -> dict[str, str]:
    """Return the paths of rigs of one's own: desk, feetech, maker, pca9685, mixed."""
    return rig_files(tmp_path)


@pytest.fixture
def rig(rigs: dict[str, str]) -> Path:
    """Return a desk rig of one's own."""
    return Path(rigs["desk"])
