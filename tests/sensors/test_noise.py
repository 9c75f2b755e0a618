"""The distribution of sensor noise."""

import math

import numpy as np
import pytest

from kbot.sensors.noise import Noise, NoiseSource
from kbot.text import KbotError

N = 4000


def _samples(noise, seed=1, name="n", period=0.01, count=4):
    source = NoiseSource(noise, seed, name, count, period)
    return np.array([source.apply(np.zeros(count), k) for k in range(1, N + 1)])


def test_white_noise_is_normal():
    values = _samples(Noise(stddev=0.3, mean=0.1))
    total = values.size
    # four standard errors of the mean, deviation, skewness and kurtosis of a normal sample
    assert values.mean() == pytest.approx(0.1, abs=4 * 0.3 / math.sqrt(total))
    assert values.std() == pytest.approx(0.3, abs=4 * 0.3 / math.sqrt(2 * total))
    z = (values - values.mean()) / values.std()
    assert (z**3).mean() == pytest.approx(0.0, abs=4 * math.sqrt(6 / total))
    assert (z**4).mean() == pytest.approx(3.0, abs=4 * math.sqrt(24 / total))
    # no correlation between successive samples or neighbouring values
    assert (z[1:] * z[:-1]).mean() == pytest.approx(0.0, abs=4 / math.sqrt(total))
    assert (z[:, 0] * z[:, 1]).mean() == pytest.approx(0.0, abs=4 / math.sqrt(N))


def test_random_walk_bias_spreads_with_the_square_root_of_time():
    ends = [NoiseSource(Noise(walk=0.2), seed, "n", 8, 0.01).bias(100) for seed in range(60)]
    # 0.2 after 1 s; four standard errors of the deviation of 480 values
    assert np.std(ends) == pytest.approx(0.2, abs=4 * 0.2 / math.sqrt(2 * 480))


def test_bias_with_a_correlation_time_stays_bounded():
    noise = Noise(walk=0.2, correlation_time=0.05)
    ends = [NoiseSource(noise, seed, "n", 8, 0.01).bias(200) for seed in range(60)]
    # its variance approaches walk^2 tau / 2
    settled = 0.2 * math.sqrt(0.05 / 2)
    assert np.std(ends) == pytest.approx(settled, abs=4 * settled / math.sqrt(2 * 480))


def test_constant_bias_is_drawn_once():
    first = [NoiseSource(Noise(bias_mean=1.0, bias_stddev=0.5), s, "n", 8, 0.01).bias(0) for s in range(60)]
    assert np.mean(first) == pytest.approx(1.0, abs=4 * 0.5 / math.sqrt(480))
    assert np.std(first) == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(2 * 480))
    source = NoiseSource(Noise(bias_stddev=0.5), 1, "n", 3, 0.01)
    assert np.array_equal(source.bias(0), source.bias(99))


def test_sample_does_not_depend_on_earlier_samples():
    noise = Noise(stddev=0.1, walk=0.2, bias_stddev=1.0)
    in_order, astray = (NoiseSource(noise, 7, "n", 2, 0.01) for _ in range(2))
    expected = [in_order.apply(np.zeros(2), k) for k in range(1, 20)]
    for k in (19, 3, 11, 4):
        assert np.array_equal(astray.apply(np.zeros(2), k), expected[k - 1])


def test_noise_differs_by_seed_and_name():
    noise = Noise(stddev=1.0)
    values = [_samples(noise, seed, name)[:200] for seed, name in ((1, "a"), (2, "a"), (1, "b"))]
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert abs((values[a] * values[b]).mean()) < 4 / math.sqrt(800)


def test_values_are_rounded_to_the_precision():
    values = _samples(Noise(stddev=0.3, precision=0.25))
    assert set(np.unique(values / 0.25 % 1.0)) == {0.0}


@pytest.mark.parametrize(
    "numbers", [{"stddev": -1}, {"walk": math.nan}, {"correlation_time": 0.0}, {"mean": math.inf}]
)
def test_invalid_noise_settings_are_rejected(numbers):
    with pytest.raises(KbotError):
        Noise(**numbers)
