"""Process that releases the servos when the program dies or hangs."""
