"""When sounds are over at vehicles, as far as it is known how everybody moves."""

from math import inf

import numpy as np
import simpy

from ..acoustics.signals import solve_row
from ..acoustics.sounds import Sounds
from ..acoustics.travel_time import NEARLY_THERE
from ..vehicles.fleet import VehicleFleet

# A sound that nobody waits to decode is looked at again so much later (s), where it is not known
# when it will be there.
SOON = 1e-3


class Hearing:
    """What is to come of the sounds of a band at AUVs and ASVs, the fleets."""

    def __init__(
        self, env: simpy.Environment, fleets: tuple[VehicleFleet, VehicleFleet], sounds: Sounds,
        sound_speed: float,
    ) -> None:  # fmt: skip
        self._env, self._fleets, self._sounds, self._speed = env, fleets, sounds, sound_speed
        self._auvs, self._foreseen = len(fleets[0]), all(fleet.foreseen for fleet in fleets)

    def known(self, time: float) -> float:
        """Return up to when (s) it is known how everybody moves, at least to an instant (s)."""
        if self._foreseen:
            return inf
        for fleet in self._fleets:
            fleet.advance(time)
        return time

    def expected_end(self, row: int) -> float:
        """Return when (s) a sound is over, or an instant before that at which to look again."""
        sound, now, sea = self._sounds.array[row], self._env.now, self._sounds.sea
        if not self._foreseen:
            away = np.linalg.norm(
                np.subtract(self._place(int(sound["sender"])), self._place(int(sound["listener"])))
            )
            way = float(away) / self._speed
            leaves = float(sound["sent_at_s"] + sound["late_s"])
            leaves += float(sound["lasts_s"]) if self._sounds.long else 0.0
            near = leaves + NEARLY_THERE * way
            if near > now:
                return near
            known = self.known(now + (1.0 - NEARLY_THERE) * way + SOON)
        else:
            known = inf
        solve_row(sea.address, row, known)
        end = float(self._sounds.array[row]["ended_at_s"])
        return end if end < inf else now + SOON

    def _place(self, vehicle: int) -> tuple[float, float, float]:
        """Return where (m) a vehicle is now."""
        fleet, number = (0, vehicle) if vehicle < self._auvs else (1, vehicle - self._auvs)
        x, y, z, _ = self._fleets[fleet].vehicles[number].at(self._env.now)
        return x, y, z
