"""Examination of a whole bus of a rig: its servos, their baud rates and their faults.

The examination only reads.
"""

from collections.abc import Callable, Mapping, Sequence

import msgspec

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError
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
from gazerig.features.bringup.doctor.diagnostics import ADVICE, Diagnostic
from gazerig.features.bringup.doctor.servo_rules import apply_rules, read_state
from gazerig.features.bringup.servo_kinds import ServoKind, Tell
from gazerig.features.bringup.servo_setup import open_at, search_rates


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
    advice = ADVICE.families[kind.family.name]
    open_at(port, baud)
    line = Transactions(port, kind.family)
    present, shared = _find_present(port, kind, setups, baud, tell)
    missing = [setup for setup in setups if setup.id not in present]
    others = [rate for rate in kind.family.baud_rates if rate != baud and missing]
    answers = search_rates(port, kind, others, tell)
    open_at(port, baud)
    elsewhere = {found.id: found for one in answers.values() for found in one.found}
    if missing and not present and not elsewhere:
        return [ADVICE.bus["nobody"].at("the bus", baud=baud, no_reply=advice.no_reply)]
    findings = []
    for setup in missing:
        found = elsewhere.pop(setup.id, None)
        cause = "elsewhere" if found else "pieces" if setup.id in shared else "silent"
        facts = {"setup": setup, "found": found, "baud": baud}
        findings.append(ADVICE.bus[cause].at(servo_label(setup), **facts))
    named = ", ".join(f"{servo_label(setup)}: {setup.model}" for setup in missing)
    for found in elsewhere.values():
        findings.append(ADVICE.bus["new"].at("the bus", found=found, missing=named))
    factory = kind.family.factory_baud
    if factory in answers and answers[factory].is_spoilt:
        findings.append(ADVICE.bus["new ones"].at("the bus", baud=factory))
    states, known = [], {setup.id: setup for setup in setups}
    for servo_id, servo in sorted(present.items()):
        if servo_id in known:
            setup = known[servo_id]
            tell(f"reading {servo_label(setup)}")
            states.append(read_state(line, kind, setup, servo, servo_id in shared))
        else:
            findings.append(ADVICE.bus["stranger"].at("the bus", found=servo))
    far = find_far({s.setup.name: s.position for s in states if s.position is not None})
    for state in states:
        findings += apply_rules(msgspec.structs.replace(state, far=far.get(state.setup.name, "")))
    if present and advice.note:
        findings.append(Diagnostic("note", advice.note, "the bus"))
    return findings


def _find_present(
    port: BusPort, kind: ServoKind, setups: Sequence[ServoConfig], baud: int, tell: Tell
) -> tuple[dict[int, FoundServo], set[int]]:
    """Return the servos at the rig's rate by id, and the ids that two servos seem to share."""
    answers = search_rates(port, kind, (baud,), tell, thorough=True)[baud]
    present, shared = {found.id: found for found in answers.found}, set(answers.shared_ids)
    for setup in setups:
        if setup.id not in present:
            tell(f"asking {servo_label(setup)}")
            found = ping(port, kind.family, setup.id, baud)
            if found is not None:
                present[setup.id] = found
            tries = ANSWERS if found else 1
            if count_corrupt(port, kind.family, setup.id, tries) >= min(SHARED, tries):
                shared.add(setup.id)
    return present, shared
