"""Worlds of a user that are too large or hold no numbers: refused before MuJoCo reads them."""

import struct
from pathlib import Path
from typing import Any

import pytest

from gazerig.drivers.errors import SetupError


@pytest.fixture(autouse=True)
def not_loaded(mujoco: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing may be given to MuJoCo."""
    monkeypatch.setattr(mujoco, "MjSpec", None)


def refused(path: Path) -> str:
    from gazerig.features.world.model import world_model

    with pytest.raises(SetupError) as error:
        world_model(None, [], path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)
    return str(error.value)


def world(folder: Path, inside: str) -> Path:
    path = folder / "own.xml"
    path.write_text(f"<mujoco>{inside}</mujoco>", encoding="utf-8")
    return path


REPEATED = "<replicate count='200'><replicate count='200'><geom/></replicate></replicate>"


@pytest.mark.parametrize(
    ("inside", "rule"),
    [
        (
            "<asset><hfield name='hill' nrow='36000' ncol='36000'/></asset>",
            "hfield 'hill': has 36,000 x 36,000 points: at most 4,000,000 in all",
        ),
        (
            "<asset><texture name='wall' builtin='flat' width='1e5' height='1e5'/></asset>",
            "texture 'wall': has 100,000 x 100,000 pixels: at most 32,000,000 in all",
        ),
        ("<size memory='5G'/>", "size: memory='5G': at most 1,073,741,824"),
        ("<option gravity='0 0 nan'/>", "option: gravity='0 0 nan' is not a number"),
        ("<option gravity='0 0 -1e9'/>", "within +-100 m/s2, as in '0 0 -9.81'"),
        ("<worldbody><geom name='a' pos='0 nan 0'/></worldbody>", "geom 'a': pos='0 nan 0' is not"),
        (f"<worldbody>{REPEATED}</worldbody>", "more than 10,000 elements"),
        ("<broken>", "MuJoCo cannot read this world: mismatched tag"),
    ],
)
def test_what_is_too_large_is_refused_by_what_the_file_says(
    tmp_path: Path, inside: str, rule: str
) -> None:
    assert rule in refused(world(tmp_path, inside))


@pytest.mark.parametrize("folder", ["", "heights"])
def test_a_file_of_5_gb_is_refused_by_its_size(tmp_path: Path, folder: str) -> None:
    (tmp_path / folder).mkdir(exist_ok=True)
    with (tmp_path / folder / "hill.bin").open("wb") as file:
        file.write(struct.pack("<ii", 36_000, 36_000))
        file.truncate(5_184_000_008)  # takes no room on the disk
    compiler = f"<compiler meshdir='{folder}'/>" if folder else ""
    own = world(tmp_path, f"{compiler}<asset><hfield name='hill' file='hill.bin'/></asset>")
    assert "hill.bin has 5,184 MB: at most 200 MB" in refused(own)


def test_a_picture_is_refused_by_its_header(tmp_path: Path) -> None:
    png = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 60_000, 60_000)
    (tmp_path / "wall.png").write_bytes(png)
    own = world(tmp_path, "<asset><texture type='2d' name='wall' file='wall.png'/></asset>")
    assert "wall.png has 60,000 x 60,000 pixels: at most 32,000,000" in refused(own)
