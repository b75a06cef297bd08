"""Schedules that ship: which AUVs ping in which slot, and how long slots are."""
