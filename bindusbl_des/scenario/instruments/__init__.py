"""What vehicles measure with, and what is wrong with it: sheets in the terms of the simulation."""
