"""Fitting a walk to fixations: what is known comes back, what cannot be trusted is refused."""

from dataclasses import replace

import numpy as np
import pytest

from gazerig.config.load import load, shipped
from gazerig.gaze.scanpath.fit import FitParams, PartFixation, fit_walk
from gazerig.gaze.scanpath.scanpath import ScanpathParams, Walk, markov_walk, normalise
from gazerig.gaze.types import PARTS

WALK = load(shipped("scanpaths", "nakamoto_tsuruno"), Walk)


def walked(count: int, seed: int = 1, dwell_distribution: str = "gamma") -> list[PartFixation]:
    """Fixations of the known walk, 20 ms of flight between them."""
    params = ScanpathParams(
        min_dwell_ms=0.0, diagonal="refixation", dwell_distribution=dwell_distribution
    )
    walk = markov_walk(params, WALK, np.random.default_rng(seed))
    part, t_s, out = 5, 0.0, []
    for _ in range(count):
        dwell_s = walk.dwell_s(part)
        out.append(PartFixation(PARTS[part], t_s, dwell_s))
        t_s += dwell_s + 0.02
        part = walk.next_part(part)
    return out


def dice() -> np.random.Generator:
    return np.random.default_rng(4)


@pytest.mark.parametrize("smoothing", ["none", "laplace", "bootstrap"])
def test_a_known_walk_is_recovered(smoothing: str) -> None:
    fitted = fit_walk(walked(20_000), FitParams(smoothing=smoothing, resamples=200), dice())
    wanted = normalise(WALK.matrix)
    for row, counts, truth in zip(fitted.matrix, fitted.counts, wanted, strict=True):
        n = sum(counts)
        for cell, p in zip(row, truth, strict=True):
            # Four standard errors of a share, and what the added half counts may move it by.
            assert abs(cell.value - p) <= 4.0 * np.sqrt(p * (1.0 - p) / n) + 4.0 / n
    for i in range(8):
        n, sd = fitted.visits[i], WALK.dwell_sd_s[i]
        assert abs(fitted.dwell_mean_s[i].value - WALK.dwell_mean_s[i]) < 4.0 * sd / np.sqrt(n)
        assert fitted.dwell_sd_s[i].value == pytest.approx(sd, rel=0.15)
    assert fitted.start == "FR" and fitted.outside == 0 and fitted.pooled == ()
    assert np.sum([[c.value for c in row] for row in fitted.matrix], axis=1) == pytest.approx(
        np.ones(8)
    )


def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    wanted, held, cells = normalise(WALK.matrix), 0, 0
    dwells_held = 0
    for seed in range(18):
        fitted = fit_walk(walked(600, seed), FitParams(smoothing="none", resamples=200), dice())
        for row, truth in zip(fitted.matrix, wanted, strict=True):
            for cell, p in zip(row, truth, strict=True):
                if p > 0.0:
                    held += cell.low <= p <= cell.high
                    cells += 1
                else:
                    assert cell.value == 0.0 and cell.low == 0.0 and cell.high > 0.0
        dwells_held += sum(
            mean.low <= truth <= mean.high
            for mean, truth in zip(fitted.dwell_mean_s, WALK.dwell_mean_s, strict=True)
        )
    assert 0.90 < held / cells < 0.98
    assert 0.80 < dwells_held / (18 * 8) < 0.98  # skewed laws: the bootstrap is known to fall short


def test_counts_are_of_neighbours_on_the_face_only() -> None:
    looks = [
        PartFixation("N", 0.0, 0.2),
        PartFixation("RE", 0.25, 0.2),
        PartFixation(None, 0.5, 0.1),
        PartFixation("LE", 0.65, 0.2),  # after a look elsewhere
        PartFixation("LE", 0.9, 0.2),  # a refixation
        PartFixation("M", 2.0, 0.2),  # after a long gap
    ]
    fitted = fit_walk(looks, FitParams(fewest=5, fewest_dwells=2, resamples=100), dice())
    n, re, le = (PARTS.index(part) for part in ("N", "RE", "LE"))
    seen = {(i, j): c for i, row in enumerate(fitted.counts) for j, c in enumerate(row) if c}
    assert seen == {(n, re): 1, (le, le): 1}
    assert fitted.outside == 1
    # Laplace: (1 + 1/2) / (1 + 8/2), and even odds from where nothing was seen.
    assert fitted.matrix[n][re].value == pytest.approx(0.3)
    assert fitted.matrix[0][3].value == pytest.approx(0.125)
    assert "M" in fitted.pooled and "LE" not in fitted.pooled
    assert fitted.dwell_mean_s[PARTS.index("M")].value == pytest.approx(0.2)


def test_same_dice_give_the_same_fit() -> None:
    looks = walked(200)
    assert fit_walk(looks, FitParams(), dice()) == fit_walk(looks, FitParams(), dice())


def test_what_cannot_be_trusted_is_refused() -> None:
    looks, params = walked(100), FitParams(resamples=100)

    def refused(changed: list[PartFixation], why: str, params: FitParams = params) -> None:
        with pytest.raises(ValueError, match=why):
            fit_walk(changed, params, dice())

    refused([], "0 fixations on the face are too few, 50 are needed")
    refused(looks[:49], "49 fixations on the face are too few")
    refused([f._replace(part=None) for f in looks], "all 100 fixations lie outside")
    refused([*looks[:60], looks[3]], "fixation 61 does not begin after the one before")
    refused([f._replace(duration_s=1000.0 * f.duration_s) for f in looks], "check the units")
    refused([*looks[:60], looks[60]._replace(duration_s=float("nan"))], "fixation 61: .*finite")
    refused([looks[0]._replace(part="NOSE"), *looks[1:]], "fixation 1: no part 'NOSE'")
    staring = [PartFixation("N", 0.3 * k, 0.25) for k in range(60)]
    refused(staring, "no transition starts at chin", replace(params, smoothing="none"))
    apart = [PartFixation("N", 3.0 * k, 0.25) for k in range(60)]
    refused(apart, "no two fixations on the face follow each other")
