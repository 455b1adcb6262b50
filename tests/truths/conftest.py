"""Coverage is not measured here: these tests run, very often, lines that other tests run once, too."""

from pathlib import Path

import pytest


def pytest_collection_modifyitems(items):
    """Mark the tests of this folder; measuring takes twice as long as what is measured."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.no_cover)
