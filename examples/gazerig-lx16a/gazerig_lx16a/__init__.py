"""Hiwonder LX-16A bus servos for gazerig."""

from gazerig.drivers.plugins import BusPlugin
from gazerig_lx16a.bus import MODEL, Lx16aBus, Lx16aParams, release
from gazerig_lx16a.emulated import device

LX16A = BusPlugin(
    make=Lx16aBus,
    params=Lx16aParams,
    models={"lx-16a": MODEL},
    device=device,
    release=release,
)
