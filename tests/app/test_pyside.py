import sys

from PySide6.QtCore import QObject


def test_calls_keep_the_references_to_none():
    """PySide6 6.12.0 under Python 3.11 lost one at every call, and the window crashed."""
    an_object = QObject()
    before = sys.getrefcount(None)
    for _ in range(2000):
        an_object.setObjectName("name")
    assert sys.getrefcount(None) > before - 1000
