"""Bring-up commands: scan, doctor, setup, reboot."""

import typer

from gazerig.robot.cli import doctor, reboot, scan, setup

app = typer.Typer()
for part in (scan, doctor, setup, reboot):
    app.add_typer(part.app)
