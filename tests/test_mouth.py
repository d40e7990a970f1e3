"""The opening of a mouth from sound."""

from itertools import pairwise

import numpy as np
import pytest

from gazerig.gaze.mouth.loudness import (
    FRAME_S,
    WINDOW_S,
    band_pressures,
    loud_pressure,
    openings,
)
from gazerig.gaze.mouth.mouth_keys import (
    Closure,
    JawLimits,
    estimated_closures,
    frame_s,
    mouth_keys,
    phoneme_closures,
)
from gazerig.gaze.mouth.stream_mouth import StreamMouth
from gazerig.gaze.types import Floats

RATE = 16000
FAST = JawLimits(20.0, 800.0)


def tone(hz: float, seconds: float, size: float = 0.5) -> Floats:
    samples: Floats = size * np.sin(2 * np.pi * hz * np.arange(round(seconds * RATE)) / RATE)
    return samples


def test_the_pressure_is_the_root_mean_square_in_the_band_of_an_open_mouth() -> None:
    inside, murmur, hiss = (band_pressures(tone(hz, 1.0), RATE) for hz in (1000, 200, 6000))
    assert len(inside) == pytest.approx((1.0 - WINDOW_S) / FRAME_S, abs=2)
    assert inside == pytest.approx(0.5 / np.sqrt(2), rel=0.01)
    assert max(murmur.max(), hiss.max()) < 0.05 * inside.min()
    assert len(band_pressures(tone(1000, 0.01), RATE)) == 0


def test_a_frame_has_its_time_at_every_rate_also_in_a_stream() -> None:
    rate = 22050
    samples = np.zeros(60 * rate)
    samples[50 * rate : 51 * rate] = tone(1000, 1.0)[:RATE][np.arange(rate) * RATE // rate]
    whole = band_pressures(samples, rate)
    middle = np.flatnonzero(whole > 0.1).mean()
    assert frame_s(middle) == pytest.approx(50.5, abs=0.005)
    mouth = StreamMouth(rate)
    for piece in np.array_split(samples, 1500):
        mouth.add(piece)
    assert mouth.opening_at(49.9) == 0.0 and mouth.opening_at(50.5) > 0.5
    assert mouth.opening_at(51.1) == 0.0


def test_ten_decibels_less_are_half_as_loud() -> None:
    loud, half, shut_at = openings(np.array([1.0, 10**-0.5, 10**-1.5]), 1.0)
    shut = 10 ** (-30 / 20 * 0.6)
    assert loud == 1.0 and shut_at == pytest.approx(0.0, abs=1e-9)
    assert half * (1 - shut) + shut == pytest.approx(0.5, abs=0.002)


@pytest.mark.parametrize("samples", [np.zeros(RATE), np.zeros(0), np.full(RATE, 1.0)])
def test_silence_nothing_and_a_constant_keep_the_mouth_shut(samples: Floats) -> None:
    pressures = band_pressures(samples, RATE)
    keys = mouth_keys(openings(pressures, loud_pressure(pressures)), (), FAST)
    assert all(key.opening == 0.0 for key in keys)


def syllables(count: int, period_s: float = 0.25) -> Floats:
    """Return openings of syllables without pauses."""
    t_s = np.arange(round(count * period_s / FRAME_S)) * FRAME_S
    return np.asarray(0.45 - 0.45 * np.cos(2 * np.pi * t_s / period_s), dtype=np.float64)


@pytest.mark.parametrize("limits", [FAST, JawLimits(5.0, 60.0)])
def test_keys_follow_the_loudness_as_fast_as_the_jaw_can_and_stay_closed(
    limits: JawLimits,
) -> None:
    opening = syllables(8)
    shut = (Closure(0.98, 1.03), Closure(1.5, 1.5))
    keys = mouth_keys(opening, shut, limits)
    times = [key.time_s for key in keys]
    assert times == sorted(times) and keys[0].opening == keys[-1].opening == 0.0
    assert min(np.diff(times)) > 0.019
    for a, b in pairwise(keys):
        assert abs(b.opening - a.opening) <= limits.stroke(b.time_s - a.time_s) + 1e-9
    for closure in shut:
        near = [k for k in keys if closure.begin_s - 0.001 <= k.time_s <= closure.end_s + 0.001]
        assert near and all(key.opening == 0.0 for key in near)
    if limits is FAST:
        peaks = [key for key in keys if key.opening > 0.5]
        assert len(peaks) == 8
        assert peaks[2].time_s == pytest.approx(frame_s(62.5), abs=0.011)


def test_lips_close_before_p_and_within_b_and_m() -> None:
    names = [("p", 0.2), ("a", 0.23), ("m", 0.4), ("a", 0.5), ("b", 0.6), ("m", 0.68), ("b", 0.78)]
    p, m, held = phoneme_closures(names, 0.9)
    assert p.end_s == 0.2 and 0.13 < p.begin_s < 0.16
    assert m.begin_s == 0.4 and 0.45 < m.end_s < 0.5
    assert held.end_s - held.begin_s <= 0.12001 and 0.8 < held.end_s < 0.9


def test_without_phonemes_short_dips_are_closures_and_a_slow_end_is_none() -> None:
    opening = syllables(4)
    opening[40:46] = 0.1
    found = estimated_closures(opening)
    assert any(one.begin_s <= frame_s(42) <= one.end_s for one in found)
    assert estimated_closures(np.linspace(1.0, 0.5, 200)) == ()
    assert estimated_closures(np.zeros(0)) == ()


def test_a_stream_opens_the_mouth_as_the_whole_sound_does() -> None:
    t_s = np.arange(3 * RATE) / RATE
    samples = tone(1000, 3.0) * (0.5 - 0.5 * np.cos(2 * np.pi * 4 * t_s))
    mouth = StreamMouth(RATE)
    for piece in np.array_split(samples, 75):
        mouth.add(piece)
    whole = openings(band_pressures(samples, RATE), loud_pressure(samples))
    times = [frame_s(i) for i in range(100, len(whole) - 20)]
    found = np.array([mouth.opening_at(at_s) for at_s in times])
    assert np.corrcoef(found, whole[100 : 100 + len(found)])[0, 1] > 0.95
    assert mouth.opening_at(-1.0) == mouth.opening_at(4.0) == 0.0
