"""The bus of one run: real ports, emulated servos (on a pseudo-terminal or here), or ideal ones."""

import hashlib
from collections.abc import Mapping

from gazerig.config.rig import Rig
from gazerig.drivers.serial.list_ports import check_owner, serial_ports
from gazerig.robot.app.bus_wiring import guarded_rig_bus, ports_of, rig_bus
from gazerig.robot.app.emulation import emulated_lines, ideal_bus, place_of
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_parts import RunBus, TrueSteps
from gazerig.robot.model.clock import Clock
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.ideal.bus import IdealBus
from gazerig.sim_mock.pty.client import PtyBuses, has_terminals


def run_bus(rig: Rig, options: RunOptions, clock: Clock) -> RunBus:
    """Return the real port, ideal servos, or an emulated bus here or on a pseudo-terminal.

    Without pseudo-terminals the bus is emulated in this process in real time, too.

    Args:
        rig: of the servos.
        options: of the run, with their replacement.
        clock: of the run.
    """
    if not options.mock:
        paths, here = ports_of(rig, options.port), serial_ports()
        for name, path in paths.items():
            check_owner(path, rig.bus_named(name).kind, here)
        return RunBus(guarded_rig_bus(rig, paths))
    if options.bus == "ideal":
        return without_wires(rig, ideal_bus(rig, clock.now_s))
    lines = emulated_lines(rig)
    if not options.fast and has_terminals():
        buses = PtyBuses()
        paths = buses.start(lines)
        return RunBus(guarded_rig_bus(rig, paths), close=buses.stop, fault=buses.command)
    return in_process(rig, {name: build(line, clock.now_s) for name, line in lines.items()})


def without_wires(rig: Rig, ideal: IdealBus) -> RunBus:
    """Return ideal servos of a rig, with their true positions."""
    names = rig.names
    return RunBus(ideal, lambda: dict(zip(names, ideal.positions_steps(), strict=True)))


def in_process(rig: Rig, devices: Mapping[str, Device]) -> RunBus:
    """Return emulated devices in this process, by the name of their bus, with a digest."""
    from gazerig.sim_mock.in_process_port import InProcessPort

    sent = hashlib.sha256()
    ports = {name: InProcessPort(device, sent.update) for name, device in devices.items()}
    return RunBus(rig_bus(rig, ports), _true_steps(rig, devices), sent.hexdigest)


def _true_steps(rig: Rig, devices: Mapping[str, Device]) -> TrueSteps:
    """Return the reader of the shafts of emulated devices; ``devices``: by the name of the bus."""
    places = tuple((name, rig.joints[name].bus, place_of(rig, name)) for name in rig.names)

    def now() -> dict[str, float]:
        steps = {bus: device.positions_steps() for bus, device in devices.items()}
        return {name: steps[bus][place] for name, bus, place in places}

    return now
