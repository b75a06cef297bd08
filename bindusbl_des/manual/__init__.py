"""The pages of the manual that the program writes itself; tests tell when they are stale.

``python -m bindusbl_des.manual > docs/reference.md`` writes the reference again, ``python -m
bindusbl_des.manual python > docs/python.md`` the page on Python.
"""

from .python_page import python_page
from .reference_page import reference

__all__ = ["python_page", "reference"]
