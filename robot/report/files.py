"""The files of a report: one page that needs no other file, PNGs beside it, numbers as JSON."""

import json
from collections.abc import Sequence
from pathlib import Path

from gazerig.drivers.file_output import make_folder, refuse_existing, write_file
from gazerig.robot.report.page import Figure


def numbers_file(out: Path) -> Path:
    """Return where the numbers of a page go: never the name that a run's own summary has."""
    return out.with_name(f"{out.stem}_measures.json")


def write_all(
    out: Path,
    page: str,
    figures: Sequence[Figure],
    numbers: Sequence[dict[str, object]],
    force: bool = False,
) -> tuple[tuple[Path, ...], Path]:
    """Write page, figures and numbers; give the figures' paths and that of the numbers.

    force: replace files that are there

    Raises:
        SetupError: something already exists or cannot be written.
    """
    folder, data = out.with_name(f"{out.stem}_figures"), numbers_file(out)
    paths = tuple(folder / f"{figure.drawing.key}.png" for figure in figures)
    refuse_existing(*paths, data, out, force=force)
    make_folder(folder)
    for path, figure in zip(paths, figures, strict=True):
        write_file(path, figure.png, force)
    write_file(data, json.dumps(list(numbers), indent=1) + "\n", force)
    write_file(out, page, force)
    return paths, data
