"""How often a process looks for garbage."""

import gc

# So many objects are made before the youngest are looked through.
YOUNG = 50_000


def collect_seldom() -> None:
    """Look for garbage more seldom than Python does, in a process that is ours.

    What a mission loads makes a hundred thousand objects, all of which stay; Python looks through
    them 260 times meanwhile, which takes a sixth of the time.
    """
    gc.set_threshold(YOUNG)
