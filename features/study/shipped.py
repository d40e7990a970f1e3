"""Where the shipped studies and questionnaires are."""

from pathlib import Path

HOME = Path(__file__).parent
"""The folder with ``studies`` and ``questionnaires``."""
