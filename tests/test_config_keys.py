"""A rig has few keys: each is set by a shipped file, has a paper or an effect that people see."""

from collections.abc import Iterator

from gazerig.config.load import shipped_path
from gazerig.config.schema import Rig
from gazerig.params import Declaration, declarations

MOST_KEYS = 209  # to become 160
MOST_LINES = 300


def leaves(declared: Declaration, key: str) -> Iterator[str]:
    """Yield every key that holds a value; a star stands for a name that the user chooses."""
    inner = declared.inner
    if declared.params is not None:
        for name, field in declarations(declared.params).items():
            yield from leaves(field, f"{key}.{name}" if key else name)
    elif inner is not None and (declared.form == "mapping" or inner.params is not None):
        yield from leaves(inner, f"{key}.*")
    else:
        yield key


def test_a_rig_has_at_most_so_many_keys() -> None:
    keys = list(leaves(Declaration("params", params=Rig), ""))
    assert len(set(keys)) == len(keys) and "buses.*.port" in keys
    assert len(keys) <= MOST_KEYS


def test_the_desk_rig_is_short() -> None:
    text = shipped_path("rigs", "desk").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MOST_LINES
