"""Whether a servo is set as the rig wants it: the registers it keeps without power."""

from collections.abc import Iterator

from gazerig.features.bringup.doctor.subject import FIX, Rule, RuleResult, ServoState

VOLTAGE = "input voltage"
"""What every family calls an unfit voltage, in bit 0."""


def _firmware(state: ServoState) -> Iterator[RuleResult]:
    firmware, wanted = state.found.firmware, state.setup.firmware_min
    if firmware < wanted:
        yield RuleResult(
            "error",
            f"firmware {firmware}, the YAML wants {wanted}",
            f"update it with {state.checks.program}",
        )
        return
    for note in state.checks.firmware_notes(state.setup.model):
        if firmware < note.below:
            yield RuleResult(note.level, f"firmware {firmware} {note.text}", note.remedy)
            return


def _baud(state: ServoState) -> Iterator[RuleResult]:
    value, rates = state.values["baud_rate"], state.checks.kind.family.baud_rates
    if value is None or value >= len(rates) or rates[value] == state.found.baud:
        return
    yield RuleResult(
        "warn",
        f"answers at {state.found.baud} bit/s, but its Baud Rate is {rates[value]}: after "
        "its next start it will not be heard here",
        f"gazerig setup --joint {state.setup.name}",
    )


def _wanted(state: ServoState) -> Iterator[RuleResult]:
    for wanted in state.checks.wanted:
        value = state.values[wanted.register]
        if value is None or wanted.met_by(value):
            continue
        right = value & ~wanted.mask | wanted.value & wanted.mask
        fixes = ((wanted.register, right),) if wanted.remedy == FIX else ()
        remedy = wanted.remedy.format(joint=state.setup.name)
        yield RuleResult(wanted.level, wanted.text(value), remedy, fixes)


def _limits(state: ServoState) -> Iterator[RuleResult]:
    low, high = state.values["min_position_limit"], state.values["max_position_limit"]
    least, most = state.setup.min_steps, state.setup.max_steps
    if state.checks.unlimited_at_zero:
        least, most = max(0, least), max(1, most)
    if low is None or high is None or (low, high) == (least, most):
        return
    fixes = (("min_position_limit", least), ("max_position_limit", most))
    own = f"its own position limits {low}..{high}"
    if state.checks.unlimited_at_zero and low == high == 0:
        text = "has no position limits of its own and many turns"
        yield RuleResult("warn", text, FIX, fixes)
    elif low > least or high < most:
        yield RuleResult("warn", f"{own} cut the YAML's range {least}..{most}", FIX, fixes)
    else:
        yield RuleResult("note", f"{own} are wider than the YAML's range", FIX, fixes)


def _protection(state: ServoState) -> Iterator[RuleResult]:
    protection = state.checks.protection
    value = state.values[protection.register]
    if value is None:
        return
    off = [error for bit, error in protection.errors.items() if not value & bit]
    if not off:
        return
    text = protection.text.format(errors=", ".join(off), value=value)
    if protection.by_hand is not None:
        yield RuleResult("warn", text, protection.by_hand(state.setup.model))
    else:
        right = value | sum(protection.errors)
        yield RuleResult("warn", text, FIX, ((protection.register, right),))


def _voltage_latch(state: ServoState) -> Iterator[RuleResult]:
    """Where an unfit voltage takes the torque away until a restart, a moment of it is enough."""
    family, register = state.checks.kind.family, state.checks.protection.register
    value = state.values[register]
    if value is None or not family.faults_latch or family.name_errors(value & 1) != (VOLTAGE,):
        return
    low, high = state.values["min_voltage_limit"], state.values["max_voltage_limit"]
    limits = f"{(low or 0) / 10.0:.1f}..{(high or 0) / 10.0:.1f} V"
    yield RuleResult(
        "note",
        f"a moment outside {limits} switches its torque off until it is restarted "
        f"({register.capitalize()} {value})",
        "size the supply for all servos at once, and feed long chains at both ends; "
        "gazerig reboot brings a latched servo back",
    )


def _overload(state: ServoState) -> Iterator[RuleResult]:
    """Where overload protection has a share and a time of its own, both must let it act."""
    share, after = state.values.get("overload_torque"), state.values.get("protection_time")
    if share is not None and after is not None and (share >= 100 or not after):
        yield RuleResult(
            "warn",
            "its overload protection cannot act as meant "
            f"(Overload Torque {share} %, Protection Time {after / 100.0:g} s)",
            "set Overload Torque (36) to 80 and Protection Time (35) to 200 with "
            f"{state.checks.program}",
        )


def _speed(state: ServoState) -> Iterator[RuleResult]:
    """The YAML's speed lies within the servo's own limit, or what its motor can do."""
    kind = state.checks.kind
    unit_deg_s = kind.family.velocity_unit_steps_s * 360.0 / kind.family.steps_per_turn
    asked = int(state.setup.max_speed_steps_s / kind.family.velocity_unit_steps_s)
    limit = state.values.get("velocity_limit")
    if limit is not None and limit < asked:
        yield RuleResult(
            "note",
            f"its Velocity Limit is {limit * unit_deg_s:.0f} deg/s, the YAML asks for "
            f"{asked * unit_deg_s:.0f}",
            f"lower max_speed_deg_s in the YAML or raise the limit with {state.checks.program}",
        )
    fastest_steps_s = state.model.no_load_steps_s
    if "velocity_limit" not in state.values and state.setup.max_speed_steps_s > fastest_steps_s:
        yield RuleResult(
            "note",
            f"the YAML asks its shaft for {asked * unit_deg_s:.0f} deg/s; without load and at "
            f"{state.model.rated_v:g} V it turns "
            f"{fastest_steps_s * 360.0 / kind.family.steps_per_turn:.0f}",
            "lower max_speed_deg_s in the YAML",
        )


SETTINGS: tuple[Rule, ...] = (
    *(_firmware, _baud, _wanted, _limits, _protection, _voltage_latch, _overload, _speed),
)
