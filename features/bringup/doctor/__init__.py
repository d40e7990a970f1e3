"""Diagnosis of a rig: faults, each with its remedy."""
