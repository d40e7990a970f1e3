"""The engine that all smart servos share."""
