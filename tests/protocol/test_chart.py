"""Where the fleet believes AUVs to be, by their fixes and what is planned for them."""

import math

import pytest
from voyages import way

from bindusbl_des.core.protocol.predicted_positions import Touring

# There and back, on legs two metres apart.
HAIRPIN = way((0.0, 100.0), (1.0, math.pi), (0.0, 100.0))


@pytest.mark.parametrize(("along", "aside"), [(91.0, 1.4), (93.0, 1.2), (95.0, 1.1)])
def test_a_fix_beside_the_way_is_of_the_leg_that_the_auv_is_on_by_now(
    along: float, aside: float
) -> None:
    """A fix nearer to the leg back than to that of the AUV does not send it there."""
    course = Touring(HAIRPIN, speed=1.0)
    course.fixed(along - 40.0, (along - 40.0, 0.0))
    course.fixed(along, (along, aside))
    assert course.at(along) == pytest.approx((along, 0.0), abs=0.1)
    assert course.at(along + 5.0) == pytest.approx((along + 5.0, 0.0), abs=0.1)
