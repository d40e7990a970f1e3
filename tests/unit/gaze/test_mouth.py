"""The opening of a mouth from sound."""

import numpy as np
import pytest

from gazerig.gaze.minimum_jerk import MinimumJerkBlend
from gazerig.gaze.track.mouth import FRAME_S, WINDOW_S, Mouth
from gazerig.gaze.types import Floats

RATE = 16000


def tone(hz, seconds, size=0.5):
    samples: Floats = size * np.sin(2 * np.pi * hz * np.arange(round(seconds * RATE)) / RATE)
    return samples


def test_the_pressure_is_the_root_mean_square_in_the_band_of_an_open_mouth():
    inside, murmur, hiss = (Mouth(RATE).band_pressures(tone(hz, 1.0)) for hz in (1000, 200, 6000))
    assert len(inside) == pytest.approx((1.0 - WINDOW_S) / FRAME_S, abs=2)
    assert inside == pytest.approx(0.5 / np.sqrt(2), rel=0.01)
    assert max(murmur.max(), hiss.max()) < 0.05 * inside.min()
    assert len(Mouth(RATE).band_pressures(tone(1000, 0.01))) == 0


def mouth_of(samples, pieces=1, rate=RATE):
    mouth = Mouth(rate)
    for piece in np.array_split(samples, pieces):
        mouth.add(piece)
    return mouth


def test_a_frame_has_its_time_at_every_rate_also_in_a_stream():
    rate = 22050
    samples = np.zeros(60 * rate)
    samples[50 * rate : 51 * rate] = tone(1000, 1.0)[:RATE][np.arange(rate) * RATE // rate]
    mouth = mouth_of(samples, 1500, rate)
    assert mouth.opening_at(49.9) == 0.0 and mouth.opening_at(50.5) > 0.5
    assert mouth.opening_at(51.1) == 0.0


def test_ten_decibels_less_are_half_as_loud():
    parts = [tone(1000, 0.2, 0.8 * 10**-level) for level in (0.0, 0.5, 1.5)]
    mouth, shut = mouth_of(np.concatenate(parts)), 10 ** (-30 / 20 * 0.6)
    loud, half, shut_at = (mouth.opening_at(t_s) / 0.9 for t_s in (0.1, 0.3, 0.5))
    assert loud == 1.0
    for opening, less, after_s in ((half, 0.5, 0.1), (shut_at, 1.5, 0.3)):  # the loudest part fades
        loudness = (10**-less * np.exp(after_s / 8.0)) ** 0.6
        assert opening * (1 - shut) + shut == pytest.approx(loudness, abs=5e-4)


@pytest.mark.parametrize("samples", [np.zeros(RATE), np.zeros(0), np.full(RATE, 1.0)])
def test_silence_nothing_and_a_constant_keep_the_mouth_shut(samples):
    assert all(value == 0.0 for _, value in mouth_of(samples).keys(1.0))


def spoken(period_s, seconds=3.0):
    """Return syllables without pauses, which are never silent."""
    t_s = np.arange(round(seconds * RATE)) / RATE
    loud = 0.6 - 0.4 * np.cos(2 * np.pi * t_s / period_s)
    return np.asarray(tone(1000, seconds) * loud, dtype=np.float64)


def followed(mouth, seconds):
    """Return times, and the opening of a level that follows the keys of a mouth, as it is led."""
    level = MinimumJerkBlend((0.0,), 0.08)
    keys = np.array(mouth.keys(seconds, 0.04)).T
    times = np.arange(0.0, seconds, 0.005)
    found = []
    for t_s in times.tolist():
        level.move_to((float(np.interp(t_s, *keys)),))
        found.append(level.step(t_s)[0])
    return times, np.array(found)


def test_the_level_reaches_the_loud_parts_and_is_closed_in_every_closure():
    mouth = mouth_of(spoken(0.25))
    mouth.close([("m", 0.98), ("a", 1.06), ("p", 1.5)], 3.0)
    shut = ((0.98, 1.03), (1.445, 1.5))
    times, found = followed(mouth, 3.0)
    for begin_s, end_s in shut:
        near = (times >= begin_s - 0.005) & (times <= end_s + 0.005)
        assert found[near].min() < 0.03
    opened = found[(times > 0.2) & (times < 0.9)]
    assert 0.8 < opened.max() <= 0.9 and opened.min() > 0.3
    peaks = times[1:-1][
        (found[1:-1] > found[:-2]) & (found[1:-1] >= found[2:]) & (found[1:-1] > 0.7)
    ]
    late_s = np.array([min(abs(t - 0.125 - 0.25 * k) for k in range(12)) for t in peaks])
    assert np.median(late_s) < 0.012


def test_lips_close_before_p_and_within_b_and_m():
    mouth = mouth_of(tone(1000, 1.0))
    mouth.close([("p", 0.3), ("a", 0.33), ("m", 0.4), ("a", 0.6), ("b", 0.7), ("a", 0.9)], 1.0)
    closed = [t for t in (0.25, 0.35, 0.52, 0.56, 0.78, 0.83)
              if mouth.opening_at(t) == 0.0]  # fmt: skip
    assert closed == [0.25, 0.52, 0.78]


def test_without_phonemes_short_dips_are_closures_and_a_slow_end_is_none():
    samples = tone(1000, 1.0)
    samples[round(0.5 * RATE) : round(0.56 * RATE)] *= 0.05
    times, found = followed(mouth_of(samples), 1.0)
    assert found[(times > 0.5) & (times < 0.56)].min() < 0.05
    slow = mouth_of(tone(1000, 2.0) * np.linspace(1.0, 0.3, 2 * RATE))
    assert min(slow.opening_at(t) for t in np.arange(0.1, 1.9, 0.01)) > 0.3


def test_a_stream_opens_the_mouth_as_the_whole_sound_does():
    samples = spoken(0.25)
    whole, pieces = mouth_of(samples), mouth_of(samples, 75)
    first, other = (np.array(mouth.keys(3.0)) for mouth in (whole, pieces))
    assert other == pytest.approx(first, abs=1e-6)
    assert pieces.opening_at(-1.0) == pieces.opening_at(4.0) == 0.0
    assert whole.keys(2.0)[-1] == (2.0, 0.0)
