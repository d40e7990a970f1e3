"""The report of a study: one page with tables and figures, and the answers as CSV."""

import csv
from io import StringIO
from math import isfinite
from pathlib import Path
from textwrap import fill

import jinja2
import numpy as np
from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure

from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.study.analyse import Scores, StudyAnalysis
from gazerig.features.study.design import Measure
from gazerig.features.study.journal import ItemAnswered


def write_report(study: StudyAnalysis, out: Path) -> Path:
    """Write index.html and answers.csv into a folder; return the path of the page.

    Raises:
        SetupError: a file cannot be written.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent), autoescape=True, trim_blocks=True,
        lstrip_blocks=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    environment.filters |= {"number": _number, "p": _p_value}
    names = {key: one.label or key for key, one in study.design.conditions.items()}
    sections = [
        (one, _table(scores, names), _figure(one, scores, names))
        for one, scores in study.scores.items()
        if study.design.task == "rating"
    ]
    page = environment.get_template("report.html").render(
        study=study, design=study.design, names=names, sections=sections
    )
    make_folder(out)
    write_file(out / "answers.csv", answers_csv(study), force=True)
    write_file(out / "index.html", page, force=True)
    return out / "index.html"


def answers_csv(study: StudyAnalysis) -> str:
    """Return every answer as a row, with the reason if it does not count."""
    text, fields = StringIO(), ItemAnswered.__struct_fields__
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["participant", *fields, "left_out"])
    for code, row, left_out in study.answers:
        writer.writerow([code, *(getattr(row, name) for name in fields), left_out])
    return text.getvalue()


def _number(value: float) -> str:
    return f"{value:.2f}" if isfinite(value) else "–"


def _p_value(p: float) -> str:
    return f"{max(p, 0.001):.3f}".replace("0.001", "≤ .001") if isfinite(p) else "–"


def _table(scores: Scores, names: dict[str, str]) -> list[list[str]]:
    """Return condition, participants, mean, standard deviation and median of each condition."""
    rows = []
    for key, name in names.items():
        means = np.array([np.mean(values) for values in scores[key].values()])
        figures = (means.mean(), means.std(ddof=1), np.median(means)) if len(means) > 1 else ()
        rows.append([name, str(len(means)), *map(_number, figures)])
    return rows


def _figure(one: Measure, scores: Scores, names: dict[str, str]) -> Markup:
    """Return a figure as SVG: how often each value was given in each condition, and the means."""
    text = StringIO()
    with rc_context({"svg.hashsalt": "gazerig", "text.parse_math": False}):
        figure = Figure(figsize=(8.4, 1.0 + 0.7 * len(names)), layout="constrained")
        axes = figure.subplots()
        for row, key in enumerate(names):
            values = [value for each in scores[key].values() for value in each]
            at, counts = np.unique(np.round(np.array(values) * 4.0) / 4.0, return_counts=True)
            axes.scatter(
                at, np.full(len(at), row), 40.0 * counts, color="#1c6ea4", alpha=0.45, lw=0
            )
            for x, count in zip(at, counts, strict=True):
                axes.annotate(str(count), (x, row), ha="center", va="center", fontsize=8)
            if values:
                axes.plot(np.mean(values), row - 0.4, "v", color="#b3261e", ms=8)
        axes.set_yticks(range(len(names)), [fill(name, 24) for name in names.values()])
        axes.set_xlim(0.7, one.points + 0.3)
        axes.set_ylim(len(names) - 0.4, -0.7)
        figure.savefig(text, format="svg", metadata={"Date": None})
    return Markup(text.getvalue()[text.getvalue().index("<svg") :])
