"""A process beside the program that releases the servos when the program dies or hangs."""
