"""Servos without bytes for the tests of what is above the bus.

`with ideal_buses():` has every robot that is assembled inside it, and says nothing of its bus, on
`--bus ideal`; half the processor time of a simulated run goes into packets and motors otherwise.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest

from gazerig.config.schema import Rig
from gazerig.robot.model.clock import Clock
from gazerig.robot.run import run
from gazerig.robot.run.buses import RunBus, run_bus
from gazerig.robot.run.options import RunOptions


def _ideal(rig: Rig, options: RunOptions, clock: Clock) -> RunBus:
    if options.fast and options.bus is None:
        options = replace(options, bus="ideal")
    return run_bus(rig, options, clock)


@contextmanager
def ideal_buses() -> Iterator[None]:
    """Have robots that are assembled meanwhile, in simulated time, on ideal servos."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "run_bus", _ideal)
        yield
