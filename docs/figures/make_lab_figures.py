"""Draw gaze beside that of people, with the lab: python docs/figures/make_lab_figures.py."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  # the backend must be chosen before
import people_figure  # noqa: E402
import trace_figure  # noqa: E402

HERE = Path(__file__).parent


def traces() -> None:
    """Twenty seconds of a person by published numbers, of the default and of both papers."""
    figure = trace_figure.figure_of(trace_figure.all_traces())
    figure.savefig(HERE / "traces.png", dpi=110, bbox_inches="tight")
    plt.close(figure)


def people() -> None:
    """Twenty seconds before a face, a walker and three people, and in a talk."""
    figure = people_figure.figure_of(people_figure.all_traces())
    figure.savefig(HERE / "people.png", dpi=110, bbox_inches="tight")
    plt.close(figure)


if __name__ == "__main__":
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
    traces()
    people()
