"""Links of README and docs have targets; those to a deleted feature are left out."""

import re
from pathlib import Path

from features_there import SHIPPED_FEATURES
from papers import PAPERS, ROOT, prose

GENERATED = ROOT / "docs/parameters.md"
"""Page that is written when the documentation is built."""
GONE = [name for name in SHIPPED_FEATURES if not (ROOT / "features" / name).exists()]


def slugs(paper: Path) -> set[str]:
    """Return the anchors of a paper's headings, as GitHub makes them."""
    titles = re.findall(r"^#+ (.+)$", prose(paper), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-") for title in titles}


def test_links_lead_somewhere() -> None:
    for paper in (*PAPERS, ROOT / "CHANGELOG.md"):
        for link in re.findall(r"\]\(([^)]+)\)", prose(paper)):
            if link.startswith("http"):
                continue
            target, _, anchor = link.partition("#")
            file = (paper.parent / target).resolve() if target else paper
            if file == GENERATED:
                continue
            if not file.exists() and any(one in file.relative_to(ROOT).parts[:2] for one in GONE):
                continue  # to a feature that was deleted
            assert file.exists(), f"{paper.name}: {link}"
            assert not anchor or anchor in slugs(file), f"{paper.name}: {link}"
