"""Folder of the shipped worlds; a light module, because the command line's options list them."""

from pathlib import Path

HOME = Path(__file__).parent
"""The folder with ``worlds``."""
