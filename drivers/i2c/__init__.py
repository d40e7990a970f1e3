"""I2C buses of the kernel, or of a bridge on a serial line."""
