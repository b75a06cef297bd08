"""A page on this machine where one draws a survey, moves vessels, simulates, plans, and looks.

What lies on the desk is a scenario file (:mod:`.desk`), and each change of the page is a change of
it.  :mod:`.looking` says what that means, by the same functions that commands ask; what takes long
is a command in a process beside the server, which lies in a folder that outlives both
(:mod:`.jobs`).  :mod:`.server` lets one page of this machine's user ask for it, and nobody else.
The page draws, and works out nothing.
"""
