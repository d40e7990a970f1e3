"""Limits of a user's MJCF file, checked before MuJoCo reads it.

MuJoCo allocates whatever a file requests while it parses: a height field of 36,000 x 36,000 points
takes 5 GB, and a gravity of NaN makes every state NaN.
"""

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from math import isfinite, isnan, prod
from pathlib import Path
from typing import NoReturn

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import open_regular, read_limited

MOST_XML_BYTES = 20_000_000
MOST_ASSET_BYTES = 200_000_000
"""Size of a mesh, a picture or a height field in its own file."""
MOST_CELLS = 4_000_000
"""Points of a height field."""
MOST_PIXELS = 32_000_000
"""Size of a texture."""
MOST_ELEMENTS = 10_000
"""Elements of the file, with every repetition counted."""
MOST_FILES = 100
"""Number of included files."""
MOST_GRAVITY_M_S2 = 100.0
MOST_ARENA_BYTES = 1 << 30
MOST_SIZES = {"nconmax": 100_000, "njmax": 500_000, "nuserdata": 1_000_000, "nkey": 1000,
              "nstack": 100_000_000}  # fmt: skip
"""Limits of the attributes of ``size`` that reserve memory; others beginning with "nuser": 1000."""

_UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40, "P": 1 << 50, "E": 1 << 60}
_FOLDERS = ("assetdir", "meshdir", "texturedir")
_REPEATED = ("replicate", "composite", "flexcomp")
_PNG = b"\x89PNG\r\n\x1a\n"


def refuse_excessive(path: Path) -> None:
    """Check that a world can be loaded in reasonable time and memory.

    Raises:
        SetupError: the file is absent or not XML, or one of its values exceeds its limit; the
            message names the file, the element and the permitted value.
    """
    waiting, seen, elements = [path], set[Path](), 0
    while waiting:
        file = waiting.pop()
        if file in seen:
            continue
        seen.add(file)
        if len(seen) > MOST_FILES:
            raise SetupError(f"{path}: includes more than {MOST_FILES} files; join some")
        try:
            root = ElementTree.fromstring(read_limited(file, MOST_XML_BYTES))
        except OSError as error:
            raise SetupError(f"{file}: cannot be read: {error.strerror}") from None
        except (ElementTree.ParseError, ValueError, LookupError) as error:
            raise SetupError(f"{file}: MuJoCo cannot read this world: {error}") from None
        folders = {one.get(key, "") for one in root.iter("compiler") for key in _FOLDERS}
        for element, times in _repeated(root):
            elements += times
            if elements > MOST_ELEMENTS:
                rule = f"more than {MOST_ELEMENTS:,} elements, repeated ones counted as often"
                raise SetupError(f"{path}: {rule}: leave some out")
            _check(file, element)
            # The files that an element names, in all folders that MuJoCo searches.
            for name in (value for key, value in element.items() if key.startswith("file")):
                places = (file.parent / within / name for within in {"", *folders})
                asset = next((place for place in places if place.exists()), None)
                if asset is not None and element.tag in ("include", "model"):
                    waiting.append(asset)
                elif asset is not None:
                    _check_asset(file, element, asset)


def _repeated(
    element: ElementTree.Element, times: int = 1
) -> Iterator[tuple[ElementTree.Element, int]]:
    """Yield all elements below one, with the number of repetitions."""
    inside = times
    if element.tag in _REPEATED:
        inside *= max(1, prod(int(n) for n in _numbers(element.get("count", "")) if isfinite(n)))
    yield element, times if element.tag == "replicate" else inside
    for child in element:
        yield from _repeated(child, inside)


def _check(file: Path, element: ElementTree.Element) -> None:
    for name, value in element.items():
        if name not in ("name", "class") and any(isnan(number) for number in _numbers(value)):
            _refuse(file, element, f"{name}={value!r} is not a number; give a finite one")
    if element.tag == "option" and (gravity := element.get("gravity")) is not None:
        numbers = _numbers(gravity)
        if len(numbers) != 3 or not all(abs(g) <= MOST_GRAVITY_M_S2 for g in numbers):
            rule = f"is three numbers within +-{MOST_GRAVITY_M_S2:g} m/s2, as in '0 0 -9.81'"
            _refuse(file, element, f"gravity={gravity!r}: it {rule}")
    if element.tag == "hfield":
        _check_product(file, element, ("nrow", "ncol"), MOST_CELLS, "points")
    elif element.tag == "texture":
        _check_product(file, element, ("width", "height"), MOST_PIXELS, "pixels")
    elif element.tag == "size":
        for name, value in element.items():
            limit = MOST_SIZES.get(name, 1000 if name.startswith("nuser_") else None)
            limit = MOST_ARENA_BYTES if name == "memory" else limit
            if limit is not None and _count(value) > limit:
                _refuse(file, element, f"{name}={value!r}: at most {limit:,}")


def _check_product(
    file: Path, element: ElementTree.Element, names: tuple[str, str], most: int, what: str
) -> None:
    across, down = (_count(element.get(name, "0")) for name in names)
    if across * down > most:
        _refuse(file, element, f"has {across:,.0f} x {down:,.0f} {what}: at most {most:,} in all")


def _check_asset(file: Path, element: ElementTree.Element, asset: Path) -> None:
    """Check the size of a file and, for a picture, its header."""
    try:
        with open_regular(asset) as opened:
            size, head = os.fstat(opened.fileno()).st_size, opened.read(24)
    except OSError as error:
        _refuse(file, element, f"{asset}: {error.strerror}")
    if size > MOST_ASSET_BYTES:
        limit = f"at most {MOST_ASSET_BYTES / 1e6:g} MB"
        _refuse(file, element, f"{asset} has {size / 1e6:,.0f} MB: {limit}")
    if head.startswith(_PNG):
        across, down = (int.from_bytes(head[at : at + 4], "big") for at in (16, 20))
        most = MOST_CELLS if element.tag == "hfield" else MOST_PIXELS
        if across * down > most:
            _refuse(file, element, f"{asset} has {across:,} x {down:,} pixels: at most {most:,}")


def _numbers(text: str) -> list[float]:
    """Return the numbers of an attribute, none if it contains anything else."""
    try:
        return [float(word) for word in text.split()]
    except ValueError:
        return []


def _count(text: str) -> float:
    """Return a number of bytes or elements, with the units of MuJoCo."""
    text = text.strip()
    unit = _UNITS.get(text[-1:].upper(), 1)
    numbers = _numbers(text[:-1] if unit > 1 else text)
    return unit * numbers[0] if numbers else 0.0


def _refuse(file: Path, element: ElementTree.Element, rule: str) -> NoReturn:
    name = f" {element.get('name')!r}" if element.get("name") else ""
    raise SetupError(f"{file}: {element.tag}{name}: {rule}")
