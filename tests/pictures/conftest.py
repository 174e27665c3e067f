import pytest


def pytest_addoption(parser):
    parser.addoption(
        "--regenerate-pictures",
        action="store_true",
        help="store what is drawn now; look at the difference before it is committed",
    )


@pytest.fixture(scope="session")
def regenerates(request):
    """Whether the pictures are stored anew, instead of compared."""
    # Where all tests run, pytest has read its options before it finds this folder.
    return bool(request.config.getoption("--regenerate-pictures", default=False))
