"""A process beside the program that lets go of servos without a watchdog when the program dies."""
