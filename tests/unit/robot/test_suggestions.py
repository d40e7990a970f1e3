"""Commands that messages suggest: typed unchanged, they reach the same rig and port."""

import pytest

from gazerig.robot.cli.terminal import clear_errors, complete_suggestions

pytestmark = pytest.mark.usefixtures("simulated_wires")


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ("gazerig doctor RIG --fix", "gazerig doctor 'my rig.yaml' --port /dev/ttyACM3 --fix"),
        ("gazerig setup RIG, as", "gazerig setup 'my rig.yaml' --port /dev/ttyACM3, as"),
        ("gazerig ctl set a b", "gazerig ctl set a b"),
    ],
)  # fmt: skip
def test_a_suggestion_names_rig_and_port(said, wanted):
    with clear_errors("my rig.yaml", "/dev/ttyACM3"):
        assert complete_suggestions(said) == wanted == complete_suggestions(wanted)
    assert complete_suggestions(said) == said
