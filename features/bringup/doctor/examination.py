"""Examination of a whole bus of a rig: its servos, their baud rates and their faults.

The examination only reads; ``apply_fixes`` writes the fixes of the findings, to servos whose torque
is off, and moves nothing.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import DriverError, PortError, ServoFault, ServoMissing, SetupError
from gazerig.drivers.serial.list_ports import (
    ABSENT_I2C_REMEDY,
    RECOMMENDED_LATENCY_MS,
    Access,
    Host,
    SerialPort,
    access,
    i2c_names_text,
    is_i2c,
    latency_file,
    latency_ms,
    port_users,
    serial_ports,
)
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import (
    ANSWERS,
    SHARED,
    FoundServo,
    count_corrupt,
    ping,
)
from gazerig.drivers.servo_bus.registers import Registers
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import Advice, Diagnostic, Fix, worst_level
from gazerig.features.bringup.doctor.servo_checks import CHECKS
from gazerig.features.bringup.doctor.servo_rules import apply_rules, read_state
from gazerig.features.bringup.servo_kinds import ServoKind, Tell
from gazerig.features.bringup.servo_setup import (
    Answers,
    Spare,
    assign_servo,
    find_spare,
    search_rates,
)
from gazerig.robot.guardian.guardian import Guardian
from gazerig.robot.guardian.release_plan import ReleasePlan, describe

# fmt: off
ADVICE = {
    "nobody": Advice("error", "no servo answers, at {baud} bit/s or any other rate",
        "{kind.no_reply} gazerig scan asks other kinds of servos, too"),
    "elsewhere": Advice("error", "answers at {found.baud} bit/s, the rig's rate is {baud}",
        "connect it alone and run gazerig setup --joint {setup.name}"),
    "spare": Advice("error", "does not answer, but a new {setup.model} does (id {found.id} at "
        "{found.baud} bit/s)", "gazerig doctor --fix gives that one id {setup.id} and {baud} bit/s; "
        "then gazerig calibrate --joint {setup.name}, as its zero is another"),
    "pieces": Advice("error", "answers in pieces only: two servos share its id, or a plug is loose",
        "connect it alone and look with gazerig scan"),
    "spares": Advice("warn", "at {baud} bit/s answers came in pieces: two new servos with one id?",
        "connect one of them alone and run gazerig setup"),
    "silent": Advice("error", "does not answer",
        "check its two plugs; is its id set? gazerig setup, with it connected alone, reports it"),
    "new": Advice("warn",
        "servo {found.id} ({found.model}) answers at {found.baud} bit/s and is none of the missing "
        "({missing})", "a new one? connect it alone and run gazerig setup"),
    "stranger": Advice("warn", "servo {found.id} ({found.model}) answers and is not in the YAML",
        "take it off the bus, or give it the id of a joint with gazerig setup"),
}
# fmt: on


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


def examine_ports(
    port: BusPort, host: Host, examine: Callable[[], list[Diagnostic]]
) -> list[Diagnostic]:
    """Examine a port and, if it can be used, its servos; the port is closed at the end.

    A failure of the examination is one of the findings.

    examine: queries the devices on the port
    """
    device = port.port_name
    findings = examine_port(port_facts(device, host))
    if worst_level(findings) == "error":
        return findings
    try:
        behind = examine()
        # While it is open: the program itself sets the adaptor to low latency then.
        return [*findings, *examine_latency(device, host), *behind]
    except DriverError as error:
        # The message has the port and the remedy.
        return [Diagnostic("error", str(error).removeprefix(device).lstrip(": "), device)]
    finally:
        port.closePort()


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
    if presence.missing and not presence.present and not presence.elsewhere.found:
        return [ADVICE["nobody"].at("the bus", baud=baud, kind=kind)]
    if presence.spare is not None:
        found, setup = presence.spare
        fix = Fix(found.id, ADOPT, setup.id, found.id)
        facts = {"setup": setup, "found": found, "baud": baud}
        findings = [ADVICE["spare"].at(servo_label(setup), fix, **facts)]
    else:
        findings = _absences(presence, kind, baud)
    states, registers = [], Registers(port, kind.family)
    for setup in setups:
        if setup.id in presence.present:
            tell(f"reading {servo_label(setup)}")
            found, is_shared = presence.present[setup.id], setup.id in presence.shared_ids
            states.append(read_state(registers, CHECKS[kind.family.name], setup, found, is_shared))
    far = find_far({s.setup.name: s.position for s in states if s.position is not None})
    for state in states:
        findings += apply_rules(replace(state, far=far.get(state.setup.name, "")))
    if presence.present:
        findings += [Diagnostic("note", note, "the bus") for note in kind.notes]
    return findings


def _absences(presence: Presence, kind: ServoKind, baud: int) -> list[Diagnostic]:
    """Return the findings about missing and unexpected servos without a fitting spare."""
    at, findings = {found.id: found for found in presence.elsewhere.found}, []
    for setup in presence.missing:
        other = at.pop(setup.id, None)
        cause = "elsewhere" if other else "pieces" if setup.id in presence.shared_ids else "silent"
        findings.append(ADVICE[cause].at(servo_label(setup), setup=setup, found=other, baud=baud))
    missing = ", ".join(f"{servo_label(setup)}: {setup.model}" for setup in presence.missing)
    findings += [ADVICE["new"].at("the bus", found=found, missing=missing) for found in at.values()]
    if kind.family.factory_baud in presence.elsewhere.spoilt_bauds:
        findings.append(ADVICE["spares"].at("the bus", baud=kind.family.factory_baud))
    findings += [ADVICE["stranger"].at("the bus", found=found) for found in presence.unexpected]
    return findings


def find_servos(
    port: BusPort, kind: ServoKind, setups: Sequence[ServoConfig], baud: int, tell: Tell
) -> Presence:
    """Find the servos on the bus; the port is left open at the rig's baud rate.

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.
    """
    _open(port, baud)
    answers = [*search_rates(port, kind, (baud,), tell, thorough=True).found]
    there = {found.id: found for found in answers}
    shared = {found.id for found in answers if answers.count(found) > 1}
    for setup in setups:
        if setup.id not in there:
            tell(f"asking {servo_label(setup)}")
            found = ping(port, kind.family, setup.id, baud, 2)
            if found is not None:
                there[setup.id] = found
                answers.append(found)
            tries = ANSWERS if found else 1
            if count_corrupt(port, kind.family, setup.id, tries) >= min(SHARED, tries):
                shared.add(setup.id)
    missing = tuple(setup for setup in setups if setup.id not in there)
    known = {setup.id for setup in setups}
    strangers = tuple(found for i, found in sorted(there.items()) if i not in known)
    others = [rate for rate in kind.family.scan_rates if rate != baud and missing]
    elsewhere = search_rates(port, kind, others, tell)
    spare = find_spare(port, kind, setups, baud, [*answers, *elsewhere.found])
    _open(port, baud)
    return Presence(there, missing, strangers, elsewhere, shared, spare)


def _open(port: BusPort, baud: int) -> None:
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s: choose 57600 or 1000000")


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
    _open(port, factory_baud)
    spare = ping(port, kind.family, fix.servo_id, factory_baud)
    if spare is None:
        return "the servo does not answer"
    setup = next(one for one in setups if one.id == fix.value)
    try:
        assign_servo(port, kind, spare, setup, baud, tell)
    except (ServoFault, ServoMissing) as error:
        return str(error)
    return ""


def is_adoption(finding: Diagnostic) -> bool:
    """Return whether the fix of a finding gives a new servo its id."""
    return any(fix.register == ADOPT for fix in finding.fixes)


# --- the guardian


def examine_guardian(plan: ReleasePlan) -> Diagnostic:
    """Start a guardian, end it again, and return its planned actions; nothing is sent.

    Args:
        plan: servos that it would release.
    """
    guardian = Guardian((plan,))
    try:
        guardian.join(0)
        guardian.wait_until_ready()
    except SetupError as error:
        return Diagnostic("error", str(error), "guardian", "torque stays off until it starts")
    finally:
        guardian.leave(0)
    return Diagnostic(
        "ok", f"{describe(plan)} within .5 s if the program dies or hangs", "guardian"
    )


# --- Faults of a serial port, as the operating system reports them. It is not opened
# Source of the latency timer: ROBOTIS e-Manual, U2D2 (FTDI adaptors wait 16 ms by default).


UDEV_FILE = "/etc/udev/rules.d/99-servo-bus.rules"
UDEV_RULE = (
    'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", '
    f'ATTR{{latency_timer}}="{RECOMMENDED_LATENCY_MS}"'
)


# fmt: off
PORT_ADVICE = {
    "well": Advice("ok", "is there and may be opened"),
    "name": Advice("note", "may be called otherwise after replugging",
        "write {name} into the YAML's bus.port"),
    "absent": Advice("error", "there is no such port", "plug the adaptor in; ports here: {ports}; "
        "then name one with --port or in the YAML's bus.port"),
    "no bus": Advice("error", "there is no such I2C bus", "{switch}; buses here: {buses}; then name "
        "one with --port or in the YAML's bus.port"),
    "no port": Advice("error", "is no serial port", "name one of gazerig scan"),
    "joined": Advice("error", "may be used by the group {group} only",
        "log out and in again, this session began before you joined the group"),
    "group": Advice("error", "may be used by the group {group} only",
        "sudo usermod -aG {group} $USER, then log out and in"),
    "held": Advice("error", "is held open by {holders}", "end it first"),
    "unread": Advice("note", "its latency timer cannot be read", "look into {file}"),
    "quick": Advice("ok", "hands answers over after {ms} ms (latency timer)"),
    "slow": Advice("warn", "keeps short answers back for {ms} ms (latency timer): about {rate} "
        "readings a second at most",
        f"now: echo {RECOMMENDED_LATENCY_MS} | sudo tee {{file}}; for good, in {UDEV_FILE}: "
        "{rule}"),
}
# fmt: on


class PortFacts(NamedTuple):
    """Properties of one port, from the operating system.

    holders: other programs that use it; other_ports: the existing ports
    """

    device: str
    access: Access
    holders: tuple[str, ...]
    other_ports: Sequence[SerialPort]


def port_facts(device: str, host: Host) -> PortFacts:
    """Return the operating system's properties of a port."""
    return PortFacts(device, access(device), port_users(device, host), serial_ports(host))


def examine_port(facts: PortFacts) -> list[Diagnostic]:
    """Return the findings about a port; with an error among them it cannot be used."""
    device, access = facts.device, facts.access
    trouble = ""
    if not access.exists:
        if is_i2c(device):
            return [
                PORT_ADVICE["no bus"].at(device, switch=ABSENT_I2C_REMEDY, buses=i2c_names_text())
            ]
        trouble = "absent"
    elif not access.is_device:
        trouble = "no port"
    elif not access.allowed:
        trouble = "joined" if access.is_member else "group"
    elif facts.holders:
        trouble = "held"
    if trouble:
        here, holders = name_ports(facts.other_ports), ", ".join(facts.holders)
        return [PORT_ADVICE[trouble].at(device, ports=here, group=access.group, holders=holders)]
    lasting = next((p.by_id for p in facts.other_ports if p.device == device and p.by_id), None)
    findings = [PORT_ADVICE["well"].at(device)]
    if lasting is not None:
        findings.append(PORT_ADVICE["name"].at(device, name=lasting))
    return findings


def name_ports(ports: Sequence[SerialPort]) -> str:
    """Format a list of ports for people."""
    named = [f"{port.by_id or port.device} ({port.description})" for port in ports]
    return ", ".join(named) or "none"


def examine_latency(device: str, host: Host) -> list[Diagnostic]:
    """Return the finding about an adaptor's latency timer, none without such a timer."""
    file = latency_file(device, host)
    if file is None:
        return []
    ms = latency_ms(file)
    if ms is None:
        return [PORT_ADVICE["unread"].at(device, file=file)]
    advice = PORT_ADVICE["quick" if ms <= RECOMMENDED_LATENCY_MS else "slow"]
    return [advice.at(device, ms=ms, file=file, rate=1000 // (ms or 1), rule=UDEV_RULE)]
