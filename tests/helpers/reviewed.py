"""Rows of numbers that were reviewed once, in tests/golden; another processor may round otherwise.

With REVIEW=1 in the environment a test writes its rows anew instead: read the difference.
"""

import json
import os
from collections.abc import Sequence
from pathlib import Path

import pytest

GOLDEN = Path(__file__).parents[1] / "golden"


def assert_reviewed(name: str, rows: Sequence[Sequence[float]]) -> None:
    """Compare rows with those of a file, to a fiftieth of a number or of one."""
    file = GOLDEN / f"{name}.json"
    if os.environ.get("REVIEW"):
        lines = ",\n".join(json.dumps([round(float(x), 4) for x in row]) for row in rows)
        file.write_text(f"[\n{lines}\n]\n")
    for now, kept in zip(rows, json.loads(file.read_text()), strict=True):
        assert now == pytest.approx(kept, rel=0.02, abs=0.02)
