"""Every number of the control tables and families is the one that its maker prints.

Sources: ROBOTIS e-Manual, X series; Feetech, memory tables of the STS3215 and of the SCS servos.
"""

from collections.abc import Iterable
from dataclasses import astuple

import pytest

from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.dynamixel import control_table
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.feetech import memory_table
from gazerig.drivers.feetech.family import FEETECH, FEETECH_SCS
from gazerig.drivers.servo_bus.family import Family


def text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as lines, "-" for None, numbers to six digits."""
    shown = ((f"{v:.6g}" if isinstance(v, float) else str(v) for v in row) for row in rows)
    return "\n".join(" ".join(row).replace("None", "-") for row in shown)


def sheet(family: Family) -> str:
    """Return what is a number, a text or a list of these in a family, one line each."""
    rows = vars(family).items()
    skipped = "codec", "registers", "models"
    return text(row for row in rows if row[0] not in skipped and not callable(row[1]))


DYNAMIXELS = """\
xl330-m077 1190 4096 70 35 70 0.215 5 1.47 383 x330 1750 1620 53 (400, 40, 400, 0, 400)
xl330-m288 1200 4096 70 35 70 0.52 5 1.47 103 x330 1750 445 53 (1600, 180, 0, 0, 400)
xc330-m181 1230 4096 70 35 70 0.6 5 1.8 129 x330 2352 545 52 (1400, 100, 500, 0, 1200)
xc330-m288 1240 4096 70 35 70 0.93 5 1.8 81 x330 2352 350 52 (1600, 50, 500, 0, 1100)
xc330-t181 1210 4096 70 55 140 0.8 12 0.88 113 x330 910 510 52 (1200, 40, 0, 0, 900)
xc330-t288 1220 4096 70 55 140 1 12 0.88 71 x330 910 320 52 (1200, 40, 0, 0, 900)
xl430-w250 1060 4096 72 60 140 1.5 12 1.4 61 x430 - 265 52 (1000, 100, 4000, 0, 640)
xm430-w350 1020 4096 80 95 160 4.1 12 2.3 46 x430 1193 200 52 (1920, 100, 0, 0, 800)
xm430-w210 1030 4096 80 95 160 3 12 2.3 77 x430 1193 330 52 (1920, 100, 0, 0, 800)
xh430-w350 1000 4096 80 95 160 3.4 12 1.3 30 x430 648 130 52 (1920, 100, 0, 0, 900)
xh430-w210 1010 4096 80 95 160 2.5 12 1.3 50 x430 648 210 52 (1920, 100, 0, 0, 900)
xh430-v350 1040 4096 80 110 300 3.3 24 0.7 31 x430 689 135 52 (1920, 100, 0, 0, 800)
xh430-v210 1050 4096 80 110 300 2.6 24 0.7 52 x430 689 230 52 (1920, 100, 0, 0, 800)"""
"""Name, number, steps of a turn, hottest degC, lowest and highest 0.1 V, stall Nm at V and A,
rev/min, series, limits of current and velocity, Shutdown, gains of velocity I P, position D I P."""

X_UNITS = """\
xl330-m077 1 0.000680272 26146.1
xl330-m288 1 0.000680272 7031.47
xc330-m181 1 0.000555556 8806.4
xc330-m288 1 0.000555556 5529.6
xc330-t181 1 0.00113636 7714.13
xc330-t288 1 0.00113636 4846.93
xl430-w250 0 0.001 4164.27
xm430-w350 2.69 0.00116957 3140.27
xm430-w210 2.69 0.00116957 5256.53
xh430-w350 2.69 0.00206923 2048
xh430-w210 2.69 0.00206923 3413.33
xh430-v350 1.34 0.00191429 2116.27
xh430-v210 1.34 0.00191429 3549.87"""
"""Name, mA of a unit of Present Current, share of the stall torque of one, no-load steps/s."""

X_REGISTERS = """\
model_number 0 2 r - - - False - little
firmware_version 6 1 r - - - False - little
id 7 1 rw 1 0 252 False - little
baud_rate 8 1 rw 1 0 7 False - little
return_delay_time 9 1 rw 250 0 254 False - little
drive_mode 10 1 rw 0 0 13 False - little
operating_mode 11 1 rw 3 0 16 False - little
secondary_id 12 1 rw 255 0 255 False - little
protocol_type 13 1 rw 2 1 22 False - little
homing_offset 20 4 rw 0 -1044479 1044479 True - little
moving_threshold 24 4 rw 10 0 1023 False - little
temperature_limit 31 1 rw - 0 100 False - little
max_voltage_limit 32 2 rw - - - False - little
min_voltage_limit 34 2 rw - - - False - little
pwm_limit 36 2 rw 885 0 885 False - little
current_limit 38 2 rw - - - False - little
velocity_limit 44 4 rw - 0 2047 False - little
max_position_limit 48 4 rw 4095 0 4095 False - little
min_position_limit 52 4 rw 0 0 4095 False - little
startup_configuration 60 1 rw 0 0 3 False - little
pwm_slope 62 1 rw 140 1 255 False - little
shutdown 63 1 rw - 0 63 False - little
torque_enable 64 1 rw 0 0 1 False - little
led 65 1 rw 0 0 1 False - little
status_return_level 68 1 rw 2 0 2 False - little
hardware_error_status 70 1 r 0 - - False - little
velocity_i_gain 76 2 rw - 0 16383 False - little
velocity_p_gain 78 2 rw - 0 16383 False - little
position_d_gain 80 2 rw - 0 16383 False - little
position_i_gain 82 2 rw - 0 16383 False - little
position_p_gain 84 2 rw - 0 16383 False - little
bus_watchdog 98 1 rw 0 0 127 False - little
goal_pwm 100 2 rw - - - True - little
goal_current 102 2 rw - - - True - little
goal_velocity 104 4 rw - - - True - little
profile_acceleration 108 4 rw 0 0 32767 False - little
profile_velocity 112 4 rw 0 0 32767 False - little
goal_position 116 4 rw - - - True - little
realtime_tick 120 2 r - - - False - little
moving 122 1 r - - - False - little
moving_status 123 1 r - - - False - little
present_pwm 124 2 r - - - True - little
present_current 126 2 r - - - True - little
present_velocity 128 4 r - - - True - little
present_position 132 4 r - - - True - little
velocity_trajectory 136 4 r - - - True - little
position_trajectory 140 4 r - - - True - little
present_input_voltage 144 2 r - - - False - little
present_temperature 146 1 r - - - False - little"""
"""Name, address, size, access, initial, lowest, highest, signed, sign bit, order."""

FEETECHS = """\
sts3215 777 4096 70 40 80 1.91 7.4 2.7 55
sts3215-12v 777 4096 70 40 140 2.94 12 2.7 45
scs0009 1284 1229 70 40 80 0.226 6 1 100
scs15 1295 1843 70 40 80 1.47 6 2 62.5"""
"""As of DYNAMIXELS, to rev/min."""

STS_REGISTERS = """\
firmware_major 0 1 r 3 - - False - little
firmware_minor 1 1 r 10 - - False - little
endianness 2 1 r 0 - - False - little
model_number 3 2 r - - - False - little
id 5 1 rw 1 - - False - little
baud_rate 6 1 rw 0 - - False - little
return_delay_time 7 1 rw 0 - - False - little
status_return_level 8 1 rw 1 - - False - little
min_position_limit 9 2 rw 0 - - False - little
max_position_limit 11 2 rw 4095 - - False - little
temperature_limit 13 1 rw 70 - - False - little
max_voltage_limit 14 1 rw 80 - - False - little
min_voltage_limit 15 1 rw 40 - - False - little
max_torque 16 2 rw 1000 - - False - little
phase 18 1 rw 12 - - False - little
unloading_condition 19 1 rw 44 - - False - little
position_p_gain 21 1 rw 32 - - False - little
position_d_gain 22 1 rw 32 - - False - little
position_i_gain 23 1 rw 0 - - False - little
protection_current 28 2 rw 500 - - False - little
angular_resolution 30 1 rw 1 - - False - little
position_offset 31 2 rw 0 - - False 11 little
operating_mode 33 1 rw 0 - - False - little
protective_torque 34 1 rw 20 - - False - little
protection_time 35 1 rw 200 - - False - little
overload_torque 36 1 rw 80 - - False - little
velocity_p_gain 37 1 rw 10 - - False - little
overcurrent_time 38 1 rw 200 - - False - little
velocity_i_gain 39 1 rw 10 - - False - little
torque_enable 40 1 rw 0 - - False - little
acceleration 41 1 rw 0 - - False - little
goal_position 42 2 rw - - - False 15 little
goal_time 44 2 rw 0 - - False - little
goal_speed 46 2 rw 0 - - False 15 little
torque_limit 48 2 rw - - - False - little
lock 55 1 rw 1 - - False - little
present_position 56 2 r - - - False 15 little
present_velocity 58 2 r - - - False 15 little
present_load 60 2 r - - - False 10 little
present_input_voltage 62 1 r - - - False - little
present_temperature 63 1 r - - - False - little
registered_instruction 64 1 r - - - False - little
status 65 1 r - - - False - little
moving 66 1 r - - - False - little
present_current 69 2 r - - - False 15 little"""
"""As of X_REGISTERS."""

SCS_REGISTERS = """\
firmware_major 0 1 r 3 - - False - big
firmware_minor 1 1 r 10 - - False - big
endianness 2 1 r 0 - - False - big
model_number 3 2 r - - - False - big
id 5 1 rw 1 - - False - big
baud_rate 6 1 rw 0 - - False - big
return_delay_time 7 1 rw 0 - - False - big
status_return_level 8 1 rw 1 - - False - big
min_position_limit 9 2 rw 0 - - False - big
max_position_limit 11 2 rw 1023 - - False - big
temperature_limit 13 1 rw 70 - - False - big
max_voltage_limit 14 1 rw 80 - - False - big
min_voltage_limit 15 1 rw 40 - - False - big
max_torque 16 2 rw 1000 - - False - big
unloading_condition 19 1 rw 36 - - False - big
position_p_gain 21 1 rw 32 - - False - big
position_d_gain 22 1 rw 32 - - False - big
position_i_gain 23 1 rw 0 - - False - big
protective_torque 37 1 rw 20 - - False - big
protection_time 38 1 rw 200 - - False - big
overload_torque 39 1 rw 80 - - False - big
torque_enable 40 1 rw 0 - - False - big
acceleration 41 1 rw 0 - - False - big
goal_position 42 2 rw - - - False 15 big
goal_time 44 2 rw 0 - - False - big
goal_speed 46 2 rw 0 - - False 15 big
lock 48 1 rw 1 - - False - big
present_position 56 2 r - - - False 15 big
present_velocity 58 2 r - - - False 15 big
present_load 60 2 r - - - False 10 big
present_input_voltage 62 1 r - - - False - big
present_temperature 63 1 r - - - False - big
registered_instruction 64 1 r - - - False - big
status 65 1 r - - - False - big
moving 66 1 r - - - False - big"""
"""As of X_REGISTERS."""

SERVO_MODELS = """\
hobby maestro 16000 2000 10000 us 4 1500 False 70 0 inf  0.2 0 0 0 0 0 0
scs15 feetech 1843 0 1023 steps 1 512 True 70 4 8 feetech scs 1.47 2 32 719.922 0.0444493 \
0.138904 0
sts3215 feetech 4096 0 4095 steps 1 2048 True 70 4 8 feetech 1.91 2.7 32 1600 0.02 0.0625 0
sts3215-12v feetech 4096 0 4095 steps 1 2048 True 70 4 14 feetech 2.94 2.7 32 1600 0.02 0.0625 0
scs0009 feetech 1229 0 1023 steps 1 512 True 70 4 8 feetech scs 0.226 1 32 480.078 0.0666558 \
0.208299 0
xl330-m077 dynamixel 4096 0 4095 steps 1 2048 True 70 3.5 7 dynamixel 0.215 1.47 400 113280 \
0.00353107 0.000882768 0
xl430-w250 dynamixel 4096 0 4095 steps 1 2048 True 72 6 14 dynamixel 1.5 1.4 640 113280 \
0.00564972 0.000882768 0
xh430-v210 dynamixel 4096 0 4095 steps 1 2048 True 80 11 30 dynamixel 2.6 0.7 800 113280 \
0.00706215 0.000882768 0
xc330-t181 dynamixel 4096 0 4095 steps 1 2048 True 70 5.5 14 dynamixel 0.8 0.88 900 113280 \
0.00794492 0.000882768 0"""
"""Name, bus, steps of a turn, first and last step, unit and steps of one, middle, measures,
limits degC and V, family, stall Nm and A, P gain, steps times gain of full drive; shares of full
drive per step with its own gains, with a P gain of 100, and with an I gain."""

X_FAMILY = """\
name dynamixel
steps_per_turn 4096
errors {1: 'input voltage', 4: 'overheating', 8: 'encoder', 16: 'electrical shock', 32: \
'overload'}
error_register hardware_error_status
effort_register present_current
velocity_unit_steps_s 15.6331
goal_layout <Bi
goal_speed False
arming_register profile_velocity
most_goals 253
sync_read True
fast_read_since {'xl330-m077': 46, 'xl330-m288': 46, 'xc330-m181': 46, 'xc330-m288': 46, \
'xc330-t181': 46, 'xc330-t288': 46, 'xl430-w250': 45, 'xm430-w350': 45, 'xm430-w210': 45, \
'xh430-w350': 45, 'xh430-w210': 45, 'xh430-v350': 45, 'xh430-v210': 45}
baud_rates (9600, 57600, 115200, 1000000, 2000000, 3000000, 4000000, 4500000)
factory_baud 57600
highest_id 252
updater Dynamixel Wizard 2.0
window Window(address=126, layout='<hii', fields=('effort', 'velocity', 'position'), signs=())
polled (('torque_enable', 'torque_enable'), ('hardware_error_status', 'hardware_error_status'), \
('present_input_voltage', 'present_temperature'))
read_spans (('return_delay_time', 'operating_mode'), ('pwm_limit', 'pwm_limit'), ('pwm_slope', \
'pwm_slope'), ('velocity_limit', 'min_position_limit'), ('position_d_gain', 'position_p_gain'), \
('profile_acceleration', 'profile_velocity'))
answer_level 2
lock_register -
faults_latch True
watchdog_unit_s 0.02
single_turn False
prompt_timeout_s 0.002"""
"""What the bus is told of the family."""

STS_FAMILY = """\
name feetech
steps_per_turn 4096
errors {1: 'input voltage', 2: 'encoder', 4: 'overheating', 8: 'overcurrent', 32: 'overload'}
error_register status
effort_register present_load
velocity_unit_steps_s 1
goal_layout <BHHH
goal_speed True
arming_register acceleration
most_goals 35
sync_read True
fast_read_since {}
baud_rates (1000000, 500000, 250000, 128000, 115200, 76800, 57600, 38400)
factory_baud 1000000
highest_id 253
updater Feetech's program FD
window Window(address=56, layout='<HHHBBxB', fields=('position', 'velocity', 'effort', \
'voltage', 'temperature', 'status'), signs=(15, 15, 10))
polled (('torque_enable', 'torque_limit'),)
read_spans (('return_delay_time', 'operating_mode'), ('torque_limit', 'lock'))
answer_level 1
lock_register lock
faults_latch False
watchdog_unit_s -
single_turn True
prompt_timeout_s 0.002"""
"""What the bus is told of the family."""

SCS_FAMILY = """\
name feetech scs
steps_per_turn 1229
errors {1: 'input voltage', 2: 'encoder', 4: 'overheating', 8: 'overcurrent', 32: 'overload'}
error_register status
effort_register present_load
velocity_unit_steps_s 1
goal_layout >BHHH
goal_speed True
arming_register acceleration
most_goals 35
sync_read False
fast_read_since {}
baud_rates (1000000, 500000, 250000, 128000, 115200, 57600, 38400, 19200)
factory_baud 1000000
highest_id 253
updater Feetech's program FD
window Window(address=56, layout='>HHHBBxB', fields=('position', 'velocity', 'effort', \
'voltage', 'temperature', 'status'), signs=(15, 15, 10))
polled (('torque_enable', 'torque_enable'),)
read_spans (('return_delay_time', 'position_i_gain'), ('lock', 'lock'))
answer_level 1
lock_register lock
faults_latch False
watchdog_unit_s -
single_turn False
prompt_timeout_s 0.002"""
"""What the bus is told of the family."""


@pytest.mark.parametrize(
    ("ours", "printed"),
    [
        (text(map(astuple, control_table.MODELS.values())), DYNAMIXELS),
        (
            text(
                (one.name, one.current_unit_ma, one.load_unit, one.no_load_steps_s)
                for one in control_table.MODELS.values()
            ),
            X_UNITS,
        ),
        (text(control_table.REGISTERS.values()), X_REGISTERS),
        (text(map(astuple, {**FEETECH.models, **FEETECH_SCS.models}.values())), FEETECHS),
        (text(memory_table.REGISTERS.values()), STS_REGISTERS),
        (text(memory_table.SCS_REGISTERS.values()), SCS_REGISTERS),
        (
            text(
                (
                    name,
                    *SERVOS[name],
                    *map(SERVOS[name].stiffness, (None, (100, 0, 9), (100, 1, 9))),
                )
                for name in (line.split()[0] for line in SERVO_MODELS.splitlines())
            ),
            SERVO_MODELS,
        ),
        (sheet(DYNAMIXEL), X_FAMILY),
        (sheet(FEETECH), STS_FAMILY),
        (sheet(FEETECH_SCS), SCS_FAMILY),
    ],
)
def test_every_number_is_the_makers(ours, printed):
    assert ours == printed
