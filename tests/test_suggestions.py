"""Commands that messages suggest: typed unchanged, they reach the same rig and port."""

from pathlib import Path
from threading import Thread
from typing import Any, cast

import pytest
from typer.testing import CliRunner

from gazerig.config.schema import load_rig
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.cli.main import app
from gazerig.robot.cli.terminal import _writer, complete_suggestions, suggest_for_rig
from gazerig.sim_mock.pty.client import PtyBus

pytestmark = pytest.mark.usefixtures("simulated_wires")

DESK = Path(__file__).parents[1] / "config/rigs/desk.yaml"
GIVEN = {"rig": "my rig.yaml", "port": "/dev/ttyACM3", "mock": False}


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ("gazerig doctor --fix", "gazerig doctor 'my rig.yaml' --fix --port /dev/ttyACM3"),
        ("gazerig setup --joint neck_yaw, as", 
         "gazerig setup 'my rig.yaml' --joint neck_yaw --port /dev/ttyACM3, as"),
        ("run gazerig scan: it", "run gazerig scan --port /dev/ttyACM3: it"),
        ("gazerig calibrate", "gazerig calibrate 'my rig.yaml' --port /dev/ttyACM3"),
        ("gazerig run --mock", "gazerig run --mock"),
        ("gazerig ctl set a b", "gazerig ctl set a b"),
    ],
)  # fmt: skip
def test_a_suggestion_names_rig_and_port(said: str, wanted: str) -> None:
    assert complete_suggestions(said, GIVEN) == wanted
    assert complete_suggestions(complete_suggestions(said, GIVEN), GIVEN).count(
        "--port"
    ) == wanted.count("--port")
    assert complete_suggestions(said, {}) == said


@pytest.mark.parametrize(
    "asked",
    [
        ["jog", "RIG", "neck_yaw", "5"],
        ["run", "RIG", "--scene", "visitor", "--no-page", "--seconds", "1"],
    ],
)
def test_what_a_driver_says_at_the_start_can_be_typed(asked: list[str], tmp_path, capfd) -> None:
    if asked[0] != "run":
        pytest.importorskip("gazerig.features.bringup")
    rig = tmp_path / "mine.yaml"
    rig.write_text(DESK.read_text())
    words = [str(rig) if word == "RIG" else word for word in asked]
    with PtyBus() as bus:
        path = bus.start(
            cast(Any, next(iter(emulated_lines(load_rig("desk")).values())).servos),
            baud=1_000_000,
        )
        bus.command("overload 7")
        made = CliRunner().invoke(app, [*words, "--port", path])
        _writer.flush(20.0)
    said = made.output + capfd.readouterr().err
    assert made.exit_code in (1, 2), said
    assert f"; gazerig doctor {rig} --port {path} finds the cause" in said


def test_other_threads_suggest_the_same_and_inner_blocks_too() -> None:
    heard = []
    with suggest_for_rig("my.yaml", "/dev/ttyACM3", False), suggest_for_rig(None, None, False):
        thread = Thread(target=lambda: heard.append(complete_suggestions("gazerig doctor")))
        thread.start()
        thread.join()
    assert heard == ["gazerig doctor my.yaml --port /dev/ttyACM3"]
    assert complete_suggestions("gazerig doctor") == "gazerig doctor"
