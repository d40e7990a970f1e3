"""Emulated buses on pseudo-terminals."""
