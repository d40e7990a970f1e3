"""The command ``gazerig study analyse``: the results of a study."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gazerig.robot.cli.progress_bar import progress_bar
from gazerig.robot.cli.terminal import clear_errors, say

if TYPE_CHECKING:
    from gazerig.features.study.analysis import StudyAnalysis


def analyse(
    data: Annotated[
        Path, typer.Argument(metavar="DATA", help="Folder of the study's data, such as study-data.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder to write to; default: DATA/report.")
    ] = None,
) -> None:
    """Analyse a study: one page for reviewers, tidy tables and a BIDS data set.

    Tests, effects, figures and a sentence in APA form for each hypothesis; what the design excludes
    is omitted and listed. Run it again whenever there are more data. An analysis before the
    planned number of participants is recorded in the data with its date, and reported.
    """
    with clear_errors():
        import gazerig
        from gazerig.features.study.report.page import banners
        from gazerig.features.study.report.report import write_report

        made_by = f"gazerig {gazerig.__version__}"
        with progress_bar() as tell:
            now = datetime.now(UTC).isoformat(timespec="seconds")
            made = write_report(data, out or data / "report", made_by, now, tell)
        for words in banners(made.study):
            say(words)
        for line in verdicts(made.study):
            print(line)
        print(f"{made.page}: the whole report; tables beside it")
        print(f"{made.data_set.root}: a BIDS data set of {made.data_set.files} files")
        for why in made.data_set.left_out:
            say(f"left out of the data set: {why}")


def verdicts(study: "StudyAnalysis") -> list[str]:
    """Return the verdict on each hypothesis, one per line."""
    from gazerig.features.study.report.apa import measure_name

    lines = [f"{len(study.counted)} of {len(study.people)} participants count"]
    for one in study.decisions:
        said = one.hypothesis
        what = f"{measure_name(one.measure)}: {said.better} > {said.than}"
        known = one.verdict != "too few"
        p = f" (corrected p = {one.corrected_p:.3g}, n = {one.n})" if known else f" (n = {one.n})"
        lines.append(f"{what}: {one.verdict}{p}")
    return lines
