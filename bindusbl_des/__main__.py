"""`python -m bindusbl_des` is `bindusbl-des`."""

import sys

from .cli import main

sys.exit(main(prog_name="bindusbl-des"))
