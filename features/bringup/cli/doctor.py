"""The command ``gazerig doctor``: examines every bus of a rig, and applies safe fixes."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Annotated

import typer

from gazerig.config.rig import BusConfig, Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.serial.port import BusPort, port_at_path
from gazerig.drivers.types import ServoConfig
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.model_files import detector_status
from gazerig.features.bringup.cli import ports as bench
from gazerig.features.bringup.cli.ports import (
    JsonOption,
    MockOption,
    PortOption,
    bus_label,
    clear_progress,
    console,
    progress,
    refuse_packages,
    rig_ports,
    setups_on,
)
from gazerig.features.bringup.doctor import examination as checkup
from gazerig.features.bringup.doctor.boards import examine_maestro, examine_pca9685
from gazerig.features.bringup.doctor.diagnostics import (
    Diagnostic,
    Fix,
    finding_json,
    group_findings,
    summarize,
    worst_level,
)
from gazerig.features.bringup.doctor.servo_rules import apply_fix
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.robot.app.bus_wiring import can_be_released, release_plan
from gazerig.robot.app.rig_weight import weight_findings
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, complete_suggestions
from gazerig.robot.safety.start_range import find_far_outside

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
        with rig_ports(model, mock, port) as wired:
            lines = {name: port_at_path(path) for name, path in wired.paths.items()}
            findings = _examine_buses(model, lines, tell)
            if fix:
                _apply_fixes(model, lines, findings, tell)
                if any(checkup.is_adoption(one) for some in findings.values() for one in some):
                    # The settings of a new servo are those of the factory.
                    findings = _examine_buses(model, lines, lambda _: None)
                    _apply_fixes(model, lines, findings, tell)
                tell("after that:")
                findings = _examine_buses(model, lines, tell)
        eyes = [examine_detector(model.detector)]
        eyes += [
            Diagnostic(level, what, joint, cure)
            for level, joint, what, cure in weight_findings(model)
        ]
        show_findings(eyes, tell)
        if as_json:
            rows = [finding_json(one, bus) for bus, some in findings.items() for one in some]
            rows += [finding_json(one, "") for one in eyes]
            rows = [row | {"cure": complete_suggestions(str(row["cure"]))} for row in rows]
            print(json.dumps(rows))
        whole = [*(one for some in findings.values() for one in some), *eyes]
        tell(summarize(whole, rig, fix))
    if worst_level(whole) == "error":
        raise typer.Exit(FAULT)


def examine_detector(params: FaceDetectorParams) -> Diagnostic:
    """Return the finding about the detectors of faces and people, with its remedy."""
    text, cure = detector_status(params)
    return Diagnostic("note" if cure else "ok", text, "detector", cure)


def _examine_buses(
    rig: Rig, lines: Mapping[str, BusPort], tell: Tell
) -> dict[str, list[Diagnostic]]:
    """Examine every bus, and print the findings; return them by bus."""
    findings = {}
    for bus, line in lines.items():
        config, setups = rig.bus_named(bus), setups_on(rig, bus)
        if config.kind in BOARDS:
            examine = partial(BOARDS[config.kind], line, config, setups)
        else:
            kind = servo_kind(setups[0].model)
            far = partial(find_far_outside, rig.joints, rig.couplings.values())
            examine = partial(
                checkup.examine_bus, line, kind, setups, config.section.baud, progress, far
            )
        findings[bus] = checkup.examine_port(line, examine)
        if can_be_released(rig, bus):
            findings[bus].append(checkup.examine_guardian(release_plan(rig, bus, line.port_name)))
        clear_progress()
        if len(lines) > 1:
            tell(f"{bus_label(rig, bus)} ({config.kind}, {line.port_name}):")
        show_findings(findings[bus], tell)
    return findings


BOARDS: Mapping[str, Callable[[BusPort, BusConfig, Sequence[ServoConfig]], list[Diagnostic]]] = {
    "maestro": lambda line, config, setups: examine_maestro(
        line, config.maestro, setups, bench.usb_id(line.port_name)
    ),
    "pca9685": lambda line, config, setups: examine_pca9685(line, config.pca9685, setups),
}
"""Examinations of boards, by the kind of bus."""


def _print_line(line: str) -> None:
    """Print a line; all lines are written to one stream, which keeps their order."""
    level, space, rest = complete_suggestions(line).partition(" ")
    out = console()
    if level in STYLES:
        out.print(f"[{STYLES[level]}]{level:5}[/]", end=space)
        out.print(rest, markup=False)
    else:
        out.print(complete_suggestions(line), markup=False)


def _apply_fixes(
    rig: Rig, lines: Mapping[str, BusPort], findings: Mapping[str, Sequence[Diagnostic]], tell: Tell
) -> None:
    """Apply all fixes, and print each of them."""
    done: list[str] = []
    for bus, line in lines.items():
        if any(finding.fixes for finding in findings[bus]):
            write = partial(_write_fix, line, rig.bus_named(bus), setups_on(rig, bus))
            done += checkup.apply_fixes(write, findings[bus])
            line.closePort()
    for one in done:
        tell(one)
    if not done:
        tell("nothing that --fix may mend")


def _write_fix(line: BusPort, config: BusConfig, setups: Sequence[ServoConfig], fix: Fix) -> str:
    """Write one fix; return "" or the reason of a failure."""
    kind, baud = servo_kind(setups[0].model), config.section.baud
    if fix.register == checkup.ADOPT:
        return checkup.adopt_spare(line, kind, fix, setups, baud, progress)
    line.setBaudRate(baud)
    return apply_fix(line, kind, fix)


def show_findings(findings: Sequence[Diagnostic], tell: Tell) -> None:
    """Print findings, the worst first; equal findings of several servos are printed once."""
    for level, where, what, cure in group_findings(findings):
        tell(f"{level} {where}: {what}")
        if cure:
            tell(f"      -> {cure}")
