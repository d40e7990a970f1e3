"""Whatever stands in a study's file by mistake is told with file and line, or it is right."""

from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from gazerig.config.faults import ConfigError
from gazerig.features.study.run.study_check import checked_study
from gazerig.features.study.shipped import HOME

WRONG: tuple[object, ...] = (
    *(
        None,
        0,
        -1,
        1e30,
        float("nan"),
        True,
        "",
        "a|b",
        "../x.yaml",
        "x.webm",
        ".mcap",
        "~",
        "wait",
    ),
    *("film", "head", "pairwise", "choice", "friedman", [], {}, [[]], {"a": {}}, ["rosas"]),
    *(
        {"gaze": 3},
        {"gaze.top_down.rules": {}},
        {"joints.neck_yaw": None},
        {"": 1},
        "x" * 300,
        "=",
        "gaze=x",
    ),
)
"""What may stand anywhere in a file by mistake."""
DESIGN = YAML(typ="safe").load((HOME / "studies" / "nakamoto_2.yaml").read_text("utf-8"))
PLACES = (
    *(("title",), ("task",), ("welcome",), ("conditions",), ("conditions", "simple"), ("plan",)),
    *(("translations",), ("translations", "de"), ("translations", "ja", "welcome")),
    *(("conditions", "random", key) for key in ("params", "recording", "film", "factors", "rig")),
    *(("conditions", "random", key) for key in ("profile", "scanpath", "behaviour", "label")),
    *(("presentation", key) for key in ("on", "rig", "scene", "world")),
    *(("trials", key) for key in ("seconds", "order", "repetitions")),
    *(("questionnaires",), ("after",), ("objective",), ("plan", "participants")),
    *(("hypotheses",), ("hypotheses", 0, "measure"), ("hypotheses", 1, "than")),
    ("hypotheses", 0, "better"),
    *(("hypotheses", 0, "test"), ("hypotheses", 0, "also"), ("privacy",), ("nonsense",)),
)


@given(st.lists(st.tuples(st.sampled_from(PLACES), st.sampled_from(WRONG)), min_size=1, max_size=3))
@settings(
    deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_whatever_stands_in_a_study_is_right_or_told_with_file_and_line(
    tmp_path: Path, changes: list[tuple[tuple[str | int, ...], object]]
) -> None:
    design = deepcopy(DESIGN)
    for (*over, last), value in changes:
        # Where an earlier change has taken the place away, there is nothing to spoil.
        with suppress(LookupError, TypeError):
            held: Any = design
            for step in over:
                held = held[step]
            held[last] = deepcopy(value)
    file = tmp_path / "s.yaml"
    with file.open("w", encoding="utf-8") as out:
        YAML(typ="safe").dump(design, out)
    try:
        assert len(checked_study(str(file)).sha256) == 64
    except ConfigError as error:
        assert all(fault.file == str(file) and fault.line for fault in error.faults)
