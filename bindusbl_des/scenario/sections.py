"""A mission as its planner describes it: frozen, validated, units in the key names.

A :class:`Scenario` is plain data.  It knows nothing of files, clocks or random numbers: the same
scenario run with the same seed is the same mission.
"""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, field_validator

from .key_types import (
    LONGEST_NAME,
    PAPER,
    Part,
    Point,
    Real,
    Text,
    Whole,
    formerly,
    key,
)
from .navigation_keys import Navigation
from .own_sections import OwnPlacement, is_own
from .part_choice import SET, PartChoice
from .route_keys import Lawnmower, Route
from .usbl_keys import Usbl
from .vehicle_choice import AsvVehicle, AuvVehicle


class Survey(Part):
    """The square of sea to be surveyed, centred on the origin, and the depth to fly at."""

    side_m: Real = key(140.0, "m", "side L of the square survey area", PAPER, ge=0.1, le=1e5)
    depth_m: Real = key(10.0, "m", "depth at which the AUVs fly", PAPER, ge=0, le=11e3)


class Auvs(Part):
    """The underwater vehicles: how many, what they are, where they go."""

    count: Whole = key(3, "1", "number of AUVs", PAPER, ge=1, le=100_000)
    vehicle: AuvVehicle = key(
        "kinematic", "", "vehicle model, or {model: ..., coefficient: value, ...}"
    )
    speed_m_per_s: Real = key(
        0.627,
        "m/s",
        "speed along the route",
        "tab:case_study (182-192 m in 300 s)",
        ge=0.001,
        le=20,
    )
    turning_radius_m: Real = key(
        5.0, "m", "smallest turning radius (kinematic only)", ge=0.001, le=1e4
    )
    join_angle_deg: Real = key(
        20.0, "deg", "angle at which an AUV that has turned about joins a line again", ge=0.1, le=45
    )
    route: Route = Field(default=Lawnmower(), description="where the AUVs go")
    feedback: Literal["truth", "estimate"] = key(
        "truth", "", "what guidance steers by: the true position or the fused estimate", PAPER
    )


class Formation(Part):
    """Where the ASVs are moored: a regular N-gon (eq. formation) or given positions."""

    model: Literal["ring", "positions"] | None = key(
        None, "", "placement; null = positions where positions_m is given, else ring"
    )
    angle_deg: Real = key(
        0.0, "deg", "formation angle alpha_0 of ASV0 from +x", PAPER, ge=-360, le=360
    )
    clearance_m: Real = key(
        0.0, "m", "clearance Delta_b: R_f = hf.range_m + clearance_m", PAPER, ge=0, le=1e6
    )
    radius_m: Real | None = key(
        None, "m", "formation radius R_f itself; null = range plus clearance", ge=0, le=1e6
    )
    positions_m: tuple[Point, ...] | None = key(None, "m", "one [x, y] per ASV instead of an N-gon")

    @property
    def choice(self) -> PartChoice:
        """The placement as a part of the mission."""
        return PartChoice("ring" if self.positions_m is None else "positions")


Placement = Annotated[
    Annotated[Formation, Tag("shipped")] | Annotated[OwnPlacement, Tag("own")],
    Discriminator(lambda placement: "own" if is_own(placement, "model") else "shipped"),
]


class Asvs(Part):
    """The surface vessels that carry the USBL arrays."""

    count: Whole = key(3, "1", "number of ASVs", PAPER, ge=1, le=10_000)
    vehicle: AsvVehicle = key(
        "moored", "", "vessel model, or {model: ..., coefficient: value, ...}"
    )
    formation: Placement = Field(default=Formation(), description="where the ASVs keep station")


class Origin(Part):
    """Where on Earth the centre of the survey lies (WGS-84); +x is north there, +y east."""

    lat_deg: Real | None = key(
        None, "deg", "latitude of the survey's centre, for exports; null = nowhere", ge=-90, le=90
    )
    lon_deg: Real | None = key(
        None, "deg", "longitude of the survey's centre, positive to the east", ge=-180, le=180
    )

    @property
    def coordinates(self) -> tuple[float, float] | None:
        """Latitude and longitude (deg), None for a survey that is nowhere in particular."""
        if self.lat_deg is None or self.lon_deg is None:
            return None
        return self.lat_deg, self.lon_deg


class Environment(Part):
    """The water: how fast sound travels in it, how it moves, and where it is."""

    sound_speed_m_per_s: Real = key(1500.0, "m/s", "speed of sound c", PAPER, ge=1300, le=1700)
    assumed_sound_speed_m_per_s: Real | None = key(
        None,
        "m/s",
        "speed of sound that ranges, directions and slots are worked out with; null = the true one",
        ge=1300,
        le=1700,
    )
    current_m_per_s: Real = key(0.0, "m/s", "speed of the uniform current", ge=0, le=10)
    current_variation_m_per_s: Real = key(
        0.0, "m/s", "standard deviation of the current's slow variation per axis", ge=0, le=10
    )
    current_variation_time_s: Real = key(
        600.0, "s", "time constant of that variation (Gauss-Markov)", ge=1, le=1e6
    )
    current_direction_deg: Real = key(
        0.0, "deg", "direction the current flows to, from +x to +y", ge=-360, le=360
    )
    origin: Origin = Field(default=Origin(), description="the survey's place on Earth")

    @property
    def fleets_sound_speed(self) -> float:
        """The speed of sound (m/s) that the fleet assumes."""
        assumed = self.assumed_sound_speed_m_per_s
        return self.sound_speed_m_per_s if assumed is None else assumed

    @field_validator("origin", mode="before")
    @classmethod
    def _nowhere(cls, origin: Any) -> Any:
        """Read `origin: null` as no origin."""
        return {} if origin is None else origin


class Uplink(Part):
    """The high-frequency band on which AUVs ping."""

    range_m: Real = key(50.0, "m", "HF range R_HF", PAPER, ge=0.1, le=1e5)
    range_metric: Literal["horizontal", "slant"] = key(
        "horizontal", "", "which distance is compared with the HF range", PAPER
    )
    ping_s: Real = key(0.010, "s", "duration T_P of a ping", PAPER, ge=1e-6, le=10)
    channel: PartChoice = key(
        "disc", "", "which signals are decoded: those within range, but for acoustics.loss" + SET
    )


class Downlink(Part):
    """The medium-frequency band on which ASVs broadcast fixes."""

    range_m: Real = key(100.0, "m", "MF range R_MF (horizontal)", PAPER, ge=0.1, le=1e6)
    bit_rate_bps: Real = key(2000.0, "bit/s", "bit rate R_DL", PAPER, ge=1, le=1e9)
    overhead: Real = key(2.0, "1", "protocol overhead factor Lambda", PAPER, ge=1, le=100)
    header_bytes: Whole = key(8, "B", "header of a broadcast N_hdr", PAPER, ge=0, le=65_535)
    fix_bytes: Whole = key(16, "B", "record of one fix B_fix", PAPER, ge=1, le=65_535)


class Loss(Part):
    """Why a ping in range may still not be decoded."""

    law: Literal["paper", "thesis", "head", "none"] = key(
        "paper", "", "coefficients of eq. fix_loss: published digits, full digits, OEM head, none"
    )
    combine: Literal["clamp_first", "paper_raw", "off"] = key(
        "off", "", "how contention is added (eq. fix_loss_total); off = collisions are simulated"
    )
    contention_per_auv: Real = key(0.05, "1", "P_col per additional AUV", PAPER, ge=0, le=1)
    cap: Real = key(0.999, "1", "largest loss probability", PAPER, ge=0, le=1)


class Acoustics(Part):
    """The two acoustic bands and the loss on the uplink."""

    hf: Uplink = Field(default=Uplink(), description="uplink band")
    mf: Downlink = Field(default=Downlink(), description="downlink band")
    loss: Loss = Field(default=Loss(), description="loss of single pings")


class Protocol(Part):
    """Who pings when, who answers how, and what the clock is."""

    schedule: PartChoice = key("spatial_reuse", "", "which AUVs ping in which slot" + SET, PAPER)
    downlink: PartChoice = key("sequential", "", "when fixes are broadcast" + SET, PAPER)
    broadcaster: PartChoice = key("rotate", "", "which ASV broadcasts a round's fixes" + SET)
    ranging: PartChoice = key(
        "owtt_sync",
        "",
        "one-way (synchronised clocks) or two-way travel times of AUVs' pings, or AUVs that fix "
        "themselves by ASVs' pings (passive; the array and AHRS of usbl are theirs)" + SET,
    )
    positions: Annotated[
        Literal["truth", "last_fix", "carried_forward"], formerly(estimate="last_fix")
    ] = key(
        "truth",
        "",
        "the AUV positions that the colouring knows: true ones, the last fix of each, or that fix "
        "carried on by planned course and speed",
        PAPER,
    )
    tick_rate_hz: Real | None = key(
        None, "Hz", "slot starts and deliveries fall on ticks; null = exact clock", ge=0.001, le=1e6
    )
    frame_s: Real = key(
        1.0,
        "s",
        "frame of one AUV (round_robin, random)",
        "sec:baseline (1 fix/s)",
        ge=0.001,
        le=1e6,
    )
    turnaround_s: Real = key(0.0, "s", "AUV turnaround time (twtt)", ge=0, le=60)
    reply_at: Literal["ping_front", "ping_end"] = key(
        "ping_end",
        "",
        "when a direct reply sets out: as the ping's front arrives, or once it is decoded",
    )

    @property
    def is_passive(self) -> bool:
        """Whether ASVs ping and AUVs fix themselves."""
        return self.ranging == "passive"

    @property
    def pinging(self) -> str:
        """Which vehicles ping: "auv" or "asv", and so the column that names them."""
        return "asv" if self.is_passive else "auv"

    @property
    def listening(self) -> str:
        """Which vehicles hear pings: "auv" or "asv", and so the column that names them."""
        return "auv" if self.is_passive else "asv"


class Record(Part):
    """What is kept of a mission."""

    tracks_hz: Real = key(2.0, "Hz", "rate of the rows in `tracks`", ge=1e-6, le=1e3)
    metrics_hz: Real = key(
        30.0, "Hz", "rate at which time means are sampled", PAPER, ge=1e-6, le=1e3
    )
    detail: Literal["full", "summary"] = key("full", "", "every event, or the metrics only")


class ScenarioKeys(Part):
    """All keys of a scenario, each within its range; :class:`.Scenario` has them agree."""

    name: Text = Field(min_length=1, max_length=LONGEST_NAME, description="name of the scenario")
    duration_s: Real = key(300.0, "s", "length of the mission", PAPER, ge=0.001, le=1e7)
    survey: Survey = Field(default=Survey(), description="the survey area")
    auvs: Auvs = Field(default=Auvs(), description="underwater vehicles")
    asvs: Asvs = Field(default=Asvs(), description="surface vessels")
    environment: Environment = Field(default=Environment(), description="the water")
    acoustics: Acoustics = Field(default=Acoustics(), description="acoustic bands")
    protocol: Protocol = Field(default=Protocol(), description="medium access")
    usbl: Usbl = Field(default=Usbl(), description="USBL measurement")
    navigation: Navigation = Field(default=Navigation(), description="AUV navigation")
    record: Record = Field(default=Record(), description="what is recorded")
