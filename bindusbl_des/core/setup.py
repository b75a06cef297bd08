"""The facts of a scenario: everything that follows from its keys, each derived once.

>>> from bindusbl_des import Scenario, Setup
>>> setup = Setup(Scenario(name="example", survey={"side_m": 60.0}))
>>> round(setup.slots.uplink_slot, 3), setup.stations_m[0]
(0.1, (50.0, 0.0))

Each fact imports the modules that it needs, so that `validate`, which asks for few, does not load
the rest.
"""

import math
from collections.abc import Iterator
from html import escape
from typing import TYPE_CHECKING

from ..support.facts import fact
from ..support.plugins import PluginError
from .scenario.own_sensors import Sensors
from .scenario.scenario import Scenario, kept, site_of

if TYPE_CHECKING:
    from .acoustics.channel import AskedChannel
    from .acoustics.loss import LossTerms
    from .acoustics.messages import Messages
    from .acoustics.named_channels import FrameChannel
    from .acoustics.propagation import SignalBand
    from .navigation.belief import Beliefs, Growths
    from .protocol.anchors.placing import Room
    from .protocol.slots import Slots
    from .usbl.instrument import Usbl
    from .vehicles.vehicle import SegmentedTrajectory

# The slowest sound (m/s): how long after the mission's end sound may still be on its way.
SLOWEST_SOUND = 1300.0

# The least lead (s) of an order to a vessel that moves.
STARTING_S = 1.0


class Setup(Sensors):
    """The facts of a scenario: frozen, each derived when it is first asked for, and stored.

    Positions are in the survey frame (m; x north, y east or as the area is rotated, z down), times
    in seconds.  ``Setup.facts()`` yields the name and the meaning of each; in a notebook a setup
    shows area, stations, slots, and which AUVs are within range of which ASV.
    """

    scenario: Scenario

    def __init__(self, scenario: Scenario) -> None:
        """Take a scenario.  Facts of a user-defined part that is not allowed, or not usable, raise
        PluginError.
        """
        self.__dict__.update(vars(site_of(scenario)))  # what its keys had to agree on

    @staticmethod
    def of(scenario: Scenario) -> "Setup":
        """Return the facts of a scenario; those of the last scenario are cached."""
        return _of(scenario)

    # HF and MF bands

    @fact
    def hf_band(self) -> "SignalBand":
        """The HF band: its range (m), the length of a ping (s), the speed of sound (m/s)."""
        from .acoustics.propagation import SignalBand

        hf = self.scenario.acoustics.hf
        slant = hf.range_metric == "slant"
        return SignalBand(slant, hf.range_m, hf.ping_s, self.sound_speed_m_per_s)

    @fact
    def ping_channel(self) -> "AskedChannel | None":
        """The channel that decides which pings are decoded; None for the compiled disc.

        Raises:
            ValueError: when the file of a curve or table holds none.
        """
        from .acoustics.named_channels import ping_channel

        return ping_channel(self)

    @fact
    def ping_loss(self) -> "LossTerms":
        """The chance that a ping is lost within the range of the disc."""
        from .acoustics.named_channels import loss_of

        acoustics, auvs = self.scenario.acoustics, self.scenario.auvs.count
        sharing = 0 if self.scenario.protocol.asvs_ping else auvs
        return loss_of(acoustics.loss, acoustics.hf.range_m, sharing)

    @fact
    def frame_channel(self) -> "FrameChannel | None":
        """The channel that decides which frames are decoded, by size (bytes) and airtime (s); None
        for the disc.  Errors are those of `ping_channel`.
        """
        from .acoustics.named_channels import frame_channel

        return frame_channel(self)

    @fact
    def messages(self) -> "Messages":
        """The messages of the downlink: their sizes (bytes) and airtimes (s)."""
        from .acoustics.messages import messages_of

        told = self.scenario.auvs.count if self.tells_slots else 0
        each = self.scenario.protocol.dissemination.assignment_bytes
        return messages_of(self.scenario.acoustics.mf, each, told)

    @fact
    def slots(self) -> "Slots":
        """Every duration (s) of the protocol: t_C, T_P, T_UL, guards; and the clock of slots."""
        from .protocol.slots import slots_of

        return slots_of(self, self.messages)

    @fact
    def reply_delay_s(self) -> float:
        """How long (s) after a ping's front an ASV answers it: 0, or the ping's length."""
        protocol = self.scenario.protocol
        early = protocol.answer.reply_at == "ping_front" and not protocol.replies_in_frames
        return 0.0 if early else self.scenario.acoustics.hf.ping_s

    @fact
    def planned_auvs(self) -> "list[SegmentedTrajectory]":
        """The planned motion of each AUV, AUV0 first; those with dynamics count as vehicles
        without, at their planned speed.

        Raises:
            ValueError: when the route cannot be flown.
            PluginError: when a user-defined route is not allowed, or makes none.
        """
        from .protocol.predicted_positions import planned_vehicles

        return planned_vehicles(self, self.scenario.duration_s)

    # The USBL instrument, and the navigators' beliefs

    @fact
    def usbl(self) -> "Usbl":
        """The USBL instrument that `usbl` states: of all ASVs without groups, and of AUVs (SI)."""
        from .acoustics.named_channels import timing_sd_of
        from .usbl.array import elements_of
        from .usbl.instrument import Usbl, sheet_of

        usbl = self.scenario.usbl
        roll, pitch, heading = map(
            math.radians, (usbl.roll_sd_deg, usbl.pitch_sd_deg, usbl.heading_sd_deg)
        )
        is_told = any(kind.name == "slow" for kind in self.estimated_errors)
        return Usbl(
            elements_of(usbl.array),
            usbl.tdoa_sd_s,
            usbl.travel_time_sd_s,
            usbl.quantum_s,
            (roll, pitch, heading),
            usbl.gnss_sd_m,
            self.assumed_sound_speed_m_per_s,
            self.sound_speed_m_per_s,
            sheet_of(usbl.model, self.ranging.calls),
            timing_sd_of(self.scenario.acoustics.hf),
            self.taken.scenario.usbl.slow_share if is_told else 0.0,
        )

    @fact
    def usbls(self) -> "tuple[Usbl, ...]":
        """The USBL instrument of each ASV (passive ranging: of AUVs); one where there is no ASV."""
        found: list[Usbl] = []
        for group in self.vessels:
            alone = self
            if group.usbl is not self.scenario.usbl:
                alone = type(self)(self.scenario.model_copy(update={"usbl": group.usbl}))
            found += [alone.usbl] * len(group.members)
        return tuple(found) or (self.usbl,)

    @fact
    def beliefs(self) -> "tuple[Beliefs, Growths]":
        """The initial belief of each AUV's navigator (m, m/s), and how its uncertainty grows."""
        from .navigation.assumptions import assumed

        return assumed(self.taken)

    # How far from the origin, and how long after the end, positions of vehicles are needed

    @fact
    def room(self) -> "Room":
        """How far (m) moving ASVs may go from the origin, and how long (s) sound travels at most.

        It is twice the distance of the farthest AUV from the origin, or an ASV's start if that is
        farther.
        """
        from .protocol.anchors.placing import Room

        area = self.area
        places = (
            *(end for auv in self.auvs for end in auv[-2:] if end is not None),
            *(place for route in self.routes for way in route.places for place in way),
            *(place[:2] for track in self.auv_tracks if track is not None for place in track[1]),
        )
        extent = max(area.farthest, area.across, *(math.hypot(*place) for place in places))
        vessels = (
            *(getattr(self.scenario.asvs.formation, "start_m", None) or ()),
            *(place[:2] for _, track in self.asv_tracks or () for place in track),
        )
        farthest = max([2.0 * extent, *(math.hypot(*place) for place in vessels)])
        path = extent + farthest + self.deepest_m
        return Room(farthest, STARTING_S + path / SLOWEST_SOUND)

    @fact
    def afterwards_s(self) -> float:
        """How long (s) after its end a mission still needs positions of vehicles: sound sent at the
        last instant is followed to the farthest one.
        """
        area, stations = self.area, self.kept_stations_m
        farthest = self.room.farthest_m
        if stations:
            farthest = max(math.hypot(x, y) for x, y in stations)
        ends = [math.hypot(*end) for auv in self.auvs for end in auv[-2:] if end is not None]
        across = self.scenario.acoustics.hf.range_m + 2 * max(area.across, area.farthest, *ends)
        return 2.0 + (farthest + across + self.deepest_m) / SLOWEST_SOUND

    @fact
    def control_intervals(self) -> int:
        """The control intervals in a trajectory that lasts `afterwards_s` beyond the mission."""
        from .vehicles.currents import CONTROL_S

        return math.ceil((self.scenario.duration_s + self.afterwards_s) / CONTROL_S)

    def __repr__(self) -> str:
        return "\n".join(self._lines())

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"

    def _lines(self) -> Iterator[str]:
        """Yield the lines that a setup shows in a notebook."""
        scenario, slots = self.scenario, self.slots
        yield f"{scenario.name}: {self.area.words}, {scenario.lasting}"
        if self.origin_deg is not None:
            yield f"x = y = 0 at {self.origin_deg[0]:.6f}, {self.origin_deg[1]:.6f} deg"
        hf, mf = scenario.acoustics.hf.range_m, scenario.acoustics.mf.range_m
        yield f"sound {self.sound_speed_m_per_s:.1f} m/s, HF {hf:g} m, MF {mf:g} m"
        yield (
            f"slots: crossing {1e3 * slots.crossing_time:.1f} ms, uplink "
            f"{1e3 * slots.uplink_slot:.1f} ms, frame of all fixes "
            f"{1e3 * slots.airtime(scenario.auvs.count):.0f} ms"
        )
        stations = self.kept_stations_m
        if not stations:
            yield f"{scenario.asvs.count} ASVs move ({scenario.asvs.formation.choice})"
            return
        for number, (x, y) in enumerate(stations):
            yield f"ASV{number} at ({x:.1f}, {y:.1f}) m{self._hears(number)}"

    def _hears(self, asv: int) -> str:
        """Describe which AUVs are within HF range of an ASV as the mission begins."""
        import numpy as np

        from .protocol.conflicts import hearing

        try:
            fleet = self.planned_auvs
        except (PluginError, ValueError):
            return ""
        starts = np.array([vehicle.at(0.0)[:3] for vehicle in fleet])
        station = np.array([[*self.stations_m[asv], 0.0]])
        heard = hearing(starts, station, self.hf_band.reach, self.hf_band.slant)[:, 0]
        if self.land is not None:
            heard &= ~self.land.crossed(starts, station)[:, 0]
        names = [f"AUV{auv}" for auv in np.flatnonzero(heard)]
        return f", at first within HF range of {', '.join(names) or 'no AUV'}"


# The setup of the last scenario
_of = kept(Setup)
