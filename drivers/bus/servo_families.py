"""Families of smart servos, by name and by model."""

from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.feetech.scs import FEETECH_SCS
from gazerig.drivers.servo_bus.family import Family

FAMILIES: dict[str, Family] = {one.name: one for one in (DYNAMIXEL, FEETECH, FEETECH_SCS)}
"""Families by name."""

FAMILY_OF: dict[str, Family] = {
    model: FAMILIES[facts.family] for model, facts in SERVOS.items() if facts.family
}
"""Families by the model name in a rig's YAML."""
