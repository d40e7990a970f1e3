"""I2C buses: of the kernel, or behind a bridge on a serial line."""
