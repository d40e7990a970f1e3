"""What is wrong with a serial port, judged by what the system tells of it. It is not opened.

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
    holders,
    latency_file,
    latency_ms,
    serial_ports,
)
from gazerig.features.bringup.doctor.diagnostics import Diagnostic

UDEV_FILE = "/etc/udev/rules.d/99-servo-bus.rules"
UDEV_RULE = (
    'ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", '
    f'ATTR{{latency_timer}}="{RECOMMENDED_LATENCY_MS}"'
)


class PortFacts(NamedTuple):
    """What the system tells of one port.

    holders: other programs that hold it; others: the ports there are
    """

    device: str
    access: Access
    holders: tuple[str, ...]
    others: Sequence[SerialPort]


def port_facts(device: str, host: Host) -> PortFacts:
    """Return what the operating system knows of a port."""
    return PortFacts(device, access(device), holders(device, host), serial_ports(host))


def examine_port(facts: PortFacts) -> list[Diagnostic]:
    """Judge a port; with an error among the findings it cannot be used."""
    trouble = [finding for finding in (_there(facts), _free(facts)) if finding is not None]
    if trouble:
        return trouble[:1]
    lasting = next((p.by_id for p in facts.others if p.device == facts.device and p.by_id), None)
    findings = [Diagnostic("ok", "is there and may be opened", facts.device)]
    if lasting is not None:
        findings.append(
            Diagnostic("note", "may be called otherwise after replugging", facts.device,
                    f"write {lasting} into the YAML's bus.port")
        )  # fmt: skip
    return findings


def name_ports(ports: Sequence[SerialPort]) -> str:
    """List ports for people."""
    named = [f"{port.by_id or port.device} ({port.description})" for port in ports]
    return ", ".join(named) or "none"


def _there(facts: PortFacts) -> Diagnostic | None:
    device, access = facts.device, facts.access
    if not access.exists:
        return Diagnostic(
            "error",
            "there is no such port",
            device,
            f"plug the adaptor in; ports here: {name_ports(facts.others)}; then name one with "
            "--port or in the YAML's bus.port",
        )
    if not access.serial:
        return Diagnostic("error", "is no serial port", device, "name one of gazerig scan")
    if access.allowed:
        return None
    again = "log out and in again, this session began before you joined the group"
    cure = again if access.joined else f"sudo usermod -aG {access.group} $USER, then log out and in"
    return Diagnostic("error", f"may be used by the group {access.group} only", device, cure)


def _free(facts: PortFacts) -> Diagnostic | None:
    if not facts.holders:
        return None
    named = ", ".join(facts.holders)
    return Diagnostic("error", f"is held open by {named}", facts.device, "end it first")


def examine_latency(device: str, host: Host) -> list[Diagnostic]:
    """Judge the latency timer of an adaptor; nothing where it has none."""
    file = latency_file(device, host)
    if file is None:
        return []
    ms = latency_ms(file)
    if ms is None:
        return [Diagnostic("note", "its latency timer cannot be read", device, f"look into {file}")]
    if ms <= RECOMMENDED_LATENCY_MS:
        return [Diagnostic("ok", f"hands answers over after {ms} ms (latency timer)", device)]
    return [
        Diagnostic(
            "warn",
            f"keeps short answers back for {ms} ms (latency timer): about "
            f"{1000 // (ms or 1)} readings a second at most",
            device,
            f"now: echo {RECOMMENDED_LATENCY_MS} | sudo tee {file}; for good, in {UDEV_FILE}: "
            f"{UDEV_RULE}",
        )
    ]
