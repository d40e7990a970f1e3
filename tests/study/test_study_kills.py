"""A killed study's program loses no confirmed answer."""

from pathlib import Path

import pytest
from study_kills import killed


@pytest.mark.slow
def test_what_was_said_to_be_kept_is_there_after_kills(tmp_path: Path) -> None:
    found = killed(tmp_path, 3, longest_s=0.5)
    assert found.kills == 3 and found.kept > 0
    assert found.lost == found.twice == 0
