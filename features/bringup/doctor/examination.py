"""Examination of a whole bus of a rig: its servos, their baud rates and their faults.

The examination only reads; ``apply_fixes`` writes the fixes of its findings, to servos whose torque
is off, and moves nothing.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence

import msgspec

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, ServoMissing
from gazerig.drivers.serial.list_ports import persistent_name
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import (
    SHARED,
    count_corrupt,
    ping,
)
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import ADVICE, Diagnostic, Fix
from gazerig.features.bringup.doctor.servo_rules import apply_fix, apply_rules, read_state
from gazerig.features.bringup.servo_kinds import ServoKind, Tell
from gazerig.features.bringup.servo_setup import (
    assign_servo,
    find_spare,
    open_at,
    search_all,
    search_rates,
)

ADOPT = "id"
"""Register of the fix that gives a new servo the id and the baud rate of the missing one."""


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
    answers = search_rates(port, kind, (baud,), tell, thorough=True)
    present = {found.id: found for found in answers[baud].found}
    shared = set(answers[baud].shared_ids)
    for setup in setups:
        if setup.id not in present:
            # Its answer may only have been lost.
            tell(f"asking {servo_label(setup)}")
            found = ping(port, kind.family, setup.id, baud)
            if found is not None:
                present[setup.id] = found
            if count_corrupt(port, kind.family, setup.id) >= SHARED:
                shared.add(setup.id)
    missing = [setup for setup in setups if setup.id not in present]
    others = [rate for rate in kind.family.baud_rates if rate != baud and missing]
    further = search_rates(port, kind, others, tell)
    pair = find_spare(port, kind, setups, baud, answers | further) if missing else None
    spare = pair and pair[0]
    open_at(port, baud)
    elsewhere = {found.id: found for one in further.values() for found in one.found}
    if missing and not present and not elsewhere:
        return [ADVICE.bus["nobody"].at("the bus", baud=baud, no_reply=advice.no_reply)]
    findings, fixes = [], list[Fix]()
    for setup in missing:
        found = spare or elsewhere.pop(setup.id, None)
        cause = "elsewhere" if found else "pieces" if setup.id in shared else "silent"
        if spare is not None:
            # It is for the only missing one.
            cause, fixes, elsewhere = "spare", [Fix(spare.id, ADOPT, setup.id, spare.id)], {}
        facts = {"setup": setup, "found": found, "baud": baud}
        findings.append(ADVICE.bus[cause].at(servo_label(setup), *fixes, **facts))
    named = ", ".join(f"{servo_label(setup)}: {setup.model}" for setup in missing)
    for found in elsewhere.values():
        findings.append(ADVICE.bus["new"].at("the bus", found=found, missing=named))
    factory = kind.family.factory_baud
    if factory in further and further[factory].is_spoilt:
        findings.append(ADVICE.bus["new ones"].at("the bus", baud=factory))
    states, known = [], {setup.id: setup for setup in setups}
    for servo_id, servo in sorted(present.items()):
        if servo_id in known:
            setup = known[servo_id]
            tell(f"reading {servo_label(setup)}")
            states.append(read_state(line, kind, setup, servo, servo_id in shared))
        elif servo != spare:
            findings.append(ADVICE.bus["stranger"].at("the bus", found=servo))
    far = find_far({s.setup.name: s.position for s in states if s.position is not None})
    for state in states:
        findings += apply_rules(msgspec.structs.replace(state, far=far.get(state.setup.name, "")))
    if present and advice.note:
        findings.append(Diagnostic("note", advice.note, "the bus"))
    return findings


def apply_fixes(
    port: BusPort,
    kind: ServoKind,
    setups: Sequence[ServoConfig],
    baud: int,
    findings: Sequence[Diagnostic],
    tell: Tell,
) -> Iterator[str]:
    """Write the fixes of the findings; yield a line about each.

    Raises:
        ServoMissing: a new servo to adopt does not answer any more.
        ServoFault: it refuses.
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    open_at(port, baud)
    for finding in findings:
        for fix in finding.fixes:
            why = ""
            if fix.register == ADOPT:
                # Whoever plugs servos meanwhile has changed what was found.
                answers = search_all(port, kind, baud, tell)
                spare = find_spare(port, kind, setups, baud, answers)
                if spare is None:
                    raise ServoMissing(f"{port.port_name}: the new servo does not answer any more")
                assign_servo(port, kind, *spare, baud, tell)
            else:
                why = apply_fix(Transactions(port, kind.family), fix)
            yield f"{finding.where}: {fix}: {f'not done, {why}' if why else 'done'}"
