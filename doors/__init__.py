"""Doors: each lets a neighbour of the head, such as a voice assistant, take part.

A door uses the public ``import gazerig`` only, and runs in a process of its own.
"""
