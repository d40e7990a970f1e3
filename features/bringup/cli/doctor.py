"""The command ``gazerig doctor``: examines every bus of a rig, and applies safe fixes."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated

import msgspec
import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.model_files import detector_status
from gazerig.features.bringup.cli.ports import (
    JsonOption,
    MockOption,
    PortOption,
    bus_label,
    console,
    progress,
    refuse_packages,
    rig_ports,
    setups_on,
    unopened_port,
    usb_id,
)
from gazerig.features.bringup.doctor import examination as checkup
from gazerig.features.bringup.doctor.boards import examine_maestro, examine_pca9685
from gazerig.features.bringup.doctor.diagnostics import (
    Diagnostic,
    group_findings,
    summarize,
    worst_level,
)
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, complete_suggestions
from gazerig.robot.model.coupling import find_far_outside
from gazerig.robot.run.rig_description import neck_loads
from gazerig.robot.run.rig_limits import bus_names

app = typer.Typer()

STYLES = {"ok": "green", "note": "cyan", "warn": "yellow", "error": "bold red"}

Tell = Callable[[str], None]


@app.command()
def doctor(
    rig: RigArgument = "desk",
    port: PortOption = None,
    mock: MockOption = False,
    fix: Annotated[
        bool,
        typer.Option("--fix", help="Apply the safe fixes; the torque stays off, nothing moves."),
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Check every port and servo against the rig's YAML; every finding comes with a remedy."""
    with clear_errors(rig, port, mock):
        model = load_rig(rig)
        refuse_packages(model, "doctor")
        tell: Tell = (lambda _: None) if as_json else _print_line
        findings: list[Diagnostic] = []
        with rig_ports(model, mock, port) as wired:
            for bus, path in wired.paths.items():
                with unopened_port(path) as line:
                    findings += _examine_and_fix(model, bus, line, fix, tell)
        eyes = [examine_detector(model.detector)]
        eyes += [
            Diagnostic("warn" if remedy else "note", what, joint, remedy)
            for joint, what, remedy in neck_loads(model)
        ]
        show_findings(eyes, tell)
        findings += eyes
        if as_json:
            rows = [
                msgspec.structs.replace(one, remedy=complete_suggestions(one.remedy))
                for one in findings
            ]
            print(msgspec.json.encode(rows).decode())
        tell(summarize(findings, rig, fix))
    if worst_level(findings) == "error":
        raise typer.Exit(FAULT)


def examine_detector(params: FaceDetectorParams) -> Diagnostic:
    """Return the finding about the detectors of faces and people, with its remedy."""
    text, remedy = detector_status(params)
    return Diagnostic("note" if remedy else "ok", text, "detector", remedy)


def _examine_and_fix(rig: Rig, bus: str, line: BusPort, fix: bool, tell: Tell) -> list[Diagnostic]:
    """Examine one bus, apply its fixes if wanted, and print all findings; return the last ones."""
    findings = _examine(rig, bus, line)
    if len(bus_names(rig)) > 1:
        tell(f"{bus_label(rig, bus)} ({rig.bus_named(bus).kind}, {line.port_name}):")
    show_findings(findings, tell)
    if not fix:
        return findings
    done = []
    if any(finding.fixes for finding in findings):
        setups, baud = setups_on(rig, bus), rig.bus_named(bus).section.baud
        kind = servo_kind(setups[0].model)
        done = list(checkup.apply_fixes(line, kind, setups, baud, findings, progress))
        line.closePort()
    for text in done or ["nothing that --fix may mend"]:
        tell(text)
    tell("after that:")
    findings = _examine(rig, bus, line)
    show_findings(findings, tell)
    return findings


def _examine(rig: Rig, bus: str, line: BusPort) -> list[Diagnostic]:
    config, setups = rig.bus_named(bus), setups_on(rig, bus)
    if config.kind == "maestro":
        usb = usb_id(line.port_name)
        examine = partial(examine_maestro, line, config.maestro, setups, usb)
    elif config.kind == "pca9685":
        examine = partial(examine_pca9685, line, config.pca9685, setups)
    else:
        kind = servo_kind(setups[0].model)
        far = partial(find_far_outside, rig.joints, rig.couplings.values())
        baud = config.section.baud
        examine = partial(checkup.examine_bus, line, kind, setups, baud, progress, far)
    findings = checkup.examine_port(line, examine)
    progress()
    return [msgspec.structs.replace(one, bus=bus) for one in findings]


def _print_line(line: str) -> None:
    """Print a line; all lines are written to one stream, which keeps their order."""
    text, out = complete_suggestions(line), console()
    level, space, rest = text.partition(" ")
    if level in STYLES:
        out.print(f"[{STYLES[level]}]{level:5}[/]", end=space)
        text = rest
    out.print(text, markup=False)


def show_findings(findings: Sequence[Diagnostic], tell: Tell) -> None:
    """Print findings, the worst first; equal findings of several servos are printed once."""
    for level, where, what, remedy in group_findings(findings):
        tell(f"{level} {where}: {what}")
        if remedy:
            tell(f"      -> {remedy}")
