"""What tests of the reproduction share of it."""

from bindusbl_des.experiments.reproduction import campaigns
from bindusbl_des.experiments.reproduction.numbers import (
    Measured,
    Prediction,
    Published,
    Reason,
    published,
)

__all__ = ["Measured", "Prediction", "Published", "Reason", "campaigns", "published"]
