"""Emulated PCA9685 boards on an I2C bus."""
