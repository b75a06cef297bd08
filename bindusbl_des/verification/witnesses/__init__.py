"""Scenarios in which two signals overlap: who begins where, goes where, and is how late."""
