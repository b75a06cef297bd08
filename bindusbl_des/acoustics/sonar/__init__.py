"""The sonar equation: how loud a signal is, in which noise, and how surely it is decoded."""
