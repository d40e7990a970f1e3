"""An emulated PCA9685, register by register: from written registers to pulses.

Omitted: inverted and open-drain outputs (stored, no effect), the output enable pin (tied to
ground), an external clock (not connected, so choosing it ends the pulses), and the missing
acknowledgement of reserved registers (here they ignore writes). Source: NXP, PCA9685 data sheet,
rev. 4 (16 April 2015): 7.1.2 and 7.3.7 All Call, 7.3.1.1 restart, 7.3.3 full on and off, 7.5
power-on reset, 7.6 software reset, notes below table 4 on auto-increment and the prescaler; [A]
is assumed.
"""

MODE1, MODE2, SUBADR1, ALLCALLADR = 0x00, 0x01, 0x02, 0x05
LED0 = 0x06
LAST_IN_TURN = 0x45
"""After it, and after the prescaler, auto-increment continues at 0."""
ALL_LED, PRESCALE, TEST_MODE = 0xFA, 0xFE, 0xFF

RESTART, EXTCLK, AI, SLEEP, ALLCALL = 0x80, 0x40, 0x20, 0x10, 0x01
SUBADDRESSES = (0x08, 0x04, 0x02)
"""Bits of MODE1 that enable SUBADR1 to 3."""
OCH = 0x08
FULL = 0x10
"""In the high byte of ON or OFF: all the time; OFF has priority."""

CHANNELS, COUNTS = 16, 4096
LEAST_PRESCALE = 3
START_S = 500e-6
"""Time from the end of sleep until the oscillator is stable."""

NOMINAL_HZ = 25e6


class Chip:
    """One chip.

    Args:
        oscillator_hz: frequency of its own oscillator, which differs from the nominal 25 MHz by a
            few percent between chips.
    """

    def __init__(self, oscillator_hz: float = NOMINAL_HZ) -> None:
        self.oscillator_hz = oscillator_hz
        self._awake_s = -1.0
        self.reset()

    def reset(self) -> None:
        """Set all registers to their values after power-up."""
        self._registers = bytearray(256)
        self._registers[MODE1] = SLEEP | ALLCALL
        self._registers[MODE2] = 0x04
        self._registers[2:6] = bytes((0xE2, 0xE4, 0xE8, 0xE0))
        self._registers[PRESCALE] = 0x1E
        for channel in range(CHANNELS):
            self._registers[LED0 + 4 * channel + 3] = FULL
        self._outputs = bytes(self._registers[LED0 : LAST_IN_TURN + 1])
        self._pointer = 0
        self._staged = False
        self._is_restart_pending = False

    # --- the bus

    @property
    def further_addresses(self) -> tuple[int, ...]:
        """Return the further addresses that it answers: of groups of boards, and of all."""
        bits = (*SUBADDRESSES, ALLCALL)
        mode, named = self._registers[MODE1], self._registers[SUBADR1 : ALLCALLADR + 1]
        return tuple(byte >> 1 for bit, byte in zip(bits, named, strict=True) if mode & bit)

    def write(self, data: bytes, now_s: float) -> None:
        """Process the bytes of one write after its address, up to the stop condition."""
        if data:
            self._pointer = data[0]
        for byte in data[1:]:
            self._store(self._pointer, byte, now_s)
            self._step()
        if self._staged:
            self._update_outputs()

    def read(self, length: int) -> bytes:
        """Return the bytes of one read, from the register that was selected last."""
        found = bytearray()
        for _ in range(length):
            # Registers that write to all channels cannot be read.
            unreadable = ALL_LED <= self._pointer < PRESCALE
            found.append(0 if unreadable else self._registers[self._pointer])
            self._step()
        return bytes(found)

    def _step(self) -> None:
        if self._registers[MODE1] & AI:
            last = self._pointer in (LAST_IN_TURN, PRESCALE)
            self._pointer = 0 if last else self._pointer + 1 & 0xFF

    def _store(self, register: int, byte: int, now_s: float) -> None:
        if register == MODE1:
            before = self._registers[MODE1]
            # Awake for 0.5 ms first: the write that ends the sleep does not restart the outputs.
            if byte & RESTART and not (byte | before) & SLEEP and now_s >= self._awake_s:
                self._is_restart_pending = False
            if (
                byte & SLEEP
                and not before & SLEEP
                and any(not high & FULL for high in self._outputs[3::4])
            ):
                self._is_restart_pending = True
            if before & SLEEP and not byte & SLEEP:
                self._awake_s = now_s + START_S
            # The external clock is selected asleep, by both bits in one write, and until the next
            # reset.
            clock = EXTCLK if before & EXTCLK or (before & byte & SLEEP and byte & EXTCLK) else 0
            self._registers[MODE1] = byte & ~(RESTART | EXTCLK) | clock
            self._mark_restart()
        elif register == PRESCALE:
            if self._registers[MODE1] & SLEEP:
                self._registers[PRESCALE] = max(LEAST_PRESCALE, byte)
        elif LED0 <= register <= LAST_IN_TURN:
            self._set_output(register - LED0, byte)
        elif ALL_LED <= register < PRESCALE:
            for channel in range(CHANNELS):
                self._set_output(4 * channel + register - ALL_LED, byte)
        elif register < LED0:
            self._registers[register] = byte
        # The test mode and the reserved registers ignore writes.

    def _mark_restart(self) -> None:
        mode = self._registers[MODE1] & ~RESTART
        self._registers[MODE1] = mode | (RESTART if self._is_restart_pending else 0)

    def _set_output(self, at: int, byte: int) -> None:
        self._registers[LED0 + at] = byte & (0x1F if at % 2 else 0xFF)
        self._staged = True
        if self._registers[MODE2] & OCH and at % 4 == 3:
            self._update_outputs()

    def _update_outputs(self) -> None:
        """Update the outputs from the registers; outputs stopped by a sleep restart as well."""
        self._outputs = bytes(self._registers[LED0 : LAST_IN_TURN + 1])
        self._staged = False
        if self._is_restart_pending and not self._registers[MODE1] & SLEEP:
            self._is_restart_pending = False
            self._mark_restart()

    # --- the outputs

    @property
    def period_s(self) -> float:
        """Return the time from pulse to pulse."""
        return (self._registers[PRESCALE] + 1) * COUNTS / self.oscillator_hz

    def counts(self, channel: int) -> int:
        """Return the configured width, in 4096ths of a period, awake or not."""
        on_low, on_high, off_low, off_high = self._outputs[4 * channel : 4 * channel + 4]
        if off_high & FULL:
            return 0
        if on_high & FULL:
            return COUNTS
        on, off = on_low | (on_high & 0x0F) << 8, off_low | (off_high & 0x0F) << 8
        return (off - on) % COUNTS

    def width_s(self, channel: int, now_s: float) -> float:
        """Return the true length of a channel's pulses; 0: none."""
        mode = self._registers[MODE1]
        if mode & (SLEEP | EXTCLK) or self._is_restart_pending or now_s < self._awake_s:
            return 0.0
        return self.counts(channel) / COUNTS * self.period_s
