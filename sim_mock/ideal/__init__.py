"""Servos without bytes."""
