"""Noise to and fro on every kind of bus; the long form is tests/attack/line_noise.py."""

import pytest
from feedback_rows import rows
from line_noise import Noisy
from present import present

SMART = ("dynamixel", "dynamixel direct", "feetech")


@pytest.mark.parametrize("kind", SMART)
@pytest.mark.parametrize("percent", [0.2, 2.0])
def test_noise_gives_no_wrong_value_moves_no_joint_out_and_ends_nothing(kind, percent):
    noisy = Noisy(kind, seed=3)
    noisy.start()
    outcome = noisy.run(f"static {percent}", percent, 700)
    assert outcome.damaged > 58
    assert outcome.fresh > 290
    assert outcome.wrong == 0, outcome
    assert outcome.outside == 0, outcome
    assert outcome.ended == ""
    assert outcome.recover_s is not None
    assert outcome.recover_s < 2.0
    assert not [line for line in outcome.said if "this computer" in line]


def test_a_servo_that_answers_as_its_neighbour_is_not_believed_where_noise_hides_that_one():
    noisy = Noisy("feetech", seed=12)
    noisy.start()
    noisy.device.faults.command("wrong-id 2 3")
    outcome = noisy.run("static 2.0", 2.0, 900)
    assert outcome.wrong == 0, outcome
    assert outcome.fresh > 300
    assert outcome.recover_s is not None


@pytest.mark.parametrize("kind", SMART)
def test_a_line_that_says_its_last_answer_again_first_is_not_believed(kind):
    noisy = Noisy(kind)
    noisy.start()
    outcome = noisy.run("repeat", 0.0, 400)
    assert (outcome.wrong, outcome.ended, outcome.damaged) == (0, "", 0)


@pytest.mark.parametrize("kind", SMART)
def test_a_joint_that_was_turned_by_hand_is_believed_soon(kind):
    noisy = Noisy(kind)
    noisy.start()
    noisy.bus.disable_torque()
    for _ in range(100):  # it comes to rest
        noisy.bus.read(noisy.now)
        noisy.now += 0.005
    noisy.device.faults.command("turn 3 1000")
    seen = []
    for _ in range(8):
        seen.append(rows(noisy.bus.read(noisy.now))[2])
        noisy.now += 0.005
    assert seen[0] is None
    assert abs(present(seen[-1]).position_steps - noisy.truth()[2]) <= 2
    assert noisy.bus.health().errors["implausible"] == 2


def test_noise_on_the_line_of_a_board_leads_no_joint_out_nor_faster_than_a_servo_catches_up():
    noisy = Noisy("maestro crc", seed=2)
    noisy.start()
    outcome = noisy.run("static 0.5", 0.5, 2000)
    assert outcome.errors["serial CRC error"] + outcome.errors["serial protocol error"] > 5
    assert (outcome.outside, outcome.ended) == (0, "")
    assert outcome.fastest < 2.0
    assert outcome.recover_s is not None
    assert outcome.recover_s < 3.0


def test_noise_on_an_i2c_bus_whose_bytes_carry_no_check_is_over_in_a_tick():
    """A pulse made by noise lasts until the next goals: 5 ms, and never in silence."""
    noisy = Noisy("pca9685", seed=2)
    noisy.start()
    outcome = noisy.run("static 0.5", 0.5, 2000)
    assert outcome.errors["other pulse"] > 5 and outcome.damaged > 500
    assert (outcome.wrong, outcome.ended) == (0, "")
    assert outcome.outside <= 40, outcome  # of 12,000 looks
    assert outcome.recover_s is not None
    assert outcome.recover_s < 3.0


@pytest.mark.parametrize("kind", ["maestro crc", "pca9685"])
def test_a_board_of_which_only_damaged_answers_come_is_not_given_up_and_nothing_moves(kind):
    noisy = Noisy(kind)
    noisy.start()
    outcome = noisy.run("repeat", 0.0, 14_000)  # 70 s, longer than give_up_s
    assert outcome.ended == ""
    assert any("arrive damaged" in text for text in outcome.said)
    assert outcome.recover_s is not None
    assert outcome.recover_s < 3.0
