"""How many ASVs, where, with which schedule: predicted, simulated where it matters, and answered.

What is predicted only narrows the choice; what is answered was simulated on paired seeds and holds
with a stated confidence.
"""
