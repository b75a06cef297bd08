"""The paper again: its experiments run, its figures drawn, its numbers beside those measured here.

Experiments become campaigns, campaigns become measurements, and a rule (never a hand) gives each
published number its verdict: reproduced, differs or cannot be.
"""
