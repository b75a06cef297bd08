"""Write a page of the manual to stdout: the reference, or that on Python."""

import sys

from . import python_page, reference

PAGES = {"reference": reference, "python": python_page}

if __name__ == "__main__":
    asked = (sys.argv[1:] or ["reference"])[0]
    if asked not in PAGES:
        sys.exit(f"no page {asked!r}; there are {', '.join(PAGES)}")
    print(PAGES[asked](), end="")
