"""Commands that messages suggest: typed unchanged, they reach the same rig and port."""

import pytest

from gazerig.robot.cli.terminal import complete_suggestions

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
