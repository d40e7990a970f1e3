"""Draw the figures that take the lab: of a sweep, and of traces beside a person's: make figures."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  # the backend must be chosen before
import people_figure  # noqa: E402
import trace_figure  # noqa: E402

from gazerig.config.schema import load_rig  # noqa: E402
from gazerig.features.lab.sweep.axes import Axis, grid  # noqa: E402
from gazerig.features.lab.sweep.response_figure import response_png  # noqa: E402
from gazerig.features.lab.sweep.run_outcome import Outcome  # noqa: E402
from gazerig.features.lab.sweep.worker import figures_at  # noqa: E402
from gazerig.robot.app.options import RunOptions  # noqa: E402

HERE = Path(__file__).parent


def sweep() -> None:
    """What the rate of blinks does: the picture of a small sweep on ideal servos."""
    rig = load_rig("desk")
    axis = Axis("gaze.lids.blinks_per_min", (8.0, 14.0, 20.0, 26.0, 32.0), unit="1/min")
    runs = []
    for point in grid([axis]):
        for seed in range(3):
            options = RunOptions(True, True, seed, "visitor", seconds=44.0, bus="ideal")
            runs.append(Outcome(point, seed, figures_at(rig, options, point, lambda: None)))
    (HERE / "sweep.png").write_bytes(response_png([axis], runs))


def traces() -> None:
    """Twenty seconds of a person by published numbers, of the default and of both papers."""
    figure = trace_figure.figure_of(trace_figure.all_traces())
    figure.savefig(HERE.parent / "figures" / "traces.png", dpi=110, bbox_inches="tight")
    plt.close(figure)


def people() -> None:
    """Twenty seconds before a face, a walker and three people, and in a talk."""
    figure = people_figure.figure_of(people_figure.all_traces())
    figure.savefig(HERE.parent / "figures" / "people.png", dpi=110, bbox_inches="tight")
    plt.close(figure)


if __name__ == "__main__":
    plt.rcParams.update({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3})
    sweep()
    traces()
    people()
