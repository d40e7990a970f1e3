"""The command calibrate mass: mass and balance of a head from the loads of its neck."""

from typing import Annotated, Any

import numpy as np
import typer

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.bringup.calibration.mass_calibration import (
    SWEPT,
    HeadBalance,
    LoadRecorder,
    fit_balance,
    sweep,
)
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.features.bringup.cli.manual_session import holding_rig, holding_text
from gazerig.features.bringup.cli.ports import MockOption, PortOption, rig_ports
from gazerig.features.bringup.cli.prompts import Lines, TerminalPerson
from gazerig.features.bringup.cli.rig_writer import (
    AllYesOption,
    DryRunOption,
    OutOption,
    refuse_unwritable,
    show_and_write,
)
from gazerig.features.bringup.manual_control import JogParams
from gazerig.robot.app.rig_description import description_of, statics_of
from gazerig.robot.cli.terminal import FAULT, RigArgument, clear_errors, record_signals, say
from gazerig.robot.description.mass import head_mass_kg


def calibrate_mass(
    rig: RigArgument = "desk",
    weight_kg: Annotated[
        float | None,
        typer.Option(
            "--weight-kg",
            min=0.01,
            max=50.0,
            help="Weight of the head with eyes and lids, without counterweights, from a scale.",
        ),
    ] = None,
    speed: Annotated[
        float, typer.Option(metavar="DEG_S", min=5.0, max=30.0, help="Top speed of the sweeps.")
    ] = 15.0,
    out: OutOption = None,
    dry_run: DryRunOption = False,
    yes: AllYesOption = False,
    mock: MockOption = False,
    port: PortOption = None,
) -> None:
    """Measure the head's balance: it nods and tilts slowly, and its servos report their loads."""
    with clear_errors(rig, port, mock), record_signals() as stopped:
        loaded = load_rig(rig)
        refuse_unmeasurable(loaded)
        if not dry_run:
            refuse_unwritable(rig, out)
        statics = statics_of(loaded, of_neck=True)
        recorder = LoadRecorder(statics)
        params = JogParams(speed_deg_s=speed, near_deg=3.0, timeout_s=5.0)
        try:
            with (
                rig_ports(loaded, mock, port) as wire,
                holding_rig(
                    loaded, wire.paths, params, stopped, stopped, watch=recorder.watch
                ) as control,
            ):
                say(f"{holding_text(loaded)}; the head nods and tilts slowly; Ctrl-C ends it")
                sweep(control, statics, recorder)
        except CalibrationStopped as why:
            say(f"stopped by {why}: nothing written")
            raise typer.Exit(FAULT) from None
        found = fit_balance(recorder.samples, statics, description_of(loaded, looks=False))
        changes = mass_changes(loaded, found, weight_kg)
        friction = ", ".join(f"{name} {nm:.3f} Nm" for name, nm in found.friction_nm.items())
        say(
            f"{len(recorder.samples)} loads, {found.rest_nm * 1e3:.0f} mNm left by the fit; "
            f"friction {friction}"
        )
        if weight_kg is None and found.mass_kg is None:
            say(
                f"the loads give mass times distance; the mass of {changes['mass.head.mass_kg']:g} "
                "kg is the rig's: weigh the head and give --weight-kg"
            )
        person = TerminalPerson(Lines(None), stopped, yes)
        show_and_write(rig, loaded, changes, out, dry_run, person)


def refuse_unmeasurable(rig: Rig) -> None:
    """Refuse a rig whose neck cannot be measured.

    Raises:
        SetupError: the message has the reason.
    """
    necks = [name for name in SWEPT if name in rig.joints]
    if "neck_pitch" not in necks:
        raise SetupError("no neck_pitch: nothing measures the head's balance; weigh it (mass.head)")
    blind = [name for name in necks if not rig.joints[name].model_facts.measures_position]
    if blind:
        raise SetupError(f"{', '.join(blind)}: a hobby servo reports no load; weigh the head")
    coupled = {one.first for one in rig.couplings.values()} & {*necks}
    if coupled:
        raise SetupError(
            f"{', '.join(coupled)}: two servos share its load, which is not measured: weigh the head"
        )


def mass_changes(rig: Rig, found: HeadBalance, weight_kg: float | None) -> dict[str, Any]:
    """Return the values of a rig file that follow from the loads.

    Args:
        rig: the rig, with known counterweights.
        found: balance of the head, including its counterweights.
        weight_kg: mass of the head from a scale.
    """
    weights = [one for one in rig.mass.counterweights.values() if one.link == "head"]
    moment = np.array(found.moment_kg_m)
    for one in weights:
        moment -= one.mass_kg * np.array(one.position_mm) / 1e3
    kg = weight_kg
    if kg is None and found.mass_kg is not None:
        kg = found.mass_kg - sum(one.mass_kg for one in weights)
    if kg is None:
        kg = head_mass_kg(rig.mass, rig.geometry.interocular_mm / 1e3)
    x, y, z = (round(1e3 * value / kg, 1) + 0.0 for value in moment.tolist())
    changes: dict[str, Any] = {
        "mass.head.mass_kg": round(kg, 3),
        "mass.head.com_mm": (x, y, z),
    }
    return changes
