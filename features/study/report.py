"""The report of a study: one page with tables and figures, and the answers as CSV."""

import csv
from io import StringIO
from pathlib import Path

import jinja2
import numpy as np
from matplotlib.figure import Figure

from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.study.analyse import Scores, StudyAnalysis
from gazerig.features.study.design import Measure


def write_report(study: StudyAnalysis, out: Path) -> Path:
    """Write index.html and answers.csv into a folder; return the path of the page.

    Raises:
        SetupError: a file cannot be written.
    """
    names = {key: one.label or key for key, one in study.design.conditions.items()}
    sections = [
        (one, _figure(one, scores, names))
        for one, scores in study.scores.items()
        if study.design.task == "rating"
    ]
    template = jinja2.Template(
        Path(__file__).with_suffix(".html").read_text(), autoescape=True, trim_blocks=True,
        lstrip_blocks=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    page = template.render(study=study, design=study.design, names=names, sections=sections)
    make_folder(out)
    write_file(out / "answers.csv", answers_csv(study), force=True)
    write_file(out / "index.html", page, force=True)
    return out / "index.html"


def answers_csv(study: StudyAnalysis) -> str:
    """Return every answer as a row, with the reason if it does not count."""
    text = StringIO()
    fields = "trial", "condition", "questionnaire", "item", "value", "ms", "utc"
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["participant", *fields, "left_out"])
    for code, row, left_out in study.answers:
        writer.writerow([code, *(getattr(row, name) for name in fields), left_out])
    return text.getvalue()


def _figure(one: Measure, scores: Scores, names: dict[str, str]) -> str:
    """Return a figure as SVG: how often each value was given in each condition, and the means."""
    figure = Figure(figsize=(8.4, 1.0 + 0.7 * len(names)), layout="constrained")
    axes = figure.subplots()
    for row, key in enumerate(names):
        values = [value for each in scores[key].values() for value in each]
        at, counts = np.unique(values, return_counts=True)
        axes.scatter(at, np.full(len(at), row), 40.0 * counts, alpha=0.45)
        if values:
            axes.plot(np.mean(values), row, "k|", markersize=24)
    axes.set_yticks(range(len(names)), [*names.values()])
    axes.set_xlim(0.7, one.points + 0.3)
    axes.set_ylim(len(names) - 0.4, -0.6)
    text = StringIO()
    figure.savefig(text, format="svg")
    return text.getvalue()[text.getvalue().index("<svg") :]
