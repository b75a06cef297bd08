"""Runs under test keep their warnings as errors and their results in temporary folders."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
