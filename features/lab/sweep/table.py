"""The table of a sweep, as CSV and Parquet: a row for each run, by points and then by seeds."""

import csv
import importlib.util
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gazerig.drivers.files.file_output import output_file, write_file
from gazerig.features.lab.sweep.outcome import Outcome, columns_of

SEED, FAILED = "seed", "failed"
CSV, PARQUET = "table.csv", "table.parquet"


def rows_of(outcomes: Sequence[Outcome]) -> tuple[list[str], list[list[Any]]]:
    """Return the columns (parameters, seed, failure, figures) and one row for each run."""
    keys = list({key: None for one in outcomes for key in one.point})
    figures = columns_of(outcomes)
    rows = [
        [
            *(_cell(one.point.get(key)) for key in keys),
            one.seed,
            one.failed,
            *(one.figures.get(name) for name in figures),
        ]
        for one in outcomes
    ]
    return [*keys, SEED, FAILED, *figures], rows


def write_tables(folder: Path, outcomes: Sequence[Outcome]) -> tuple[Path, ...]:
    """Write ``CSV`` and, if PyArrow is installed, ``PARQUET``; return the files.

    Raises:
        SetupError: one cannot be written.
    """
    columns, rows = rows_of(outcomes)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    write_file(folder / CSV, text.getvalue(), force=True)
    if importlib.util.find_spec("pyarrow") is None:
        return (folder / CSV,)
    _write_parquet(folder / PARQUET, columns, rows)
    return folder / CSV, folder / PARQUET


def _write_parquet(path: Path, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    import pyarrow
    import pyarrow.parquet

    arrays = [_column([row[i] for row in rows]) for i in range(len(columns))]
    with output_file(path, force=True) as file:
        pyarrow.parquet.write_table(pyarrow.table(dict(zip(columns, arrays, strict=True))), file)


def _column(values: list[Any]) -> list[Any]:
    """Return the values of a column as one type: numbers, or text for mixed types."""
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    if len(kinds) > 1:
        return [None if value is None else str(value) for value in values]
    return values


def _cell(value: object) -> object:
    """Return a parameter's value as one cell: lists as JSON."""
    return json.dumps(value) if isinstance(value, list | tuple | dict) else value
