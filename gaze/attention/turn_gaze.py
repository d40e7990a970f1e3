"""Gaze by role in a conversation: listener, thinker, speaker, addressee, side participant.

A voice agent reports its state. A thinker looks away immediately; most long turns begin averted
(Kendon 1967: more than 70 %), for the cognitive aversion of Andrist et al. 2014, and the gaze is on
the face again N(2.3, .5) s before the planned end (their turn yield). Between these the aversion
process of the role runs (gazerig.gaze.attention.aversion).

Of several people a listener looks most at the one who speaks, a speaker at the addressee (Vertegaal
et al. 2001: 88 and 77 %). A side participant, whom the present speaker does not look at, is a
listener too: when another person begins to speak, the gaze shifts there (Holler & Kendrick 2015).

Nods and brow flashes of a listener are individual (Blomsma 2024): each head has its own rate.
"""

from dataclasses import dataclass
from math import exp, inf
from typing import Annotated, Literal

import numpy as np

from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.aversion import Aversion, AversionMode
from gazerig.gaze.attention.turn_state import TurnState
from gazerig.params import Bounds

NOD, BROW_FLASH = "listening_nod", "listening_brows"
"""Tracks of a listener."""
_LATE_S = 1.5
"""Time after the planned end for which the gaze still waits on the face."""
_UNSURE_RATIO = 0.2
"""Share of the remaining time by which the gaze returns earlier if the end is quite uncertain."""
_MODES: dict[TurnState, AversionMode] = {
    "listening": "listening", "thinking": "thinking", "speaking": "speaking",
    "interrupted": "listening",
}  # fmt: skip
_PUBLISHED: dict[AversionMode, AversionMode] = {
    "listening": "listen", "thinking": "think", "speaking": "talk",
}  # fmt: skip


@dataclass(frozen=True)
class TurnParams:
    """Looks at the beginning and end of turns, shares of several people, signs of listening."""

    # fmt: off
    role_law: Annotated[Literal["people", "eyes_alive"],
        "aversion in reported turns: people: as measured in remote talk, mostly aside; eyes_alive: as in the modes talk, listen and "
        "think, which looks up"] = "people"
    long_turn_s: Annotated[float, Bounds(0, 60), "shortest planned turn that begins averted"] = 3.5
    starts_averted_share: Annotated[float, Bounds(0, 1), "share of the long turns that begin averted"] = 0.95
    start_away_s: Annotated[float, Bounds(0.1, 10), "time into a turn until the gaze returns to the face, mean"] = 1.2
    start_away_sd_s: Annotated[float, Bounds(0, 5), "its standard deviation"] = 0.25
    yield_s: Annotated[float, Bounds(0, 10), "time before the planned end at which the gaze is on the face again, mean"] = 2.3
    yield_sd_s: Annotated[float, Bounds(0, 5), "its standard deviation"] = 0.5
    addressee_share: Annotated[float, Bounds(0, 0.99),
        "share of the looks at several people that the addressee of speech gets; 0: no preference"] = 0.77
    salience: Annotated[float, Bounds(0, 10), "least salience of faces during a conversation"] = 0.8
    nods_per_min: Annotated[float, Bounds(0, 30), "nods of a listener, mean over heads; 0: none"] = 0.0
    brow_flashes_per_min: Annotated[float, Bounds(0, 30), "brow flashes of a listener, mean over heads; 0: none"] = 0.0
    individual_spread: Annotated[float, Bounds(0, 2), "standard deviation of the logarithm of a head's own rate of nods"] = 0.5
    # fmt: on


class TurnGaze:
    """Lets aversion and attention follow the state of conversation.

    Args:
        params: The parameters.
        aversion: Looks away from faces.
        attention: Chooses among people.
        rng: Draws times, and the head's own rates.
    """

    def __init__(
        self, params: TurnParams, aversion: Aversion, attention: Attention, rng: np.random.Generator
    ) -> None:
        self._params, self._aversion, self._attention, self._rng = params, aversion, attention, rng
        self._own = rng.standard_normal(2).tolist()
        self._state: TurnState = "idle"
        self._chosen: AversionMode = "none"
        self._yields_s = self._ends_s = self._next_sign_s = inf

    def retune(self, params: TurnParams) -> None:
        """Change the parameters, from the next state on."""
        self._params = params

    @property
    def chosen_mode(self) -> AversionMode:
        """Return the mode of aversion without a conversation."""
        return self._chosen

    @property
    def converses(self) -> bool:
        """Return whether a conversation has been reported or chosen, which changes the blinks."""
        return self._state != "idle" or self._chosen != "none"

    def choose_mode(self, mode: AversionMode, t_s: float) -> None:
        """Choose the mode of aversion that applies while no state is reported."""
        self._chosen = mode
        if self._state == "idle":
            self._aversion.converse(mode, t_s)

    def enter(
        self,
        state: TurnState,
        partner: int | None,
        ends_s: float | None,
        confidence: float,
        t_s: float,
    ) -> None:
        """Enter a state, or correct the plan of the present one.

        Args:
            state: The state.
            partner: Id of the partner or addressee, None if unknown.
            ends_s: Planned end of speech, None if unknown.
            confidence: Confidence of the planned end, 0..1.
            t_s: Present time.
        """
        before, self._state = self._state, state
        self._ends_s = inf if ends_s is None else ends_s
        self._yields_s = inf
        self._attention.converse(self._focus(state), partner, t_s)
        if state == "idle":
            self._aversion.converse(self._chosen, t_s)
            return
        mode = _MODES[state]
        if self._params.role_law == "eyes_alive":
            mode = _PUBLISHED.get(mode, mode)
        if state == "speaking":
            self._plan_speech(mode, confidence, before != state, t_s)
        elif state != before:
            self._aversion.converse(mode, t_s, averts=state == "thinking")
            self._next_sign_s = t_s + self._wait_s() if state == "listening" else inf

    def step(self, t_s: float) -> str:
        """Return to the face before the end of a turn; return a listener's track, "" for none."""
        if t_s >= self._yields_s:
            self._yields_s = inf
            self._aversion.keep_face(t_s, self._ends_s + _LATE_S)
        if self._state != "listening" or t_s < self._next_sign_s:
            return ""
        self._next_sign_s = t_s + self._wait_s()
        nods, brows = self._rates()
        brow = float(self._rng.random()) * (nods + brows) >= nods
        return BROW_FLASH if brow else NOD

    def _plan_speech(self, mode: AversionMode, confidence: float, begins: bool, t_s: float) -> None:
        """Plan the look away at the beginning of a turn, and the return before its end."""
        par, left_s = self._params, self._ends_s - t_s
        if self._ends_s < inf:
            early_s = max(0.0, self._normal(par.yield_s, par.yield_sd_s))
            early_s += (1.0 - confidence) * _UNSURE_RATIO * left_s
            self._yields_s = max(t_s, self._ends_s - early_s)
        if not begins:
            return
        averts = left_s >= par.long_turn_s and self._rng.random() < par.starts_averted_share
        away_s = max(0.3, self._normal(par.start_away_s, par.start_away_sd_s))
        self._aversion.converse(mode, t_s, averts, away_s)

    def _focus(self, state: TurnState) -> "tuple[float, float] | None":
        """Return the addressee's share and the least salience of faces; None when idle."""
        if state == "idle":
            return None
        listens = state in ("listening", "interrupted")
        return (0.0 if listens else self._params.addressee_share), self._params.salience

    def _rates(self) -> tuple[float, float]:
        """Return this head's own rates of nods and brow flashes, per minute."""
        par = self._params
        nods, brows = (exp(par.individual_spread * one) for one in self._own)
        return par.nods_per_min * nods, par.brow_flashes_per_min * brows

    def _wait_s(self) -> float:
        """Draw the time to the next sign of listening; inf without signs."""
        rate = sum(self._rates())
        return float(self._rng.exponential(60.0 / rate)) + 1.0 if rate > 0.0 else inf

    def _normal(self, mean_s: float, sd_s: float) -> float:
        return mean_s + sd_s * float(self._rng.standard_normal())
