"""PCA9685 boards on an I2C bus, and their hobby servos, which have no feedback."""
