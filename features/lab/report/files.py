"""The files of a report: one self-contained page, its PNGs, and its numbers as JSON."""

import json
from collections.abc import Collection, Sequence
from pathlib import Path

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, refuse_existing, write_file
from gazerig.features.lab.report.page import Figure


def numbers_file(out: Path) -> Path:
    """Return the file of a page's numbers; its name differs from that of a run's own summary."""
    return out.with_name(f"{out.stem}_measures.json")


_PAGE_MARK = b'name="generator" content="gazerig"'
_MARKS = {".json": b'[\n {\n  "key": ', ".png": b"Matplotlib"}
"""Text near the beginning of the files of reports and comparisons."""

_HEAD_BYTES = 4096


def files_of(out: Path, figures: Collection[str]) -> tuple[Path, ...]:
    """Return the page, its numbers, and its figures by their keys."""
    folder = out.with_name(f"{out.stem}_figures")
    return (out, numbers_file(out), *(folder / f"{key}.png" for key in figures))


def refuse_foreign(paths: Collection[Path], force: bool = False) -> None:
    """Refuse existing files; with ``force`` only those that are no report's.

    Raises:
        SetupError: something already exists or cannot be written.
    """
    refuse_existing(*paths, force=force)
    for path in paths:
        if path.is_file() and not _is_own_file(path):
            raise SetupError(
                f"{path} was not made by gazerig report or compare, and is kept even with --force: "
                "name another file, or remove it"
            )


def _is_own_file(path: Path) -> bool:
    """Return whether a file looks like those of this module; an empty one counts too."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise SetupError(f"cannot read {path} ({error.strerror}): name another file") from error
    return not head or _MARKS.get(path.suffix, _PAGE_MARK) in head


def write_all(
    out: Path,
    page: str,
    figures: Sequence[Figure],
    numbers: Sequence[dict[str, object]],
    force: bool = False,
) -> tuple[tuple[Path, ...], Path]:
    """Write page, figures and numbers; return the figures' paths and that of the numbers.

    force: replace files of an earlier report

    Raises:
        SetupError: something already exists or cannot be written.
    """
    _, data, *paths = files = files_of(out, [figure.drawing.key for figure in figures])
    refuse_foreign(files, force)
    make_folder(out.with_name(f"{out.stem}_figures"))
    for path, figure in zip(paths, figures, strict=True):
        write_file(path, figure.png, force)
    write_file(data, json.dumps(list(numbers), indent=1) + "\n", force)
    write_file(out, page, force)
    return tuple(paths), data
