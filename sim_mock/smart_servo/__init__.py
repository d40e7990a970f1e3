"""What all emulated smart servos share."""
