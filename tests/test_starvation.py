"""A test of a client with its own time-outs is tried again if the machine starved it."""

import pytest
import starvation

TRIED: list[int] = []


@pytest.fixture(scope="module")
def busy():
    """Let processes seem to wait for a second between any two looks."""
    true, looks = starvation.waited_s, [starvation.waited_s()]

    def waited_s() -> float:
        looks.append(looks[-1] + 1.0)
        return looks[-1]

    starvation.waited_s = waited_s
    yield
    starvation.waited_s = true


@pytest.mark.own_timeouts
def test_a_starved_test_is_tried_again_from_its_fixtures_on(busy, tmp_path):
    (tmp_path / "left").touch(exist_ok=False)
    TRIED.append(len(TRIED))
    assert len(TRIED) == 3


def test_it_was_tried_until_it_passed(busy):
    assert TRIED == [0, 1, 2]


def test_who_was_not_starved_is_not_tried_again(monkeypatch):
    attempts = starvation.Attempts()
    monkeypatch.setattr(starvation, "waited_s", lambda: 7.0)
    attempts.begin()
    assert not attempts.again()


def test_a_fault_is_told_however_busy_the_machine(busy):
    attempts, tries = starvation.Attempts(), 0
    attempts.begin()
    while attempts.again():
        tries += 1
        attempts.begin()
    assert tries == starvation.ATTEMPTS - 1
