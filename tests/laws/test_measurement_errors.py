import numpy as np
import pytest

from coop_drake.laws.measurements import square_wave, write_errors, write_normals


@pytest.mark.parametrize(
    ("phase", "signs"), [(0.0, "++--++--"), (0.25, "+--++--+"), (0.5, "--++--++"), (1.0, "++--++--")]
)
def test_a_wave_is_positive_in_its_first_half(phase, signs):
    values = [square_wave(number, 0.2, 4.0, phase) for number in range(8)]
    assert values == [0.2 if sign == "+" else -0.2 for sign in signs]


def test_a_wave_that_is_no_whole_number_of_periods_has_the_right_mean_length():
    values = np.array([square_wave(number, 1.0, 7.3, 0.1) for number in range(7300)])
    assert np.count_nonzero(np.diff(values) > 0.0) == int(7299 / 7.3 + 0.1)
    assert abs(values.mean()) < 0.02


def test_noise_and_waves_add_up_and_neither_acts_where_it_is_not_asked_for():
    deviations, waves = (
        np.array([0.0, 0.5, 2.0]),
        np.array([[0.3, 2.0, 0.0], [0.0, 2.0, 0.0], [0.1, 2.0, 0.0]]),
    )
    errors, drawn = np.empty(3), np.empty(3)
    for number in range(4):
        write_errors(9, deviations, waves, number, errors)
        write_normals(9, number, drawn)
        sign = 1.0 if number % 2 == 0 else -1.0
        np.testing.assert_allclose(errors, deviations * drawn + sign * waves[:, 0], atol=1e-15)
