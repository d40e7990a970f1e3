"""Values, points and commands of gazerig ctl as they are typed, without a rig."""

import pytest

from gazerig.drivers.errors import SetupError
from gazerig.robot.cli.ctl import read_look, read_pairs, read_value
from gazerig.robot.model.commands import LookAt, LookAtPerson


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1), ("1e3", 1000.0), ("true", True), ("null", None),
        ("markov", "markov"), ("'1'", "1"), ("[1, 2.5]", (1, 2.5)), ("2026-01-31", "2026-01-31"),
    ],
)  # fmt: skip
def test_values_are_read_as_in_the_file(text, value):
    read = read_value("key", text)
    assert read == value and type(read) is type(value)


def test_pairs_and_points():
    assert read_pairs(["a", "1", "b", "x"]) == {"a": 1, "b": "x"}
    assert read_look(["1", "-0.5", "2e-1"]) == LookAt((1.0, -0.5, 0.2), stay=True)
    assert read_look(["free"]) == LookAt(None)
    assert read_look(["person", "3"]) == LookAtPerson(3, stay=True)
    for words in (["1", "2"], ["person", "1.5"], ["person"], ["pixel", "1"], ["free", "1"]):
        with pytest.raises(SetupError, match="give X Y Z in metres"):
            read_look(words)
    with pytest.raises(SetupError, match="a: duplicate key"):
        read_value("a", "{b: 1, b: 2}")
