"""Simulated participants: answers with a known effect, to try a study before the first session.

A rating is a latent normal value cut by thresholds: the sum of the participant's own level, a
trial's deviation (shared by the items of a scale), the item's noise, and the shift of the
condition. The shift is solved so that the participants' differences between neighbouring
conditions have the required d_z as they will be analysed: integer points, means of scales and of
repetitions. A choice follows Bradley & Terry (1952), with the probability that such a difference
is above zero.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import sqrt
from typing import Annotated
from zlib import crc32

import numpy as np
from scipy import optimize, special

from gazerig.features.study.design import StudyDesign
from gazerig.features.study.journal import AnswerValue
from gazerig.features.study.questionnaire import Item, Questionnaire
from gazerig.features.study.trial_order import PAIR
from gazerig.gaze.types import Floats
from gazerig.params import Bounds

BETWEEN_SD, TRIAL_SD, ITEM_SD = 0.8, 0.7, 0.7
"""Standard deviations of participants, of their trials, and of items within a trial; the noise of
d_z contains the last two, because a participant's level is in both conditions."""

_TOTAL_SD = sqrt(BETWEEN_SD**2 + TRIAL_SD**2 + ITEM_SD**2)
_NODES, _RAW_WEIGHTS = np.polynomial.hermite_e.hermegauss(31)
_WEIGHTS: Floats = np.asarray(_RAW_WEIGHTS / _RAW_WEIGHTS.sum(), np.float64)
_LARGEST_SHIFT = 12.0
_MEDIAN_MS, _HASTY_MS = 2600.0, 180.0
_OBJECTIVE_MIDDLE, _OBJECTIVE_SD = 0.5, 0.1


# fmt: off
@dataclass(frozen=True)
class Population:
    """Distribution of simulated participants."""

    effect: Annotated[float, Bounds(-3, 3), "d_z of the differences between neighbouring conditions"] = 0.6
    careless: Annotated[float, Bounds(0, 1), "share who give one answer to everything"] = 0.0
    hasty: Annotated[float, Bounds(0, 1), "share who answer faster than anybody reads"] = 0.0
    seed: Annotated[int, Bounds(0, 2**31 - 1), "seed of all participants"] = 0
    preference_sd: Annotated[float, Bounds(0, 10), "spread of each one's preferences for conditions, latent"] = 0.0
    contrast_sd: Annotated[float, Bounds(0, 10), "spread of each one's preference for the first condition, latent"] = 0.0
# fmt: on


def factor_levels(design: StudyDesign) -> dict[str, int]:
    """Return the rank of each condition by the hypotheses, the lowest at 0.

    Without hypotheses the first condition is above the others.
    """
    pairs = [pair for one in design.hypotheses for pair in design.condition_pairs(one)]
    first, *others = design.conditions
    pairs = pairs or [(first, other) for other in others]
    found = dict.fromkeys(design.conditions, 0)
    for _ in design.conditions:  # enough rounds for the longest chain; cycles end, too
        for better, than in pairs:
            found[better] = max(found[better], min(found[than] + 1, len(found) - 1))
    return found


def compared_trials(design: StudyDesign) -> int:
    """Return the number of a participant's trials in the mean that a hypothesis compares.

    These are the trials of all conditions of a factor's level, or of one condition, with their
    repetitions; for different hypotheses the smallest number.
    """
    sides = [len(design.side(one.better)) for one in design.hypotheses]
    return min(sides, default=1) * design.trials.repetitions


@cache
def thresholds(points: int) -> tuple[float, ...]:
    """Return the latent values between the points, which are equally frequent without a shift."""
    shares = np.arange(1, points) / points
    return tuple((_TOTAL_SD * special.ndtri(shares)).tolist())


@cache
def effect_shift(effect: float, points: int, items: int = 1, repetitions: int = 1) -> float:
    """Return the latent shift that gives differences of this d_z.

    Args:
        effect: d_z of mean ratings of the shifted condition minus those of the other.
        points: steps of the rating.
        items: of the scale whose mean is analysed.
        repetitions: trials of each condition.
    """
    wanted = abs(effect)

    def missing(shift: float) -> float:
        return shift_effect(shift, points, items, repetitions) - wanted

    found = float(optimize.brentq(missing, 0.0, _LARGEST_SHIFT, xtol=1e-9)) if wanted else 0.0
    return found if effect >= 0.0 else -found


def shift_effect(shift: float, points: int, items: int = 1, repetitions: int = 1) -> float:
    """Return d_z of the differences from a shift of half up and half down.

    By Gauss-Hermite quadrature over the participant's level and the trial's deviation.
    """
    own = BETWEEN_SD * _NODES[:, None]
    trial = TRIAL_SD * _NODES[None, :]
    mean_at: list[Floats] = []
    variance = np.zeros(len(_NODES))
    for side in (0.5, -0.5):
        latent = own + trial + side * shift
        # The rating is 1 plus the number of thresholds below the value.
        above = special.ndtr((latent[..., None] - np.array(thresholds(points))) / ITEM_SD)
        mean = 1.0 + above.sum(axis=-1)
        square = 1.0 + (above * (2.0 * np.arange(2, points + 1) - 1.0)).sum(axis=-1)
        seen = mean @ _WEIGHTS
        between = (mean**2) @ _WEIGHTS - seen**2
        within = (square - mean**2) @ _WEIGHTS / items
        variance += (between + within) / repetitions
        mean_at.append(seen)
    difference = mean_at[0] - mean_at[1]
    middle = float(difference @ _WEIGHTS)
    spread = float(variance @ _WEIGHTS + (difference - middle) ** 2 @ _WEIGHTS)
    return middle / sqrt(spread)


def choice_probability(effect: float) -> float:
    """Return the probability that the better condition is chosen: of a difference above zero."""
    return float(special.ndtr(effect))


def ratings_from_latent(latent: Floats, points: int) -> Floats:
    """Return the ratings 1..points of latent values."""
    return np.asarray(1.0 + np.digitize(latent, thresholds(points)), np.float64)


def differences(
    effect: float, shape: tuple[int, int], rng: np.random.Generator, points: int = 5
) -> Floats:
    """Return differences of one item's ratings between two conditions, (studies, participants)."""
    shift, own = effect_shift(effect, points), rng.normal(0.0, BETWEEN_SD, shape)
    noise = sqrt(TRIAL_SD**2 + ITEM_SD**2)
    above = ratings_from_latent(own + 0.5 * shift + rng.normal(0.0, noise, shape), points)
    return above - ratings_from_latent(own - 0.5 * shift + rng.normal(0.0, noise, shape), points)


class SimulatedParticipant:
    """A participant; equal numbers and populations give equal answers in any order."""

    def __init__(
        self,
        design: StudyDesign,
        questionnaires: Mapping[str, Questionnaire],
        number: int,
        population: Population,
    ) -> None:
        """Draw the participant's properties."""
        self._design, self._questionnaires = design, questionnaires
        self._number, self._population = number, population
        self._levels = factor_levels(design)
        self._middle = 0.5 * max(self._levels.values())
        self._shown = compared_trials(design)
        careless, hasty = self._rng("manner").random(2)
        self.careless = bool(careless < population.careless)
        self.hasty = bool(hasty < population.hasty)

    def answer(
        self, trial: int | None, condition: str, questionnaire: str, item: str
    ) -> tuple[AnswerValue, float]:
        """Return the answer to an item, and its time in milliseconds.

        Args:
            trial: row of the order, practice below 0; None for questions at the end.
            condition: key, "a|b" for a pair, "" for questions at the end.
            questionnaire: key in the design.
            item: key in the questionnaire.
        """
        asked = self._questionnaires[questionnaire].items[item]
        rng = self._rng(f"{trial} {questionnaire}.{item}")
        ms = (_HASTY_MS if self.hasty else _MEDIAN_MS) * float(np.exp(rng.normal(0.0, 0.35)))
        if asked.kind == "text":
            return "", ms
        if asked.kind == "choice":
            chosen_first = self.careless or rng.random() < self._chance(condition, questionnaire)
            return "first" if chosen_first else "second", ms
        return self._rating(trial, condition, questionnaire, item, asked, rng), ms

    def simulate_measures(self, trial: int, condition: str) -> dict[str, float]:
        """Return the objective measures of a trial, each with the population's effect."""
        shift = sqrt(2.0 / self._shown) * self._population.effect
        values = {}
        for name in self._design.objective:
            own = self._rng(name).normal()
            noise = self._rng(f"{trial} {name}").normal()
            latent = own + noise + shift * self._shift_count(condition)
            values[name] = _OBJECTIVE_MIDDLE + _OBJECTIVE_SD * latent
        return values

    def _preference(self, condition: str, construct: str) -> float:
        """Return the participant's own preference for a condition, latent units."""
        if condition not in self._levels:
            return 0.0
        one, found = self._population, 0.0
        if one.preference_sd:
            found += one.preference_sd * self._rng(f"{condition} {construct}").normal()
        if one.contrast_sd:
            half = 0.5 if condition == next(iter(self._levels)) else -0.5
            found += half * one.contrast_sd * self._rng(f"contrast {construct}").normal()
        return found

    def _chance(self, pair: str, questionnaire: str) -> float:
        """Return the probability that the first of a pair is chosen (Bradley & Terry 1952)."""
        first, second = pair.split(PAIR)
        apart = self._levels[first] - self._levels[second]
        own = self._preference(first, questionnaire) - self._preference(second, questionnaire)
        by_level = apart * special.logit(choice_probability(self._population.effect))
        return float(special.expit(by_level + own))

    def _rating(
        self,
        trial: int | None,
        condition: str,
        questionnaire: str,
        key: str,
        item: Item,
        rng: np.random.Generator,
    ) -> int:
        if self.careless:
            return (item.points + 1) // 2
        construct = f"{questionnaire}.{item.scale or key}"
        asked = self._questionnaires[questionnaire].items.values()
        items = sum(one.scale == item.scale for one in asked) if item.scale else 1
        repetitions = 1 if trial is None else self._shown
        shift = effect_shift(self._population.effect, item.points, items, repetitions)
        latent = (
            BETWEEN_SD * self._rng(construct).normal()
            + TRIAL_SD * self._rng(f"{trial} {construct}").normal()
            + ITEM_SD * rng.normal()
            + shift * self._shift_count(condition)
            + self._preference(condition, construct)
        )
        rating = int(ratings_from_latent(np.array([latent]), item.points)[0])
        return item.points + 1 - rating if item.reverse else rating

    def _shift_count(self, condition: str) -> float:
        """Return the shifts between a condition and the middle; pairs are at the middle."""
        return self._levels[condition] - self._middle if condition in self._levels else 0.0

    def _rng(self, of: str) -> np.random.Generator:
        """Return the random numbers of one purpose, independent of earlier draws."""
        return np.random.default_rng((self._population.seed, self._number, crc32(of.encode())))
