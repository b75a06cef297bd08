"""Memory that is kept need not be asked for again."""

import subprocess
import sys
from platform import libc_ver

import pytest

from bindusbl_des.support.arrays import keep_memory

FAULTS = f"""
import resource
import numpy as np
from {keep_memory.__module__} import keep_memory

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    np.ones(500_000), np.ones(250_000)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

if {{}}:
    keep_memory(8_000_000)
faults()
print(faults())
"""


@pytest.mark.skipif(libc_ver()[0] != "glibc", reason="others keep what they like")
def test_memory_is_kept_for_the_next_array() -> None:
    """Of 6 MB that were there before, hardly a page is asked for again."""

    def asked(kept: bool) -> int:
        code = [sys.executable, "-c", FAULTS.format(kept)]
        return int(subprocess.run(code, capture_output=True, text=True, check=True).stdout)

    assert 10 * asked(True) < asked(False)
