import numpy as np
import pytest

from coop_drake.laws import acceleration_at, wrench_share
from coop_drake.systems import WrenchLaw
from tests.support.robot_matrices import turned
from tests.support.system_checks import evaluate

P_LE, P_LLCM = np.array([0.4, 0.1]), np.array([0.05, -0.02])
INPUTS = {
    "object_state": [3.8, 3.5, 0.7, 0.3, 0.1, 0.9],
    "governor_command": [7.0, 8.0, 1.2, -0.4],
    "axis_acceleration": [2.0, 9.0, 10.0],
}
DESIRED = np.array([1.2, -0.4, 2.0])


@pytest.fixture
def law():
    return WrenchLaw(P_LE, p_LLcm=P_LLCM, mass=3.0, inertia=0.7, share=0.25, joints=2)


def test_outputs_are_the_laws(law):
    np.testing.assert_array_equal(evaluate(law, INPUTS, "object_acceleration"), DESIRED)
    r, com = turned(0.7, P_LE), turned(0.7, P_LLCM)
    grasp, share = np.split(evaluate(law, INPUTS, "hand_command"), 2)
    np.testing.assert_allclose(grasp, [*acceleration_at(*r, *DESIRED, 0.9), DESIRED[2]], rtol=1e-14)
    of_com = acceleration_at(*com, *DESIRED, 0.9)
    expected = wrench_share(*(com - r), *of_com, DESIRED[2], 3.0, 0.7, 0.25)
    np.testing.assert_allclose(share, expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("mass", "inertia", "share", "complaint"),
    [
        (0.0, 1.0, 0.5, "needs positive mass and inertia, not"),
        (1.0, -1.0, 0.5, "needs positive mass and inertia, not"),
        (np.nan, 1.0, 0.5, "needs positive mass and inertia, not"),
        (1.0, 1.0, -0.1, "share must lie in"),
        (1.0, 1.0, 1.1, "share must lie in"),
        (1.0, 1.0, np.nan, "share must lie in"),
    ],
)
def test_bad_parameters_are_refused(mass, inertia, share, complaint):
    with pytest.raises(ValueError, match=complaint):
        WrenchLaw(P_LE, p_LLcm=P_LLCM, mass=mass, inertia=inertia, share=share, joints=0)
