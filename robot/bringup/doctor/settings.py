"""Whether a servo is set as the rig wants it: the registers it keeps without power."""

from collections.abc import Iterator

from gazerig.robot.bringup.doctor.subject import FIX, Rule, ServoState, Verdict


def _firmware(state: ServoState) -> Iterator[Verdict]:
    firmware, wanted = state.found.firmware, state.setup.firmware_min
    if firmware < wanted:
        yield Verdict(
            "error",
            f"firmware {firmware}, the YAML wants {wanted}",
            f"update it with {state.checks.program}",
        )
        return
    for note in state.checks.firmware_notes(state.setup.model):
        if firmware < note.below:
            yield Verdict(note.level, f"firmware {firmware} {note.text}", note.remedy)
            return


def _baud(state: ServoState) -> Iterator[Verdict]:
    value, rates = state.values["baud_rate"], state.checks.kind.family.baud_rates
    if value is None or value >= len(rates) or rates[value] == state.found.baud:
        return
    yield Verdict(
        "warn",
        f"answers at {state.found.baud} bit/s, but its Baud Rate is {rates[value]}: after "
        "its next start it will not be heard here",
        f"gazerig setup --joint {state.setup.name}",
    )


def _wanted(state: ServoState) -> Iterator[Verdict]:
    for wanted in state.checks.wanted:
        value = state.values[wanted.register]
        if value is None or value & wanted.mask == wanted.value:
            continue
        right = value & ~wanted.mask | wanted.value
        fixes = ((wanted.register, right),) if wanted.remedy == FIX else ()
        remedy = wanted.remedy.format(joint=state.setup.name)
        yield Verdict(wanted.level, wanted.text(value), remedy, fixes)


def _limits(state: ServoState) -> Iterator[Verdict]:
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
        yield Verdict("warn", text, FIX, fixes)
    elif low > least or high < most:
        yield Verdict("warn", f"{own} cut the YAML's range {least}..{most}", FIX, fixes)
    else:
        yield Verdict("note", f"{own} are wider than the YAML's range", FIX, fixes)


def _protection(state: ServoState) -> Iterator[Verdict]:
    protection = state.checks.protection
    value = state.values[protection.register]
    if value is None:
        return
    off = [error for bit, error in protection.errors.items() if not value & bit]
    if not off:
        return
    text = protection.text.format(errors=", ".join(off), value=value)
    if protection.by_hand is not None:
        yield Verdict("warn", text, protection.by_hand(state.setup.model))
    else:
        right = value | sum(protection.errors)
        yield Verdict("warn", text, FIX, ((protection.register, right),))


SETTINGS: tuple[Rule, ...] = (_firmware, _baud, _wanted, _limits, _protection)
