"""Examination of a whole bus of a rig: its servos, their baud rates and their faults.

The examination only reads; ``apply_fixes`` writes the fixes of the findings, to servos whose torque
is off, and moves nothing.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import msgspec

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing
from gazerig.drivers.serial.list_ports import persistent_name
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import (
    ANSWERS,
    SHARED,
    FoundServo,
    count_corrupt,
    ping,
)
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import ADVICE, Diagnostic, Fix
from gazerig.features.bringup.doctor.servo_rules import apply_rules, read_state
from gazerig.features.bringup.servo_kinds import ServoKind, Tell
from gazerig.features.bringup.servo_setup import (
    Answers,
    Spare,
    assign_servo,
    find_spare,
    open_at,
    search_rates,
)

ADOPT = "id"
"""Register of the fix that gives a new servo the id and the baud rate of a missing one."""


class Presence(NamedTuple):
    """Servos that answered at the rig's baud rate, by id, and missing ones.

    unexpected: servos that answered but are not in the YAML; elsewhere: at other baud rates
    shared_ids: ids that two servos seem to share; spare: replaces the only missing servo
    """

    present: dict[int, FoundServo]
    missing: tuple[ServoConfig, ...]
    unexpected: tuple[FoundServo, ...]
    elsewhere: Answers
    shared_ids: set[int]
    spare: Spare | None


def examine_port(port: BusPort, examine: Callable[[], list[Diagnostic]]) -> list[Diagnostic]:
    """Examine the devices on a port; the port is closed at the end.

    A failure of the examination is one of the findings.

    examine: opens the port and queries the devices on it
    """
    device = port.port_name
    try:
        behind = examine()
    except DriverError as error:
        # The message has the port and the remedy.
        return [Diagnostic("error", str(error).removeprefix(device).lstrip(": "), device)]
    finally:
        port.closePort()
    lasting = persistent_name(device)
    findings = [ADVICE.bus["can open"].at(device)]
    if lasting not in (None, device):
        findings.append(ADVICE.bus["name"].at(device, name=lasting))
    return [*findings, *behind]


def examine_bus(
    port: BusPort,
    kind: ServoKind,
    setups: Sequence[ServoConfig],
    baud: int,
    tell: Tell,
    find_far: Callable[[Mapping[str, float]], Mapping[str, str]],
) -> list[Diagnostic]:
    """Examine every servo of a bus, including unexpected ones; torque is not changed.

    find_far: returns the joints that would get no torque, with the reason, from measured positions

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    presence = find_servos(port, kind, setups, baud, tell)
    advice = ADVICE.families[kind.family.name]
    if presence.missing and not presence.present and not presence.elsewhere.found:
        return [ADVICE.bus["nobody"].at("the bus", baud=baud, no_reply=advice.no_reply)]
    if presence.spare is not None:
        found, setup = presence.spare
        fix = Fix(found.id, ADOPT, setup.id, found.id)
        facts = {"setup": setup, "found": found, "baud": baud}
        findings = [ADVICE.bus["spare"].at(servo_label(setup), fix, **facts)]
    else:
        findings = _absences(presence, kind, baud)
    states, line = [], Transactions(port, kind.family)
    for setup in setups:
        if setup.id in presence.present:
            tell(f"reading {servo_label(setup)}")
            found, is_shared = presence.present[setup.id], setup.id in presence.shared_ids
            states.append(read_state(line, kind, setup, found, is_shared))
    far = find_far({s.setup.name: s.position for s in states if s.position is not None})
    for state in states:
        findings += apply_rules(msgspec.structs.replace(state, far=far.get(state.setup.name, "")))
    if presence.present and advice.note:
        findings.append(Diagnostic("note", advice.note, "the bus"))
    return findings


def _absences(presence: Presence, kind: ServoKind, baud: int) -> list[Diagnostic]:
    """Return the findings about missing and unexpected servos without a fitting spare."""
    at, findings = {found.id: found for found in presence.elsewhere.found}, []
    for setup in presence.missing:
        other = at.pop(setup.id, None)
        cause = "elsewhere" if other else "pieces" if setup.id in presence.shared_ids else "silent"
        findings.append(
            ADVICE.bus[cause].at(servo_label(setup), setup=setup, found=other, baud=baud)
        )
    missing = ", ".join(f"{servo_label(setup)}: {setup.model}" for setup in presence.missing)
    findings += [
        ADVICE.bus["new"].at("the bus", found=found, missing=missing) for found in at.values()
    ]
    if kind.family.factory_baud in presence.elsewhere.spoilt_bauds:
        findings.append(ADVICE.bus["spares"].at("the bus", baud=kind.family.factory_baud))
    findings += [ADVICE.bus["stranger"].at("the bus", found=found) for found in presence.unexpected]
    return findings


def find_servos(
    port: BusPort, kind: ServoKind, setups: Sequence[ServoConfig], baud: int, tell: Tell
) -> Presence:
    """Find the servos on the bus; the port is left open at the rig's baud rate.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    open_at(port, baud)
    answers = [*search_rates(port, kind, (baud,), tell, thorough=True).found]
    there = {found.id: found for found in answers}
    shared = {found.id for found in answers if answers.count(found) > 1}
    for setup in setups:
        if setup.id not in there:
            tell(f"asking {servo_label(setup)}")
            found = ping(port, kind.family, setup.id, baud)
            if found is not None:
                there[setup.id] = found
                answers.append(found)
            tries = ANSWERS if found else 1
            if count_corrupt(port, kind.family, setup.id, tries) >= min(SHARED, tries):
                shared.add(setup.id)
    missing = tuple(setup for setup in setups if setup.id not in there)
    known = {setup.id for setup in setups}
    strangers = tuple(found for i, found in sorted(there.items()) if i not in known)
    others = [rate for rate in kind.family.baud_rates if rate != baud and missing]
    elsewhere = search_rates(port, kind, others, tell)
    spare = find_spare(port, kind, setups, baud, [*answers, *elsewhere.found])
    open_at(port, baud)
    return Presence(there, missing, strangers, elsewhere, shared, spare)


# --- fixes


def apply_fixes(write: Callable[[Fix], str], findings: Iterable[Diagnostic]) -> Iterator[str]:
    """Write the fixes of the findings, one after the other; yield a line about each.

    write: writes one fix if that is safe; returns "" or the reason why it did not

    Raises:
        BusLost: the port has disappeared.
    """
    for finding in findings:
        for fix in finding.fixes:
            why = write(fix)
            yield f"{finding.where}: {fix}: {f'not done, {why}' if why else 'done'}"


def adopt_spare(
    port: BusPort, kind: ServoKind, fix: Fix, setups: Sequence[ServoConfig], baud: int, tell: Tell
) -> str:
    """Give a new servo its id and baud rate; return "" or the reason of a failure.

    Raises:
        PortError: the adaptor does not support a rate.
        BusLost: the port has disappeared.
    """
    factory_baud = kind.family.factory_baud
    open_at(port, factory_baud)
    spare = ping(port, kind.family, fix.servo_id, factory_baud)
    if spare is None:
        return "the servo does not answer"
    setup = next(one for one in setups if one.id == fix.value)
    try:
        assign_servo(port, kind, spare, setup, baud, tell)
    except (ServoFault, ServoMissing) as error:
        return str(error)
    return ""
