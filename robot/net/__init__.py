"""Requests of other programs to a running rig, and changes of its files."""
