"""Faults of a serial port, by what the operating system reports. It is not opened.

Source of the latency timer: ROBOTIS e-Manual, U2D2 (FTDI adaptors wait 16 ms by default).
"""

from collections.abc import Sequence
from typing import NamedTuple

from gazerig.drivers.serial.list_ports import (
    RECOMMENDED_LATENCY_MS,
    Access,
    Host,
    SerialPort,
    access,
    latency_file,
    latency_ms,
    port_users,
    serial_ports,
)
from gazerig.features.bringup.doctor.diagnostics import Advice, Diagnostic

UDEV_FILE = "/etc/udev/rules.d/99-servo-bus.rules"
UDEV_RULE = (
    'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", '
    f'ATTR{{latency_timer}}="{RECOMMENDED_LATENCY_MS}"'
)


# fmt: off
ADVICE = {
    "well": Advice("ok", "is there and may be opened"),
    "name": Advice("note", "may be called otherwise after replugging",
        "write {name} into the YAML's bus.port"),
    "absent": Advice("error", "there is no such port", "plug the adaptor in; ports here: {ports}; "
        "then name one with --port or in the YAML's bus.port"),
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
    """Report of the operating system on one port.

    holders: other programs that hold it; others: the ports there are
    """

    device: str
    access: Access
    holders: tuple[str, ...]
    others: Sequence[SerialPort]


def port_facts(device: str, host: Host) -> PortFacts:
    """Return what the operating system knows of a port."""
    return PortFacts(device, access(device), port_users(device, host), serial_ports(host))


def examine_port(facts: PortFacts) -> list[Diagnostic]:
    """Return the findings about a port; with an error among them it cannot be used."""
    device, access = facts.device, facts.access
    trouble = ""
    if not access.exists:
        trouble = "absent"
    elif not access.serial:
        trouble = "no port"
    elif not access.allowed:
        trouble = "joined" if access.joined else "group"
    elif facts.holders:
        trouble = "held"
    if trouble:
        here, holders = name_ports(facts.others), ", ".join(facts.holders)
        return [ADVICE[trouble].at(device, ports=here, group=access.group, holders=holders)]
    lasting = next((p.by_id for p in facts.others if p.device == device and p.by_id), None)
    findings = [ADVICE["well"].at(device)]
    if lasting is not None:
        findings.append(ADVICE["name"].at(device, name=lasting))
    return findings


def name_ports(ports: Sequence[SerialPort]) -> str:
    """List ports for people."""
    named = [f"{port.by_id or port.device} ({port.description})" for port in ports]
    return ", ".join(named) or "none"


def examine_latency(device: str, host: Host) -> list[Diagnostic]:
    """Return the finding about an adaptor's latency timer, none without such a timer."""
    file = latency_file(device, host)
    if file is None:
        return []
    ms = latency_ms(file)
    if ms is None:
        return [ADVICE["unread"].at(device, file=file)]
    advice = ADVICE["quick" if ms <= RECOMMENDED_LATENCY_MS else "slow"]
    return [advice.at(device, ms=ms, file=file, rate=1000 // (ms or 1), rule=UDEV_RULE)]
