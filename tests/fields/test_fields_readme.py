"""The example of the package's own README runs and does what it says."""

import re
from pathlib import Path

import numpy as np
import pytest

import coop_drake.fields

README = Path(coop_drake.fields.__file__).with_name("README.md")


def test_the_examples_lead_every_start_to_the_goal():
    first, compiled = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    names = {}
    exec(first, names)
    exec(compiled, names)
    assert names["T"].shape == (2, 2)
    assert names["J"].shape == (2, 2, 2)
    assert np.hypot(*names["velocity"]) == pytest.approx(0.5)
    assert names["streamlines"].arrived.all()
    assert not names["cell"].interiors
    speed = names["speed"](*names["field"].kernel_arguments, 0.5, 0.5)
    assert speed == pytest.approx(np.hypot(*names["velocity"]))
