"""Where the shipped worlds are; light, as the options of the command line name them."""

from pathlib import Path

HOME = Path(__file__).parent
"""The folder with ``worlds``."""
