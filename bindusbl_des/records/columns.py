"""How the columns of a table are described, in the class of its rows."""

from dataclasses import MISSING, field
from typing import Any

# Which of a fleet's values of a metric is the worst one
LARGEST, SMALLEST = "largest", "smallest"


def column(unit: str, meaning: str, default: Any = MISSING, worst: str = "") -> Any:
    """Describe one column: its unit ("" for names and labels) and its meaning.

    `worst` says of a metric which of a fleet's values is the worst one, LARGEST or SMALLEST; empty
    for what is neither good nor bad.
    """
    return field(default=default, metadata={"unit": unit, "meaning": meaning, "worst": worst})
