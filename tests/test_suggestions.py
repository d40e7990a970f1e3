"""Commands that messages suggest: typed unchanged, they reach the same rig and port."""

from threading import Thread

import pytest

from gazerig.robot.cli.terminal import complete_suggestions, suggest_for_rig

pytestmark = pytest.mark.usefixtures("simulated_wires")

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


def test_other_threads_suggest_the_same_and_inner_blocks_too() -> None:
    heard = []
    with suggest_for_rig("my.yaml", "/dev/ttyACM3", False), suggest_for_rig(None, None, False):
        thread = Thread(target=lambda: heard.append(complete_suggestions("gazerig doctor")))
        thread.start()
        thread.join()
    assert heard == ["gazerig doctor my.yaml --port /dev/ttyACM3"]
    assert complete_suggestions("gazerig doctor") == "gazerig doctor"
