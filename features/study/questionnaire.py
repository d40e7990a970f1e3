"""Questionnaires as data: items, anchors, scales, sources and licences.

Read from YAML by the configuration's loader (features/study/questionnaires/*.yaml are shipped).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from gazerig.params import Bounds

Texts = Mapping[str, str]
"""Language -> text; "en" is required, and replaces a missing language."""


# fmt: off
@dataclass(frozen=True)
class Item:
    """One question.

    kind:
        rating: one of ``points`` from ``low`` to ``high``
        choice: one of two presentations, "first" or "second"
        text: free text, which may be empty
    """

    text: Annotated[Texts, "the question; empty where the anchors say it all"] = field(default_factory=dict)
    kind: Annotated[Literal["rating", "choice", "text"], "how it is answered"] = "rating"
    points: Annotated[int, Bounds(2, 11), "steps of a rating"] = 5
    low: Annotated[Texts, "anchor of the least"] = field(default_factory=dict)
    high: Annotated[Texts, "anchor of the most"] = field(default_factory=dict)
    scale: Annotated[str, "scale that the item belongs to"] = ""
    reverse: Annotated[bool, "more means less of the scale"] = False


@dataclass(frozen=True)
class Questionnaire:
    """Items on one page."""

    title: Annotated[str, "name in the report"]
    source: Annotated[str, "reference in full"]
    licence: Annotated[str, "under which terms the items may be used"]
    items: Annotated[Mapping[str, Item], "key -> item, in order"]
    shuffled: Annotated[bool, "items in an order of their own for each participant and trial"] = False
    instruction: Annotated[Texts, "what stands above the items"] = field(default_factory=dict)
# fmt: on
