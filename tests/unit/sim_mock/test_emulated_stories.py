"""Every register of emulated servos as it changes: delivered, moved, loaded, hindered, restarted.

Each line of a story is an order, the servo's error number, and the registers that have changed. The
file is tests/golden/emulated_servos.txt; run as a program with tests/helpers in PYTHONPATH this one
writes it anew.
"""

from pathlib import Path

import pytest
from servo_bench import WRITE, DynamixelBench, FeetechBench

from gazerig.drivers.bus.servo_models import FAMILY_OF
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

GOLDEN = Path(__file__).parents[2] / "golden" / "emulated_servos.txt"

BODY = Physics(
    load_kg_m2=1e-4,
    gravity_nm=0.03,
    upright_steps=1500.0,
    stop_low_steps=300.0,
    stop_high_steps=3700.0,
)
COMMON = """do turn 1 100.4
min_position_limit 600
max_position_limit 3300
torque_enable 1
min_position_limit 650
goal_position 3000
wait 0.02
wait 0.02
wait 0.04
wait 0.06
wait 1
goal_position 3500
wait 1
do stick 1
goal_position 1000
wait 0.5
wait 1.6
torque_enable 1
goal_position 1010
wait 0.1
do free 1
wait 0.5
goal_position 700
wait 0.5
do brown-out 1
wait 1
do voltage 1 3.4
wait 0.1
torque_enable 1
do voltage 1 7
wait 0.1
torque_enable 1
goal_position 2000
wait 0.3
do temperature 1 75
wait 0.1
do temperature 1 30
wait 0.1
do brown-out 1
wait 1
torque_enable 1
wait 0.1
do overload 1
goal_position 2100
wait 0.1
torque_enable 0
do turn 1 3000
wait 0.2
torque_enable 1
wait 0.2
torque_enable 0
do turn 1 -9000
wait 0.2"""
STORIES = {
    "xl330-m077": """profile_velocity 120
profile_acceleration 40
bus_watchdog 128
moving 1
led 1
led 2
id 253
id 1
goal_pwm 886
position_i_gain 2000
velocity_limit 2048
"""
    + COMMON
    + """
do reset 1
wait 1
drive_mode 1
homing_offset -500
goal_pwm 300
torque_enable 1
goal_position 1000
wait 0.05
wait 0.5
bus_watchdog 2
wait 0.06
goal_position 1100
bus_watchdog 0
goal_position 1100
wait 0.5
torque_enable 0
operating_mode 4
torque_enable 1
goal_position 6000
goal_position 1048576
wait 1
torque_enable 0
operating_mode 1
torque_enable 1
wait 0.1
drive_mode 4
shutdown 0
do overload 1
status_return_level 1
torque_enable 1
do reset 1
wait 1""",
    "xl430-w250": COMMON,
    "sts3215": """goal_speed 900
acceleration 30
torque_limit 700
position_i_gain 40
firmware_minor 7
baud_rate 9
"""
    + COMMON
    + """
lock 0
torque_enable 128
position_p_gain 16
lock 1
position_d_gain 8
max_torque 400
do brown-out 1
wait 1
position_offset -300
operating_mode 3
goal_position -100
torque_enable 1
wait 0.5
max_position_limit 0
min_position_limit 0
goal_position 5000
wait 1
goal_position -50
wait 1
overload_torque 10
protection_time 20
unloading_condition 0
wait 0.5
torque_enable 0
do reset 1
wait 1""",
    "scs15": """do turn 1 250
wait 0.1
goal_position 500
torque_enable 1
wait 0.1
wait 1""",
    "scs0009": """max_torque 500
goal_speed 300
torque_enable 1
goal_position 700
wait 0.1
wait 1
do stick 1
goal_position 500
do voltage 1 9
wait 2.2
do voltage 1 6
do free 1
wait 0.5
goal_position 505
wait 0.5
torque_enable 128
torque_enable 0
do turn 1 600
wait 0.1
do turn 1 -2000
wait 0.1
min_position_limit 300
max_position_limit 200
goal_position 100
torque_enable 1
wait 1
do voltage 1 9
wait 0.1
do temperature 1 71
wait 0.1
do brown-out 1
wait 1
do reset 1
wait 1""",
}


def story(model):
    """Yield the lines of a model's story, only the first for one without."""
    make = FeetechBench if "feetech" in FAMILY_OF[model].name else DynamixelBench
    scale = FAMILY_OF[model].steps_per_turn / 4096
    physics = BODY._replace(stop_low_steps=300.0 * scale, stop_high_steps=3700.0 * scale)
    bench = make(ServoSpec(1, model, 2048 * scale, physics=physics))
    bench.registers, before = bench.chain.servos[0].memory.registers, dict[str, int]()
    for line in ["", *STORIES.get(model, "").splitlines()]:
        word, _, rest = line.partition(" ")
        said = list[int]()
        if word == "wait":
            bench.wait(float(rest))
        elif word == "do":
            bench.chain.faults.command(rest)
        elif word:
            value = bench.registers[word].encode(int(rest))
            said = [error for _, error, _ in bench.ask(1, WRITE, bench.head_of(word), value)]
        try:
            now = {name: bench.get(name) for name in bench.registers}
        except ValueError:
            now = {"silent": 1}
        changed = (f"{name} {value}" for name, value in now.items() if before.get(name) != value)
        yield f"{model} {line} {said}: {', '.join(changed)}\n"
        before = now


@pytest.mark.parametrize("model", FAMILY_OF)
def test_a_servo_behaves_as_it_was_reviewed(model):
    assert "".join(story(model)) in GOLDEN.read_text(encoding="utf-8")


if __name__ == "__main__":
    GOLDEN.write_text("".join("".join(story(model)) for model in FAMILY_OF), encoding="utf-8")
