"""States of a conversation."""

from typing import Literal

TurnState = Literal["idle", "listening", "thinking", "speaking", "interrupted"]
"""What the head does; interrupted: it listens, after an interruption of its own turn."""
