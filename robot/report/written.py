"""The files of a report: one page that needs no other file, PNGs beside it, numbers as JSON."""

import json
from collections.abc import Sequence
from pathlib import Path

from drivers.errors import SetupError
from robot.report.page import Picture


def write_all(
    out: Path, page: str, pictures: Sequence[Picture], numbers: Sequence[dict[str, object]]
) -> tuple[tuple[Path, ...], Path]:
    """Write page, pictures and numbers; give the pictures' paths and that of the numbers.

    Raises:
        drivers.errors.SetupError: something cannot be written.
    """
    folder, data = out.with_name(f"{out.stem}_figures"), out.with_suffix(".json")
    paths = tuple(folder / f"{picture.drawing.key}.png" for picture in pictures)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, picture in zip(paths, pictures, strict=True):
            path.write_bytes(picture.png)
        data.write_text(json.dumps(list(numbers), indent=1) + "\n", encoding="utf-8")
        out.write_text(page, encoding="utf-8")
    except OSError as error:
        where = error.filename or out
        raise SetupError(f"{where}: {error.strerror or error}; give another file") from None
    return paths, data
