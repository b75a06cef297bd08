"""The least team of ASVs that meets the goals of a survey: how many, where, with which schedule.

A `Question` (question.py) holds a scenario, the settings that may vary, goals and a confidence.  A
`Team` (teams.py) is one choice of these settings, with its price and its predicted values.
Predictions (prediction/) only narrow the choice; the answer was simulated on paired seeds
(flying.py) and meets the goals with the stated confidence (selecting.py).  It is then simulated
under worse conditions (doubting.py).

All results form one record, `plan.json` (answer_text.py); the terminal (`summary`) and the page
(plan_page.py) read that alone.
"""
