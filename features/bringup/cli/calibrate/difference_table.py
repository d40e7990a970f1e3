"""What a calibration found beside what the rig's file says."""

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from gazerig.config.rig import Rig


def difference_table(rig: str, loaded: Rig, changes: Mapping[str, Any]) -> Table:
    """Return old and new values side by side.

    Args:
        rig: as it was named.
        loaded: with the old values.
        changes: new values by the dotted keys of the rig's file.
    """
    table = Table(caption=f"what was found, against {rig}")
    for name in ("key", "old", "new"):
        table.add_column(name, justify="left" if name == "key" else "right", no_wrap=True)
    for key, new in changes.items():
        old: Any = loaded
        for step in key.split("."):
            old = getattr(old, step, "-")
        table.add_row(key, _text(old), _text(new))
    return table


def _text(value: Any) -> str:
    return " ".join(f"{v:g}" for v in value) if isinstance(value, tuple) else f"{value}"
