"""Faults of a rig, each with its remedy."""
