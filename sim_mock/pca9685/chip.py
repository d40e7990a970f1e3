"""An emulated PCA9685, register by register: from written registers to pulses.

Omitted: inverted and open-drain outputs (stored, no effect), the output enable pin (tied to
ground), an external clock, addresses of groups, the order of outputs within a transfer, the time
until the oscillator is stable, and the restart of outputs that slept. Source: NXP, PCA9685 data
sheet, rev. 4 (16 April 2015): 7.3.3 full on and off, 7.5 power-on reset, notes below table 4 on
auto-increment and the prescaler.
"""

MODE1, LED0, ALL_LED, PRESCALE = 0x00, 0x06, 0xFA, 0xFE
LAST_OUTPUT = 0x45
POWER_ON = bytes((0x11, 0x04, 0xE2, 0xE4, 0xE8, 0xE0))
RESTART, AI, SLEEP = 0x80, 0x20, 0x10
FULL = 0x10
"""In the high byte of ON or OFF: all the time; OFF has priority."""

CHANNELS, COUNTS = 16, 4096
LEAST_PRESCALE = 3
NOMINAL_HZ = 25e6


class Chip:
    """One chip.

    Args:
        oscillator_hz: frequency of its own oscillator, which differs from the nominal 25 MHz by a
            few percent between chips.

    registers: all registers
    """

    def __init__(self, oscillator_hz: float = NOMINAL_HZ) -> None:
        self._oscillator_hz = oscillator_hz
        self.reset()

    def reset(self) -> None:
        """Set all registers to their values after power-up."""
        self.registers = bytearray(POWER_ON.ljust(256, b"\0"))
        self.registers[PRESCALE] = 0x1E
        self.registers[LED0 + 3 : LAST_OUTPUT + 1 : 4] = bytes((FULL,) * CHANNELS)
        self._pointer = 0

    def write(self, data: bytes) -> None:
        """Process the bytes of one write after its address."""
        self._pointer = data[0]
        for byte in data[1:]:
            self._store(self._pointer, byte)
            self._step()

    def read(self, length: int) -> bytes:
        """Return the bytes of one read, from the register that was selected last."""
        found = bytearray()
        for _ in range(length):
            # Registers that write to all channels cannot be read: they stay 0.
            found.append(self.registers[self._pointer])
            self._step()
        return bytes(found)

    def _step(self) -> None:
        if self.registers[MODE1] & AI:
            self._pointer = self._pointer + 1 & 0xFF

    def _store(self, register: int, byte: int) -> None:
        if register == MODE1:
            self.registers[MODE1] = byte & ~RESTART
        elif register == PRESCALE:
            if self.registers[MODE1] & SLEEP:
                self.registers[PRESCALE] = max(LEAST_PRESCALE, byte)
        elif ALL_LED <= register < PRESCALE:
            for channel in range(CHANNELS):
                self._store(LED0 + 4 * channel + register - ALL_LED, byte)
        elif register <= LAST_OUTPUT:
            self.registers[register] = byte

    def counts(self, channel: int) -> int:
        """Return the configured width, in 4096ths of a period, awake or not."""
        at = LED0 + 4 * channel
        on_low, on_high, off_low, off_high = self.registers[at : at + 4]
        if off_high & FULL:
            return 0
        if on_high & FULL:
            return COUNTS
        on, off = on_low | (on_high & 0x0F) << 8, off_low | (off_high & 0x0F) << 8
        return (off - on) % COUNTS

    def width_s(self, channel: int) -> float:
        """Return the true length of a channel's pulses; 0: none."""
        if self.registers[MODE1] & SLEEP:
            return 0.0
        return self.counts(channel) * (self.registers[PRESCALE] + 1) / self._oscillator_hz
