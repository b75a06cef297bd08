"""The chance that a ping from a position makes a fix that its AUV receives: the survey's
coverage.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.acoustics.channel import AskedChannel, between
from ...core.scenario import families
from ...core.setup import Setup
from ...support.arrays import Flags, Floats, Ints

# Number of ranges at which a chance is evaluated; of channels without an end more of them, 0.3 %
# apart, up to a limit (m); number of bisections of an edge.
LOOKED_UP, MANY, FARTHEST_M, HALVED = 1001, 4001, 1e6, 50

# A row of cells that the survey enters by less than this share is left out: rounding.
ROUNDING = 1e-9

# A cell is split in four, at most so often, where the chance in its middle differs by more than
# this from the mean at its corners.
EVEN, PARTED = 1e-3, 4

# At most so many pairs of a position and an ASV are evaluated at once.
MOST_PAIRS = 1_000_000

# A chance of a half, less the rounding of an SNR threshold at the band's range.
HALF = 0.5 - 1e-3


class Grid(NamedTuple):
    """Square cells that cover a survey, from south to north, then from west to east.

    South, west, north and east bounds (m); the number of cells along x; for each cell the middle
    (n, 3), m, of its part of the survey, at the greatest depth, and its share in the survey (n,).
    """

    box: tuple[float, float, float, float]
    across: int
    middles: Floats
    share: Floats

    @property
    def inside(self) -> Flags:
        """Which cells have a part in the survey (n,)."""
        return self.share > 0.0

    @property
    def size(self) -> float:
        """The side (m) of a cell."""
        return (self.box[2] - self.box[0]) / self.across

    @property
    def corners(self) -> Floats:
        """The south-western corners of cells (n, 2), m."""
        south, west, *_ = self.box
        place = np.arange(len(self.share))
        steps = np.column_stack((place % self.across, place // self.across))
        return np.asarray((south, west) + self.size * steps)


def survey_grid(setup: Setup, cells: int) -> Grid:
    """Return a grid with `cells` cells along each side of a square survey, or about as many in
    all.
    """
    box = setup.area.box
    high, wide = box.x_max - box.x_min, box.y_max - box.y_min
    longer, shorter = max(high, wide), min(high, wide)
    size = longer / min(math.ceil(cells * math.sqrt(longer / shorter)), cells**2)
    across, along = math.ceil(high / size - ROUNDING), math.ceil(wide / size - ROUNDING)
    south, west = np.meshgrid(
        box.x_min + size * np.arange(across), box.y_min + size * np.arange(along)
    )
    middles, share = _parts(setup, np.column_stack((south.ravel(), west.ravel())), size)
    north, east = box.x_min + across * size, box.y_min + along * size
    return Grid((box.x_min, box.y_min, north, east), across, middles, share)


def _parts(setup: Setup, corners: Floats, size: float) -> tuple[Floats, Floats]:
    """Return the middle (n, 3), m, of the survey's part in each cell, and its share of the cell
    (n,).

    Cells are given by their south-western corners (n, 2) and their side, in m.
    """
    import shapely

    squares = shapely.box(*corners.T, *(corners + size).T)
    parts = shapely.intersection(squares, setup.area.shape)
    share = shapely.area(parts) / size**2
    middles = shapely.get_coordinates(shapely.centroid(np.where(share > 0.0, parts, squares)))
    return np.column_stack((middles, np.full(len(share), setup.deepest_m))), share


def mean_chance(setup: Setup, stations: ArrayLike, cells: int) -> tuple[float, float] | None:
    """Return the mean over the survey of the chance of a delivered fix, and the least chance met.

    Cells of :func:`survey_grid` with an edge of coverage are split.  None where :func:`fix_chance`
    is.
    """
    grid = survey_grid(setup, cells)
    corners, size, middles, share = grid.corners, grid.size, grid.middles, grid.share
    total = weight = 0.0
    least = 1.0
    for times in range(PARTED + 1):
        inside = share > 0.0
        corners, middles, share = corners[inside], middles[inside], share[inside]
        chance = fix_chance(setup, stations, middles)
        if chance is None:
            return None
        least = min(least, chance.min(initial=1.0))
        uneven = np.zeros(len(share), dtype=bool)
        if times < PARTED:
            four = (corners[:, np.newaxis] + size * UNIT).reshape(-1, 2)
            depths = np.full(len(four), setup.deepest_m)
            around = fix_chance(setup, stations, np.column_stack((four, depths)))
            assert around is not None
            uneven = np.abs(around.reshape(-1, 4).mean(axis=1) - chance) > EVEN
        total += float((chance * share)[~uneven].sum()) * size**2
        weight += float(share[~uneven].sum()) * size**2
        size /= 2.0
        corners = (corners[uneven][:, np.newaxis] + size * UNIT).reshape(-1, 2)
        middles, share = _parts(setup, corners, size)
    return total / weight, float(least)


# The corners of a square, in its sides
UNIT = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])


def fix_chance(setup: Setup, stations: ArrayLike, places: ArrayLike) -> Floats | None:
    """Return the chance (n,) that a ping from a position makes a fix which is delivered there.

    `places` (n, 3) are positions of AUVs, `stations` (m, 2) of ASVs at the surface, in m.  No other
    sound overlaps ping, call, answer or frame.  The nearest ASV calls an AUV and answers it
    directly; ASVs broadcast equally often unless the broadcaster decides.  None for channels that
    are user-defined or of links, which cannot be evaluated.
    """
    scenario = setup.scenario
    auvs = np.asarray(places, dtype=float)
    asvs = np.pad(np.asarray(stations, dtype=float), ((0, 0), (0, 1)))
    acoustics, frames = scenario.acoustics, scenario.protocol.sends_frames
    if not acoustics.hf.by_place or (frames and not acoustics.mf.by_place):
        return None
    ahead = told_ahead(setup, scenario.protocol.downlink)

    def chance(some: Floats) -> Floats:
        heard = _decoded(setup, "hf", some, asvs)
        delivered = _decoded(setup, "mf", some, asvs) if frames else heard
        return made_and_delivered(setup, heard, delivered, _apart(some, asvs), ahead=ahead)[1]

    parts = max(len(auvs) * len(asvs) // MOST_PAIRS, 1)
    return np.concatenate([chance(some) for some in np.array_split(auvs, parts)])


def told_ahead(setup: Setup, downlink: str) -> int:
    """Return how many broadcasts after the frame that names an AUV's slot its fix is broadcast.

    0 where AUVs do not need a frame to ping, or where the downlink does not declare it.
    """
    if not setup.tells_slots or setup.scenario.protocol.dissemination.missed != "silent":
        return 0
    return (
        families.DOWNLINK.traits[downlink].tells_ahead
        if downlink in families.DOWNLINK.traits
        else 0
    )


def made_and_delivered(
    setup: Setup, heard: Floats, delivered: Floats, away: Floats, *,
    frame: Ints | None = None, cycle: int = 1, number: ArrayLike = 0, ahead: int = 0,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the chance that a ping of each AUV makes a fix, and that the fix is delivered, (...,
    n).

    `heard`, `delivered` and `away`, all (..., n, m): the chance that an ASV decodes the AUV's ping,
    that the AUV decodes the ASV's frame, and their distance (m; infinite: the ASV has failed).
    With passive ranging a ping is that of any ASV that works. One ASV is chosen for all AUVs of the
    same `frame` (..., n); with None, for each AUV by itself.  An AUV's first fix is in broadcast
    `number` (n,), the others follow every `cycle` broadcasts: where ASVs take turns, not all of
    them need to send for it.  Where an AUV pings only after it has decoded a frame, its fix is
    broadcast `ahead` broadcasts later; 0: it pings anyway.
    """
    scenario = setup.scenario
    works = np.isfinite(away)
    if scenario.protocol.asvs_ping:
        return _in_turn(heard, works), _in_turn(heard, works)
    nearest = away.argmin(axis=-1)[..., np.newaxis]
    made = 1.0 - (1.0 - heard).prod(axis=-1)
    if scenario.protocol.calls:
        made = made * np.take_along_axis(heard, nearest, axis=-1)[..., 0]
    if not scenario.protocol.sends_frames:
        return made, made
    rule, replies = setup.broadcaster, scenario.protocol.replies
    if rule.chosen_by == "one" and not replies:
        asvs, chosen = away.shape[-1], scenario.protocol.broadcaster.settings.get("asv", 0)
        later = np.where(works, (np.arange(asvs) - chosen) % asvs, asvs)  # the next that works
        first = later.argmin(axis=-1)[..., np.newaxis]
        by_all = np.take_along_axis(delivered, first, axis=-1)[..., 0]
    elif replies:
        by_all = by_first(heard, delivered, away)
    elif rule.chosen_by in ("distance", "hearing"):
        best = senders(rule, heard, away, made[..., np.newaxis], frame)[..., np.newaxis]
        by_all = np.take_along_axis(delivered, best, axis=-1)[..., 0]
    elif rule.chosen_by == "turn":
        by_all = _in_turn(delivered, works, cycle, number)
    else:
        by_all = _in_turn(delivered, works)
    if not ahead:
        return made, made * by_all
    knows, both = by_all, by_all * by_all
    if rule.chosen_by == "turn":
        place, those = works.cumsum(axis=-1) - 1, np.argsort(~works, axis=-1, kind="stable")
        after = (place + ahead) % np.maximum(works.sum(axis=-1, keepdims=True), 1)
        later = np.take_along_axis(those, after, axis=-1)  # which of those that work
        twice = delivered * np.take_along_axis(delivered, later, axis=-1)
        tells = np.asarray(number) - ahead
        knows, both = (_in_turn(chances, works, cycle, tells) for chances in (delivered, twice))
    return made * knows, made * both


def _in_turn(chances: Floats, works: Flags, cycle: int = 1, number: ArrayLike = 0) -> Floats:
    """Return the mean (...) of chances (..., m) over working ASVs that may send a broadcast.

    `number` is its number; an AUV's next frame comes `cycle` broadcasts later; `works` (..., m)
    tells which ASVs work.
    """
    step, place = np.gcd(cycle, works.sum(axis=-1, keepdims=True)), works.cumsum(axis=-1) - 1
    has_turn = works & ((place - np.asarray(number)[..., np.newaxis]) % step == 0)
    return np.asarray((chances * has_turn).sum(axis=-1) / np.maximum(has_turn.sum(axis=-1), 1))


def by_first(heard: Floats, delivered: Floats, away: Floats) -> Floats:
    """Return the chance (...) that an AUV decodes the answer of the first ASV that hears its ping.

    The nearest ASV hears it first; if it misses the ping, the next does, by chances and distances
    (..., m).
    """
    order = away.argsort(axis=-1, kind="stable")
    hears, told = (np.take_along_axis(chances, order, axis=-1) for chances in (heard, delivered))
    missed = (1.0 - hears).cumprod(axis=-1)
    first = hears.copy()
    first[..., 1:] *= missed[..., :-1]
    return np.asarray((first * told).sum(axis=-1) / np.maximum(first.sum(axis=-1), 1e-30))


def senders(
    rule: families.BroadcasterTraits,
    heard: Floats,
    away: Floats,
    located: Floats,
    frame: Ints | None,
) -> Ints:
    """Return the ASV that sends each AUV's fix (..., n), where the best-hearing or nearest one
    does.

    `heard` is the chance that an ASV decodes an AUV, `away` their distance (m; infinite: failed),
    `located` the chance that an AUV is located, (..., n, m) each.  AUVs with the same `frame` (...,
    n) share a sender; None: none do.
    """
    away = np.minimum(away, FARTHEST_M)  # finite, since 0 times infinity is no number
    score = -heard if rule.chosen_by == "hearing" else away if rule.at_once else located * away
    if frame is not None and frame.ndim > 1:  # one after the other: pairs of large fleets are many
        score = np.stack([_summed(*of_one) for of_one in zip(frame, score, strict=True)])
    elif frame is not None:
        score = _summed(frame, score)
    return np.asarray(score.argmin(axis=-1))


def _summed(frame: Ints, score: Floats) -> Floats:
    """Return the sums of scores (..., n, m) over the AUVs that share each AUV's frame (n,)."""
    return np.asarray((frame[:, np.newaxis] == frame).astype(float) @ score)


def ping_chance(setup: Setup, slants: Floats, depth: float) -> Floats | None:
    """Return the chance that an ASV decodes pings over slant ranges (n,), m, from a depth (m).

    A disc's range does not cut it off here.  None for a user-defined channel, or one of links.
    """
    return _over(setup, "hf", slants, depth)


def frame_chance(
    setup: Setup, slants: Floats, depth: float, fixes: int | None = None
) -> Floats | None:
    """Return the chance that an AUV decodes frames with `fixes` fixes (None: of all AUVs).

    Otherwise as :func:`ping_chance`.
    """
    return _over(setup, "mf", slants, depth, fixes)


def _over(
    setup: Setup, band: str, slants: Floats, depth: float, fixes: int | None = None
) -> Floats | None:
    if not setup.scenario.acoustics.bands[band].by_place:
        return None
    channel = _channel(setup, band, fixes)
    if channel is None:
        return _on_disc(setup, band, slants)
    return _through(channel, setup, band, *below(slants, depth))[:, 0]


def delivery(setup: Setup, band: str) -> tuple[float, float, float] | None:
    """Return the range (m) of a band (hf or mf), the chance there, and the range (m) of half the
    signals.

    Up to the last range the chance is nowhere below a half.  A disc's horizontal HF range becomes
    the slant range to the deepest AUV.  None for a user-defined channel, or one of links.
    """
    scenario = setup.scenario
    hf, depth = scenario.acoustics.hf, setup.deepest_m
    reach = hf.range_m if band == "hf" else scenario.acoustics.mf.range_m
    if band == "hf" and hf.traits.ends_at_range:
        reach = hf.longest_path_m(depth)
    ranges = np.linspace(min(depth, reach), reach, LOOKED_UP)
    chance = partial(ping_chance if band == "hf" else frame_chance, setup, depth=depth)
    if (at_range := chance(ranges[-1:])) is None:
        return None
    rings = _rings(ranges, chance)
    return reach, float(at_range[0]), rings[0][1] if rings and rings[0][0] == ranges[0] else 0.0


def loses_pings(setup: Setup) -> bool:
    """Tell whether an ASV may miss a ping within range even if no other sound overlaps it."""
    scenario = setup.scenario
    hf = scenario.acoustics.hf
    if not (hf.by_place and hf.traits.ends_at_range):
        return True
    reach = hf.longest_path_m(setup.deepest_m)
    ranges = np.linspace(0.0, reach, LOOKED_UP)
    return bool(setup.ping_loss.over(ranges).max() > 0.0)


Rings = tuple[tuple[float, float], ...]


def heard_rings(setup: Setup) -> Rings:
    """Return the horizontal distances (m), as rings, at which an ASV decodes at least half the
    pings.

    It is one ring up to the HF range for a disc that loses fewer, and for user-defined channels,
    which cannot be evaluated; shadows and dips of other channels leave several rings.
    """
    scenario = setup.scenario
    hf, depth = scenario.acoustics.hf, setup.deepest_m
    reach = setup.horizontal_reach_m
    if not hf.by_place:
        return ((0.0, reach),)
    farthest = reach if hf.traits.ends_at_range else FARTHEST_M
    level = np.append(0.0, farthest * np.geomspace(1e-6, 1.0, MANY))
    return _rings(level, lambda away: ping_chance(setup, np.hypot(away, depth), depth))


def _rings(ranges: Floats, chance: Callable[[Floats], Floats | None]) -> Rings:
    """Return the rings of ranges (m) in which a chance is at least a half; `ranges` (n,) rise.

    Rings narrower than their spacing may be missed.
    """

    def heard(away: Floats, least: float = 0.5) -> Flags:
        return np.asarray(chance(away)) >= least

    at = heard(ranges, HALF)
    last = np.flatnonzero(at[:-1] != at[1:])
    low, high = ranges[last], ranges[last + 1]
    for _ in range(HALVED if len(last) else 0):
        middle = (low + high) / 2.0
        same = heard(middle) == at[last]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    edges = np.concatenate((ranges[:1][at[:1]], (low + high) / 2.0, ranges[-1:][at[-1:]]))
    pairs = edges.reshape(-1, 2).tolist()
    return tuple((begin, end) for begin, end in pairs if end > begin)


def _decoded(setup: Setup, band: str, auvs: Floats, asvs: Floats) -> Floats:
    """Return the chance (n, m) that each ASV decodes each AUV's ping (hf), or each AUV its frame
    (mf).
    """
    section, channel = setup.scenario.acoustics.bands[band], _channel(setup, band)
    if channel is not None:
        found = _through(channel, setup, band, auvs, asvs)
    else:
        away = _apart(auvs, asvs)
        counted = away if section.range_metric == "slant" else _apart(auvs, asvs, axes=2)
        found = np.where(counted <= section.range_m, _on_disc(setup, band, away), 0.0)
    return found if setup.land is None else np.where(setup.land.crossed(auvs, asvs), 0.0, found)


def _on_disc(setup: Setup, band: str, away: Floats) -> Floats:
    """Return the chance that a disc decodes signals over distances (m); it loses no frames."""
    if band == "mf":
        return np.ones_like(away)
    return 1.0 - setup.ping_loss.over(away.ravel()).reshape(away.shape)


def _channel(setup: Setup, band: str, fixes: int | None = None) -> AskedChannel | None:
    """Return the channel of a ping, or of a frame with `fixes` fixes; None for a disc.

    By default a frame has the fixes of all AUVs, and an answer one fix.
    """
    if band == "hf" or setup.frame_channel is None:
        return setup.ping_channel if band == "hf" else None
    messages = setup.messages
    if fixes is None:
        replies = setup.scenario.protocol.replies
        fixes = 1 if replies else messages.of(setup.scenario.auvs.count)[0]
    return setup.frame_channel(messages.payload_bytes(fixes), messages.airtime(fixes))


def _through(channel: AskedChannel, setup: Setup, band: str, auvs: Floats, asvs: Floats) -> Floats:
    reach = setup.scenario.acoustics.bands[band].range_m
    return 1.0 - channel.prospects(between(0.0, auvs, asvs, reach, band == "mf"))["loss"]


def below(slants: Floats, depth: float) -> tuple[Floats, Floats]:
    """Return positions of AUVs at slant ranges (n,), m, and a depth (m), and that of the ASV above.

    At a slant range less than the depth, the AUV is straight below the ASV.
    """
    deep = np.minimum(depth, slants)
    level = np.sqrt(slants**2 - deep**2)
    return np.column_stack((level, 0.0 * level, deep)), np.zeros((1, 3))


def _apart(auvs: Floats, asvs: Floats, axes: int = 3) -> Floats:
    """Return the distances (n, m), m, of AUVs and ASVs; horizontal ones with `axes` 2."""
    return np.asarray(np.linalg.norm(auvs[:, None, :axes] - asvs[:, :axes], axis=2))
