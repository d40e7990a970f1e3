"""Dynamixel X servos on one serial bus (Protocol 2.0)."""

from collections.abc import Mapping, Sequence
from math import ceil
from struct import pack

from gazerig.drivers.dynamixel.control_table import (
    FAST_READ_SINCE,
    MODELS,
    WATCHDOG_UNIT_S,
    IndirectBlock,
    indirect_blocks,
)
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.feedback import DynamixelFeedback
from gazerig.drivers.dynamixel.params import DynamixelParams as DynamixelParams
from gazerig.drivers.dynamixel.protocol import ERROR_NUMBER, HEADER
from gazerig.drivers.dynamixel.read_windows import (
    INDIRECT_MAP,
    Sample,
    View,
    alone_turns,
    direct_turns,
    indirect_turns,
)
from gazerig.drivers.dynamixel.supervisor import DynamixelSupervisor
from gazerig.drivers.dynamixel.sync_packets import FastGroup, PlainGroup
from gazerig.drivers.port_bus import CUT
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.bus import RESTART_S, SmartServoBus
from gazerig.drivers.servo_bus.provisioning import AddressMap
from gazerig.drivers.servo_bus.sync_read import Heard, Reader, Whole
from gazerig.drivers.types import ServoSetup


class DynamixelBus(SmartServoBus):
    """A chain of Dynamixel servos in position mode; implements gazerig.drivers.types.ServoBus.

    Args:
        port: gazerig.drivers.serial.port.BlockingPort, or an emulated port with its methods.
        setups: the servos, in the order of every sequence given and taken.
        params: how to speak with them.
    """

    _supervisor: DynamixelSupervisor
    _feedback: DynamixelFeedback

    def __init__(
        self, port: BusPort, setups: Sequence[ServoSetup], params: DynamixelParams
    ) -> None:
        self._params = params
        watchdog = ceil(params.watchdog_ms / 1000.0 / WATCHDOG_UNIT_S)
        super().__init__(port, setups, DYNAMIXEL, params, watchdog)

    def _assemble_family(self, firmware: Mapping[int, int] | None) -> None:
        block = self._common_block(firmware)
        self._feedback = DynamixelFeedback(self._setups)
        together = indirect_turns(block) if block else direct_turns()
        self._fast = self._all_fast(firmware)
        group = FastGroup if self._fast else PlainGroup
        self._reader: Reader[View, Sample] = Reader(
            self._line, self._roll, together, alone_turns(), group, HEADER
        )
        self._supervisor = DynamixelSupervisor(
            self._line,
            self._by_id,
            self._watchdog,
            self._recovery,
            self._health,
            self._feedback,
            covered=block is not None,
        )

    def _first_look(self) -> None:
        self._supervisor.find_alerts(self._ids)

    def _all_fast(self, firmware: Mapping[int, int] | None) -> bool:
        """Return whether all understand fast sync read."""
        if not firmware or not self._params.fast_sync_read:
            return False
        return all(
            firmware[setup.id] >= FAST_READ_SINCE[MODELS[setup.model].family]
            for setup in self._setups
        )

    def _common_block(self, firmware: Mapping[int, int] | None) -> IndirectBlock | None:
        """Return the indirect block that all have in the same place, None where there is none."""
        if not firmware or not self._params.indirect_block:
            return None
        blocks = [indirect_blocks(MODELS[s.model], firmware[s.id])[0] for s in self._setups]
        same = len({(block.address_base, block.data_base) for block in blocks}) == 1
        return blocks[0] if same else None

    def _address_map(self, firmware: Mapping[int, int] | None) -> AddressMap | None:
        block = self._common_block(firmware)
        if block is None:
            return None
        return AddressMap(block.address_base, pack(f"<{len(INDIRECT_MAP)}H", *INDIRECT_MAP))

    def _read(self, now_s: float) -> None:
        if self._line.starved:
            self._supervisor.recover_tripped(self._roll.group)
        answer = self._reader.read(now_s)
        if not (isinstance(answer, Whole) and self._feedback.take_whole(answer)):
            self._take(answer, now_s)
        elif self._health.returning:
            self._health.heard_again(now_s, self._line.lateness)
        self._supervisor.service(self._roll.group, now_s)

    def _take(self, answer: Whole[Sample] | dict[int, Heard[Sample]], now_s: float) -> None:
        """Take an answer servo by servo, each with its errors."""
        heard = answer.each() if isinstance(answer, Whole) else answer
        self._feedback.begin()
        if heard and self._health.silent_for_s(now_s) >= RESTART_S:
            self._supervisor.mark_all_for_recovery()
        dark = not self._roll.group
        for servo_id, one in heard.items():
            slot = self._slot[servo_id]
            was_out = self._roll.answered(servo_id)
            believed = self._supervisor.check_status(servo_id, one.sample)
            if was_out and self._supervisor.engaged:
                self._supervisor.check(servo_id)
            if one.sample.error & ERROR_NUMBER:
                self._line.errors["refused"] += 1
            elif was_out and dark:
                continue  # the first answer after long silence may be an old one
            elif believed and self._feedback.believes(slot, one):
                self._feedback.take(slot, one)
            elif believed:
                self._line.errors["implausible"] += 1
        self._health.note_silent(
            self._roll.out, now_s, self._roll.garbling, self._line.lateness, bool(heard)
        )

    def _cannot_release(self) -> str:
        """Say what servos do that cannot be told to let go."""
        rest = (
            f"their bus watchdog stops them within {self._watchdog * WATCHDOG_UNIT_S:.2f} s "
            "and they hold their place"
            if self._watchdog
            else "they go on to their last goal and hold it"
        )
        return (
            f"{self._port.port_name} is gone: torque could not be switched off; servos that have "
            f"power keep their torque, {rest}: {CUT} to free them"
        )
