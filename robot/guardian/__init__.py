"""A process beside the program that releases servos without a watchdog when the program dies."""
