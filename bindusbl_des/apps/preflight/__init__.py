"""What is known before a mission: warnings, limits, and what time and memory it takes.

Nothing is simulated here.  All of it follows from the facts of a scenario (`Setup`), from where its
vehicles are planned to be, and from the protocol's own slots.

**How long a round lasts** is asked of the downlink itself, run without sound
(`core/protocol/cycles.py`).  :mod:`.round_lengths` says which ping groups, fixes and named AUVs a
round may have, so that its length lies between `Rounds.least` and `Rounds.length`.  Only a
user-defined downlink knows its own: those of `sequential` stand in, and `are_known` is False.

**Who is in range of whom** is looked at in at most 121 instants, midway through equal parts of the
mission (:mod:`.limits`).  AUVs are where their routes have them, and a ring stands in for vessels
that move.  An ASV that has failed neither hears nor is heard.

**How likely a fix is** (:mod:`.fix_chance`): a ping is decoded by ASV k with p_k, independently, so
a fix is made with 1 - prod(1 - p_k); it is delivered with the mean, over the ASVs whose turn it may
be to broadcast, of the chance that the AUV decodes the frame.  Left out are all other sounds: pings
and frames that overlap, relays and repetition.  `band_warnings.left_out` says which of these count.

**What no protocol exceeds** (:mod:`.bounds`): two AUVs that the same ASV hears conflict.  The
largest number that one ASV hears, the clique number and the chromatic number of that graph bound
the slots of a round from below.  The chromatic number is exact up to 20 AUVs, and wherever a
colouring needs no more slots than one ASV hears; else it lies between two numbers.  Rates of pings,
records and fixes are bounded by what an ASV decodes, what a frame holds, and travel times.

**Warnings** say what is lawful, and yet changes the answers: each with its numbers, at the line of
its key.  Keys without effect follow from what parts declare (:mod:`.idle_keys`).  What contradicts
itself is no warning, but a mistake (`scenario/agreement`), or refused before the mission
(:mod:`.refusals`).
"""
