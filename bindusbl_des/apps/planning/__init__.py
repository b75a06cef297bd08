"""How many ASVs, where, with which schedule: predicted, simulated where it matters, and answered.

A `Question` (question.py) holds a scenario, the points that may be chosen, goals and a confidence.
A `Team` (teams.py) is one such choice, with its price and prediction.  What is predicted only
narrows the choice; what is answered was simulated on paired seeds (flying.py) and holds with the
stated confidence (selecting.py).  The answer is flown again in worse conditions (doubting.py).

All that is found is one record, `plan.json` (answer_text.py): the terminal (`summary`) and the page
(plan_page.py) read that alone.
"""
