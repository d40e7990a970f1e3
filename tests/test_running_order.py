"""Long test files come early, each between short ones, and none is lost or torn apart."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from running_order import spread
from shared_compiling import order_of


def item(file: str, *marks: str) -> Any:
    named = [SimpleNamespace(name=mark) for mark in marks]
    return SimpleNamespace(location=(file, 1, "test"), iter_markers=lambda: named)


def order(*items: Any) -> str:
    return "".join(one.location[0] for one in spread(items))


def test_every_other_file_is_a_long_one_until_there_are_none() -> None:
    assert order(item("a"), item("b"), item("c"), item("d", "pty"), item("e", "slow")) == "daebc"


def test_a_file_with_one_long_test_is_long_and_stays_together() -> None:
    assert order(item("a"), item("a"), item("b"), item("b", "browser"), item("b")) == "bbbaa"


def test_other_marks_and_no_tests_change_nothing() -> None:
    assert order(item("a"), item("b", "parametrize"), item("c")) == "abc"
    assert order() == ""


def test_workers_compile_the_same_files_in_orders_of_their_own() -> None:
    files = [Path(f"test_{n}.py") for n in range(40)]
    first, second = (order_of(worker, reversed(files)) for worker in ("gw0", "gw1"))
    assert sorted(first) == sorted(second) == sorted(files)
    assert first != second and first == order_of("gw0", files)
