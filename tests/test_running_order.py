"""Costly test files come early, each between others, and none is lost or torn apart."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from features_there import needs_all_features
from running_order import COSTS_S, leave_out, spread
from shared_compiling import order_of


def item(file: str, *marks: str) -> Any:
    named = [SimpleNamespace(name=mark) for mark in marks]
    return SimpleNamespace(nodeid=f"{file}::test", iter_markers=lambda: named)


def order(*items: Any) -> str:
    return "".join(one.nodeid[0] for one in spread(items))


def test_files_that_wait_costly_ones_and_others_take_turns() -> None:
    given = [item("a"), item("b"), item("c"), item("d", "pty"), item("e", "slow"), item("f", "pty")]
    assert order(*given) == "deafbc"


def test_the_costliest_come_first() -> None:
    files = [f"tests/test_{name}.py" for name in reversed(COSTS_S)]
    found = [one.nodeid.partition("::")[0] for one in spread([item(file) for file in files])]
    costs = [COSTS_S[file[11:-3]] for file in found]
    assert costs == sorted(COSTS_S.values(), reverse=True)


@needs_all_features
def test_every_file_with_a_cost_is_there() -> None:
    there = {path.stem.removeprefix("test_") for path in Path(__file__).parent.rglob("test_*.py")}
    assert [name for name in COSTS_S if name not in there] == []


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


def test_a_test_that_ended_its_worker_is_not_run_again_but_the_others_of_its_file_are() -> None:
    files = {"a": {"a::1": True, "a::2": False, "a::3": False}, "b": {"b::1": False}}
    leave_out("a::2", files)
    assert files == {"a": {"a::1": True, "a::2": True, "a::3": False}, "b": {"b::1": False}}
