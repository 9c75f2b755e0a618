import pytest

from kbot.model.load import load_robot


@pytest.fixture(scope="session")
def robot():
    return load_robot("kbot").require()
