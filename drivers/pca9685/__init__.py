"""PCA9685 boards on an I2C bus, and the hobby servos behind them, which give no feedback."""
