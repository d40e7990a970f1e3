"""Tables and styled lines, in which names of files cannot control the terminal."""

from typing import Any

from rich import console
from rich.text import Text

from gazerig.drivers.process.visible_text import visible


class Console(console.Console):
    """Rich's console; control characters of its texts are shown."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Convert a text of a line or of a table's cell."""
        return super().render_str(visible(text), **options)
