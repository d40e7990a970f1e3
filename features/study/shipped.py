"""Folder of the shipped studies and questionnaires."""

from pathlib import Path

HOME = Path(__file__).parent
"""The folder with ``studies`` and ``questionnaires``."""
