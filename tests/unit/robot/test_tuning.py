"""Tuning: values set, saved, reverted and read again while a rig runs."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from fakes.runs import simulated

from gazerig.config.load import ConfigError
from gazerig.config.parameters import values
from gazerig.config.save import RigLayers
from gazerig.config.schema import load_rig
from gazerig.robot.model.commands import Command, Tune
from gazerig.robot.run.live import ParamStore

pytestmark = pytest.mark.usefixtures("ideal_servos")

DESK = Path("config/rigs/desk.yaml")
NOW = datetime(2026, 1, 31, 23, 59, 59)


class Bench:
    """A running rig's tuning, and what was ordered."""

    def __init__(self, name: str, character: str | None = None, **chosen: Any) -> None:
        rig = load_rig(name, character)
        self.made = simulated(rig, **chosen)
        self.orders: list[Command] = []
        layers = RigLayers(name, character, None)
        self.tuning = ParamStore(self.made.rig, self.take, layers, now=lambda: NOW)

    def take(self, order: Command) -> None:
        self.orders.append(order)
        assert isinstance(order, Tune)
        self.said = self.made._tune(order, 0.0)


@pytest.fixture
def mine(tmp_path) -> Path:
    path = tmp_path / "mine.yaml"
    path.write_text(DESK.read_text(encoding="utf-8"), encoding="utf-8")
    return path


def test_one_wrong_value_refuses_all_with_every_rule():
    bench = Bench("desk")
    with pytest.raises(ConfigError) as refused:
        bench.tuning.set(
            {
                "gaze.lids.close_ms": 9e9,
                "gaze.lids.open_ms": 100.0,
                "guard.soft_start_speed_deg_s": -1.0,
            }
        )
    assert len(refused.value.faults) == 2 and not bench.orders
    assert bench.tuning.get()["gaze.lids.open_ms"] == 175.0
    with pytest.raises(ConfigError, match="No such file"):
        bench.tuning.set({"gaze.scanpath.transition_matrix": "absent.yaml"})
    assert not bench.orders and bench.tuning.version == 0


@pytest.mark.parametrize("text", ["loop:\n  rate_hz: fast\n", "name: [\n", "", None])
def test_a_file_spoilt_by_hand_is_not_touched(mine, text):
    bench = Bench(str(mine))
    bench.tuning.set({"gaze.lids.close_ms": 90.0})
    before = mine.read_text(encoding="utf-8")
    mine.write_text(text, encoding="utf-8") if text is not None else mine.unlink()
    with pytest.raises(ConfigError, match="mine.yaml"):
        bench.tuning.save()
    assert not mine.exists() if text is None else mine.read_text(encoding="utf-8") == text
    mine.write_text(before, encoding="utf-8")
    bench.tuning.save()
    assert load_rig(str(mine)).gaze.lids.close_ms == 90.0 and bench.tuning.unsaved() == ()


def test_a_good_edit_that_nobody_has_heard_of_is_in_force_when_saved(mine):
    bench = Bench(str(mine))
    bench.tuning.set({"gaze.lids.close_ms": 90.0})
    text = mine.read_text(encoding="utf-8")
    mine.write_text(text.replace("rate_hz: 200.0", "rate_hz: 100.0"), encoding="utf-8")
    bench.tuning.save()
    rig = load_rig(str(mine))
    assert (rig.loop.rate_hz, rig.gaze.lids.close_ms) == (100.0, 90.0)
    assert rig.gaze == bench.made.rig.gaze and bench.made.loop.rate_hz == 200.0


def test_a_shipped_rig_asks_for_a_path_and_goes_on_from_it(tmp_path):
    bench = Bench("desk")
    bench.tuning.set({"gaze.lids.close_ms": 90.0})
    with pytest.raises(ConfigError, match="is part of the program"):
        bench.tuning.save()
    with pytest.raises(ConfigError, match=r"not end in \.yaml"):
        bench.tuning.save(tmp_path / "my")
    copy = tmp_path / "my.yaml"
    bench.tuning.save(copy)
    assert load_rig(str(copy)).gaze.lids.close_ms == 90.0
    assert bench.tuning.path == copy and bench.tuning.unsaved() == ()
    bench.tuning.set({"gaze.lids.close_ms": 95.0})
    bench.tuning.save()
    assert load_rig(str(copy)).gaze.lids.close_ms == 95.0


def test_characters_are_switched_and_what_is_unsaved_stays_over_them():
    bench = Bench("desk", "shy")
    assert bench.tuning.characters()[0] == "shy" and "none" in bench.tuning.characters()
    bench.tuning.set({"gaze.lids.close_ms": 90.0})
    bench.tuning.set({"character": "sleepy"})
    want = load_rig("desk", "sleepy").gaze
    got = bench.made.rig.gaze
    assert got.head == want.head and got.top_down == want.top_down
    assert got.lids.close_ms == 90.0 and got.lids.open_ms == want.lids.open_ms
    assert bench.tuning.character == "sleepy"
    bench.tuning.revert()
    assert bench.made.rig == replace(load_rig("desk", "shy"), character="shy")
    assert bench.tuning.character == "shy" and bench.tuning.unsaved() == ()
    bench.tuning.set({"character": "none"})
    assert bench.made.rig == load_rig("desk")
    with pytest.raises(ConfigError, match="nothing named 'slepy'"):
        bench.tuning.set({"character": "slepy"})
    assert bench.tuning.character == "none"


@pytest.mark.parametrize("copied", [False, True])
def test_a_character_is_saved_by_its_name_and_of_the_values_only_those_set_by_hand(
    mine, tmp_path, copied
):
    bench = Bench(str(mine))
    bench.tuning.set({"character": "bold"})
    bench.tuning.set({"gaze.lids.close_ms": 90.0, "character": "shy"})
    assert [str(change) for change in bench.tuning.unsaved()] == [
        "character: null -> shy",
        "gaze.lids.close_ms: 75.0 -> 90.0",
    ]
    saved = bench.tuning.save(tmp_path / "copy.yaml" if copied else None)
    assert {change.key for change in saved.changes} == {"character", "gaze.lids.close_ms"}
    again, by_hand = Bench(str(saved.path)), {"gaze.lids.close_ms": 90.0, "character": "shy"}
    assert again.tuning.character == bench.tuning.character == "shy"
    assert again.tuning.unsaved() == bench.tuning.unsaved() == ()
    assert again.tuning.get() == bench.tuning.get()
    assert values(load_rig("desk", "shy")) | by_hand == bench.tuning.get()
    assert values(load_rig(str(saved.path), "none")) == values(load_rig("desk")) | by_hand
    again.tuning.set({"character": "none"})
    again.tuning.save()
    assert values(load_rig(str(saved.path))) == values(load_rig("desk")) | {
        "gaze.lids.close_ms": 90.0
    }


def test_options_of_the_command_line_stay_and_are_never_saved(mine):
    bench = Bench(str(mine), scanpath="random")
    assert bench.tuning.unsaved() == ()
    bench.tuning.set({"character": "bold"})
    assert bench.made.rig.gaze.scanpath.model == "random"
    assert [change.key for change in bench.tuning.unsaved()] == ["character"]
    bench.tuning.set({"gaze.idle.hold_ms": 300.0})
    bench.tuning.save()
    assert load_rig(str(mine)).gaze.scanpath.model == "markov"
    assert load_rig(str(mine)).gaze.idle.hold_ms == 300.0
