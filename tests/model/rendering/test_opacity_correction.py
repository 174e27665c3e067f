"""Opacity of a sample and its derivative, against arithmetic of 60 digits."""

from decimal import Decimal, localcontext

import numpy as np
import pytest

from model.rendering.opacity_correction import NEARLY_OPAQUE, per_sample, per_sample_derivative


def power(base, exponent):
    """(1 - base) to the power of an exponent, to 60 digits; 0 to the power of 0 is 1."""
    with localcontext() as context:
        context.prec = 60
        transparency = 1 - Decimal(base)
        return transparency ** Decimal(exponent) if transparency or exponent else Decimal(1)


@pytest.mark.parametrize("opacity", [0.0, 1e-7, 0.5, 0.9, NEARLY_OPAQUE, 1.0])
@pytest.mark.parametrize("distance", [0.25, 0.5, 1.0, 2.0])
def test_value_and_derivative_to_all_digits(opacity, distance):
    value = per_sample(np.array([opacity]), distance)
    assert value.dtype == np.float64
    assert value[0] == pytest.approx(float(1 - power(opacity, distance)), rel=1e-14)
    if opacity < 1:
        exact = float(Decimal(distance) * power(opacity, distance - 1))
        derivative = per_sample_derivative(np.array([opacity]), distance)
        assert derivative[0] == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("distance", [0.01, 0.25, 0.5, 1.0, 2.0])
def test_the_derivative_at_opaque_is_cut_off_below_one_voxel_and_exact_from_there_on(distance):
    nearly, opaque = per_sample_derivative(np.array([NEARLY_OPAQUE, 1.0]), distance)
    if distance < 1:
        assert opaque == pytest.approx(nearly) and 0 < opaque < 511
    else:
        assert opaque == {1.0: 1.0, 2.0: 0.0}[distance]
