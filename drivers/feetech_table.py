"""Control table of the Feetech STS servos as data.

Source: Feetech memory table STS3215. Units: position 1 step = 1/4096 turn; speed steps/s;
acceleration 100 steps/s^2; load 0.1 %; voltage 0.1 V; temperature 1 degC; current 6.5 mA.
"""

from typing import NamedTuple


class FeetechModel(NamedTuple):
    """What differs from model to model.

    number: as in register 3; steps_per_turn: of the encoder
    temperature_limit: degC; min_voltage, max_voltage: 0.1 V; factory values of registers 13,
        15 and 14
    stall_torque_nm, stall_current_a, no_load_rpm: at rated_v
    """

    name: str
    number: int
    steps_per_turn: int
    temperature_limit: int
    min_voltage: int
    max_voltage: int
    stall_torque_nm: float
    rated_v: float
    stall_current_a: float
    no_load_rpm: float


MODELS = {
    model.name: model
    for model in (
        FeetechModel("sts3215", 777, 4096, 70, 40, 80, 1.91, 7.4, 2.7, 55.0),
        FeetechModel("sts3215-12v", 777, 4096, 70, 40, 140, 2.94, 12.0, 2.7, 45.0),
    )
}
