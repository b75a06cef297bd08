"""Warnings about acoustic bands: modems, ranges, tables, messages, guards; and what rates leave
out.
"""

import math
from collections.abc import Iterator
from itertools import combinations
from typing import Any

from ...core.scenario.measured import read_measured
from ...core.setup import Setup
from ...models.presets.modems import airtime_table
from ...support.mistakes import Problem
from ...support.wording import plain
from .whereabouts import shapes

# Keys that decide how many fixes the downlink carries
_MESSAGE = tuple(
    f"acoustics.mf.{name}" for name in ("bit_rate_bps", "modem", "payload_bytes", "overfull")
)

# At a horizontal range, AUVs deeper than this share of it are at a slant range 2 % longer or more.
STEEP = 0.2

# Up to this range (m) every law loses at most 12 % of pings.
SAFE_M = 200.0


def modems(setup: Setup) -> Iterator[Problem]:
    """Yield keys whose values differ from the data sheet of their band's modem."""
    scenario = setup.scenario
    for name, band in scenario.acoustics.bands.items():
        for key, value in band.stated.items():
            given = getattr(band, key)
            if not _same(key, given, value):
                yield Problem(
                    f"acoustics.{name}.{key}",
                    f"is {plain(given)}, not the {plain(value)} of the modem {band.modem}: what is "
                    "given wins",
                    (f"acoustics.{name}.modem",),
                )


def overheads(setup: Setup) -> Iterator[Problem]:
    """Yield a bit rate that is given without the overhead sent beside the user's bits."""
    scenario = setup.scenario
    mf, given = scenario.acoustics.mf, scenario.acoustics.mf.model_fields_set
    is_paper = mf.bit_rate_bps == type(mf).model_fields["bit_rate_bps"].default
    if (
        "bit_rate_bps" in given
        and not is_paper
        and "overhead" not in {*given, *mf.stated}
        and mf.airtimes is None
        and scenario.protocol.sends_frames
    ):
        size = mf.header_bytes + mf.fix_bytes
        lasts_s = 8 * size / mf.bit_rate_bps
        yield Problem(
            "acoustics.mf.bit_rate_bps",
            f"is given without overhead, which then is the paper's {mf.overhead:g} bits sent for "
            f"each of the user's: a frame of {size} B takes {1e3 * mf.overhead * lasts_s:.5g} ms; "
            f"if the rate is that of the user's bits, {1e3 * lasts_s:.5g} ms: set overhead to 1, "
            "or to what the line sends beside them",
            ("acoustics.mf.overhead", "acoustics.mf.modem"),
        )


def _same(key: str, given: Any, value: Any) -> bool:
    """Tell whether a key has the value of a data sheet; tables and curves compare by content."""
    if key == "channel" and str(given) == str(value) and "file" in given.settings:
        files = given.settings["file"], value.settings["file"]
        return read_measured(files[0])[:2] == read_measured(files[1])[:2]
    if key == "airtimes" and given is not None:
        return airtime_table(given) == airtime_table(value)
    return bool(given == value)


def deliveries(setup: Setup) -> Iterator[Problem]:
    """Yield bands that lose most of their signals at their range."""
    scenario = setup.scenario
    loss = scenario.acoustics.loss
    for band, what in (("hf", "pings"), ("mf", "frames")):
        if not _may_lose_half(setup, band):
            continue
        from .fix_chance import HALF, delivery  # brings numpy

        if (found := delivery(setup, band)) is None or found[1] >= HALF:
            continue
        reach, chance, half_m = found
        on_disc = scenario.acoustics.bands[band].traits.ends_at_range
        chooser = "acoustics.loss.law" if on_disc else f"acoustics.{band}.channel"
        other = ", or acoustics.loss.law scaled" if on_disc and loss.law != "scaled" else ""
        most = f"at least half of them up to {half_m:.4g} m" if half_m else "nowhere half of them"
        yield Problem(
            f"acoustics.{band}.range_m",
            f"over {reach:.4g} m {100 * chance:.3g} % of {what} are decoded, {most}: slots and "
            f"formation are made for a range over which most are lost; make it less{other}",
            (chooser, f"acoustics.{band}.modem"),
        )


def steep(setup: Setup) -> Iterator[Problem]:
    """Yield bands whose horizontal range is much shorter than the slant range to the deepest
    AUV.
    """
    for name, words in _steep(setup):
        yield Problem(
            f"acoustics.{name}.range_metric",
            f"{words}; set it to slant, as data sheets have ranges, or acoustics.{name}.range_m "
            "to what is reached at that depth, seen from above",
            (f"acoustics.{name}.range_m", "survey.depth_m", "survey.depths_m"),
        )


def _steep(setup: Setup) -> Iterator[tuple[str, str]]:
    """Yield such bands by name, with both ranges in words."""
    scenario, deepest = setup.scenario, setup.deepest_m
    protocol = scenario.protocol
    for name, band in scenario.acoustics.bands.items():
        used = name == "hf" or protocol.sends_frames
        on_disc = used and band.traits.ends_at_range
        if on_disc and band.range_metric == "horizontal" and deepest > STEEP * band.range_m:
            slant = band.longest_path_m(deepest)
            level = math.sqrt(max(band.range_m**2 - deepest**2, 0.0))
            least = f"{level:.4g} m, seen from above" if level else "none of them"
            words = (
                f"the {name.upper()} range of {band.range_m:g} m is horizontal, which is "
                f"{slant:.4g} m of slant range to AUVs {deepest:g} m deep; {band.range_m:g} m "
                f"of slant range would reach {least}"
            )
            yield name, words


def tables(setup: Setup) -> Iterator[Problem]:
    """Yield tables of rays that end before the ranges or depths of the scenario."""
    scenario = setup.scenario
    depths = [auv.depth_m for auv in setup.auvs]
    for name, band in scenario.acoustics.bands.items():
        if (file := band.channel.settings.get("rays")) is None:
            continue
        from ...models.channels.ray_tables import read_table  # brings numpy

        grid = read_table(file, setup.sound_profile).grid
        far, high, low = grid.ranges_m[-1], grid.receiver_depths_m[0], grid.receiver_depths_m[-1]
        if far < band.range_m or min(depths) < high or max(depths) > low:
            yield Problem(
                f"acoustics.{name}.channel.rays",
                f"is a table up to {far:g} m, of receivers {high:g} to {low:g} m deep; the range "
                f"is {band.range_m:g} m, and AUVs are {min(depths):g} to {max(depths):g} m deep: "
                "what differs from straight ways is held beyond its ends, a shadow there is missed",
                (f"acoustics.{name}.range_m", "survey.depth_m", "survey.depths_m"),
            )


def echoes(setup: Setup) -> Iterator[Problem]:
    """Yield that echoes from a smooth surface shift fixes by errors that no covariance includes."""
    scenario = setup.scenario
    hf, channel = scenario.acoustics.hf, scenario.acoustics.hf.channel
    has_echoes = hf.traits.has_echoes and channel.settings.get("bottom_m") is not None
    is_smooth = has_echoes and not channel.settings.get("surface_sd_m")
    if is_smooth and scenario.navigation.weighs:
        yield Problem(
            "acoustics.hf.channel.bottom_m",
            "with a smooth surface, which is assumed, echoes shift many fixes alike, by what no "
            "covariance includes: ellipses may be several times too small, errors as large; give "
            "surface_sd_m, such as 0.1",
            ("navigation.filter",),
        )


def fastest_m_per_s(setup: Setup) -> float | None:
    """Return the highest planned range rate (m/s) between an AUV and an ASV.

    None where the plan does not say: vehicles moved by a recording, an autopilot or a program.
    """
    scenario = setup.scenario
    asvs, vehicles = scenario.asvs, [group.vehicle for group in setup.groups]
    if any(wing.asked.choice.is_own for wing in setup.wings):
        return None
    vessels = [group.vehicle for group in setup.vessels]
    moved = any(hull.is_steered or hull.choice.is_own for hull in (*vehicles, *vessels))
    recorded = any(wing.asked.is_recorded for wing in setup.wings)
    if moved or recorded or asvs.formation.moored is None:
        return None
    return max(planned_speeds_m_per_s(setup))


def planned_speeds_m_per_s(setup: Setup) -> tuple[float, ...]:
    """Return the planned speed (m/s) of each AUV along its slanting path.

    Speeds in the scenario are horizontal; climbs to the surface are faster.
    """
    found = list(setup.planned_speeds_m_per_s)
    for wing in setup.wings:
        if (surfacing := wing.asked.surfacing) is not None:
            for auv in wing.members:
                found[auv] /= math.cos(math.radians(surfacing.climb_angle_deg))
    return tuple(found)


def shifted_bands(setup: Setup) -> dict[str, float]:
    """Return the bands on which Doppler may lose signals, with the limit (m/s) of each."""
    limits = doppler_limits(setup)
    fastest = fastest_m_per_s(setup) if limits else 0.0
    return {name: limit for name, limit in limits.items() if fastest is None or fastest > limit}


def doppler_limits(setup: Setup) -> dict[str, float]:
    """Return the Doppler limit (m/s) of each band that is used and has one."""
    scenario = setup.scenario
    bands = ["hf"] + ["mf"] * scenario.protocol.sends_frames
    limits = {name: scenario.acoustics.bands[name].doppler_limit_m_per_s for name in bands}
    return {name: limit for name, limit in limits.items() if limit is not None}


def shifts(setup: Setup) -> Iterator[Problem]:
    """Yield Doppler limits that AUVs exceed, or that no AUV ever reaches."""
    limits, bands = doppler_limits(setup), setup.scenario.acoustics.bands
    if not limits or (fastest := fastest_m_per_s(setup)) is None:
        return
    for name, limit in limits.items():
        given = "doppler_limit_m_per_s" in bands[name].channel.settings
        key = f"acoustics.{name}.{'channel.doppler_limit_m_per_s' if given else 'modem'}"
        if fastest > limit:
            yield Problem(
                key,
                f"loses signals over ways that change faster than {limit:g} m/s, and AUVs go "
                f"{fastest:.3g} m/s: straight towards an ASV, or away, none is decoded; go slower, "
                "or use another modem",
                ("auvs.speed_m_per_s",),
            )
        elif given:
            yield Problem(
                key,
                f"has no effect: no AUV goes faster than {fastest:.3g} m/s, and ASVs rest; remove "
                "it",
                ("auvs.speed_m_per_s",),
            )


def _may_lose_half(setup: Setup, name: str) -> bool:
    """Tell whether a band may lose half its signals; if so, its channel has to be evaluated.

    A disc of short range cannot, so that `validate` need not evaluate it.
    """
    scenario = setup.scenario
    band, loss = scenario.acoustics.bands[name], scenario.acoustics.loss
    if not band.traits.ends_at_range:
        return name == "hf" or scenario.protocol.sends_frames
    if name == "mf":
        return False
    away = math.hypot(band.range_m, setup.deepest_m)
    shrink = min(1.0, SAFE_M / 2.0 / band.range_m) if loss.law == "scaled" else 1.0
    shared = loss.combine != "off" and scenario.auvs.count * loss.contention_per_auv > 0.3
    return shared or (loss.law != "none" and away * shrink > SAFE_M)


def messages(setup: Setup) -> Iterator[Problem]:
    """Yield that fixes queue up for broadcasts that carry the oldest first."""
    scenario = setup.scenario
    mf, count = scenario.acoustics.mf, scenario.auvs.count
    if mf.overfull != "oldest_first" or (mf.payload_bytes is None and mf.airtimes is None):
        return
    if scenario.protocol.asvs_ping or scenario.protocol.replies:
        return
    from .round_lengths import rounds_of

    rounds = rounds_of(setup)
    most = rounds.slots.messages.most
    groups = count if setup.downlink.by_group else 1
    if most is not None and not rounds.frame and most * groups < count:
        yield Problem(
            "acoustics.mf.overfull",
            f"a message holds {most} fixes and a round may bring {count}, one for each AUV: while "
            "it does, fixes wait longer with every round; split sends them at once",
            ("acoustics.mf.payload_bytes", "acoustics.mf.airtimes", "auvs.count"),
        )


def last_slots(setup: Setup) -> Iterator[Problem]:
    """Yield that an AUV that pings in its last slot may use the slot of another."""
    scenario = setup.scenario
    protocol = scenario.protocol
    if not setup.tells_slots or protocol.dissemination.missed != "last_slot":
        return
    if setup.schedule.renumbers and scenario.auvs.count > 1:
        yield Problem(
            "protocol.knowledge.missed",
            f"{protocol.schedule} deals its slots anew in every round: an AUV that misses a frame "
            "and pings in its last slot pings in that of another; use silent, or a schedule that "
            "keeps them, such as one_per_slot",
            ("protocol.schedule",),
        )


def backlog(setup: Setup) -> Iterator[Problem]:
    """Yield that random access loses most pings to collisions, or makes more fixes than can be
    sent.
    """
    scenario = setup.scenario
    if not scenario.protocol.random_access:
        return
    from .effort import heard_share  # brings the whole protocol, which others do not need
    from .round_lengths import carried_per_s, offered

    if (load := offered(setup)).load > 1.0 and load.success is not None:
        yield Problem(
            "protocol.frame_s",
            f"AUVs offer {load.load:.3g} times what HF holds: where one ASV hears all, "
            f"{100 * load.success:.2g} % of pings meet no other; lengthen it",
            ("protocol.schedule", "auvs.count"),
        )
    if scenario.protocol.replies:
        return
    made = load.least_fixes_per_s * min(heard_share(setup), 1.0)
    carried, lasts = carried_per_s(setup), scenario.duration_s
    if made > carried:
        late = lasts * (1 - carried / made)
        yield Problem(
            "protocol.frame_s",
            f"the downlink carries {carried:.3g} fixes a second at most, and about {made:.3g} are "
            f"made: they queue up, and by {lasts:g} s come about {late:.3g} "
            "s late; lengthen frame_s, or make frames shorter",
            ("protocol.schedule", "auvs.count", *_MESSAGE),
        )


def answers(setup: Setup) -> Iterator[Problem]:
    """Yield that answers to AUVs in one slot may collide."""
    scenario = setup.scenario
    protocol, mf = scenario.protocol, scenario.acoustics.mf
    shares = setup.schedule.shares_slots or protocol.schedule.settings.get("side_by_side")
    if not (protocol.replies_in_frames and shares) or scenario.auvs.count == 1:
        return
    apart = [math.dist(*both) for both in combinations(setup.nominal_stations_m, 2)]
    if apart and min(apart) < 2 * setup.horizontal_mf_reach_m:
        yield Problem(
            "protocol.downlink",
            f"direct_reply answers AUVs that share a slot at once: between ASVs {min(apart):.4g} m "
            f"apart an AUV hears both within MF range ({mf.range_m:g} m), and gets neither fix; "
            "use schedule one_per_slot, or another downlink",
            ("protocol.schedule", "acoustics.mf.range_m", *shapes(scenario)),
        )


def guards(setup: Setup) -> Iterator[Problem]:
    """Yield a downlink guard so short that a slot ends before its answer has passed."""
    scenario = setup.scenario
    protocol, mf = scenario.protocol, scenario.acoustics.mf
    if protocol.downlink_guard_s is None or not protocol.replies_in_frames:
        return
    way = mf.range_m / setup.assumed_sound_speed_m_per_s
    if protocol.downlink_guard_s < way:
        yield Problem(
            "protocol.downlink_guard_s",
            f"a slot ends {protocol.downlink_guard_s:.4g} s after its answer, sooner than sound "
            f"has crossed the MF range ({way:.4g} s): the next answer may set out while the end of "
            "this one is under way",
            ("acoustics.mf.range_m",),
        )


def frames(setup: Setup) -> Iterator[Problem]:
    """Yield AUVs that hardly ever get a fix, for three reasons.

    ASVs broadcast in turn out of reach; frames name a slot after it has begun; frames overlap.
    """
    protocol, asvs = setup.scenario.protocol, setup.scenario.asvs
    if not protocol.sends_frames or protocol.replies or asvs.formation.moves:
        return
    is_told = setup.tells_slots and protocol.dissemination.missed == "silent"
    by_turns = setup.broadcaster.chosen_by == "turn" and asvs.count > 1
    by_turns &= setup.tells_slots or setup.schedule.framed or setup.downlink.by_group
    meet = _may_overlap(setup)
    if not (is_told or by_turns or meet):
        return
    from .frame_warnings import frame_warnings  # brings numpy

    yield from frame_warnings(setup, by_turns, is_told, meet)


def _may_overlap(setup: Setup) -> bool:
    """Tell whether frames of two ASVs may overlap anywhere; a check for each AUV takes longer."""
    scenario, rule = setup.scenario, setup.broadcaster
    pings_between = setup.downlink.waits and not (rule.at_once or scenario.protocol.random_access)
    if pings_between or rule.chosen_by == "one" or scenario.asvs.count == 1:
        return False
    stations = setup.nominal_stations_m
    apart = math.hypot(*(max(axis) - min(axis) for axis in zip(*stations, strict=True)))
    from .round_lengths import gap_s  # brings numpy

    spread = min(apart, scenario.acoustics.mf.range_m) / setup.assumed_sound_speed_m_per_s
    return spread > gap_s(setup)


def believed(setup: Setup) -> Iterator[Problem]:
    """Yield optimistic assumptions: vehicles that hear while they send, a fleet that knows
    positions.
    """
    scenario = setup.scenario
    protocol = scenario.protocol
    overlap = protocol.random_access or not (setup.downlink.waits or protocol.replies)
    if protocol.duplex == "per_node" and overlap and not protocol.asvs_ping:
        yield Problem(
            "protocol.duplex",
            "who sends on one band does not hear the other, and uplink and downlink overlap: AUVs "
            "may miss most fixes, or all; use downlink sequential, or per_band for two transducers",
            ("protocol.downlink", "protocol.schedule"),
        )
    moves = not all(wing.asked.is_held for wing in setup.wings) and scenario.asvs.count > 1
    if protocol.calls and moves and protocol.positions == "last_fix":
        yield Problem(
            "protocol.positions",
            "the ASV nearest to its last_fix calls an AUV: one that has left its range is called "
            "in vain until it returns; use carried_forward",
            ("protocol.ranging", "protocol.schedule"),
        )
    truth = protocol.positions == "truth" and "positions" in protocol.model_fields_set
    if truth and setup.tells_slots:
        yield Problem(
            "protocol.positions",
            "truth is not to be had with knowledge broadcast, where the fleet knows AUVs by their "
            "fixes alone: they are carried_forward; write that, or last_fix",
            ("protocol.knowledge",),
        )


ALWAYS_HEARING = (
    "AUVs and ASVs are taken to hear while they send: where uplink and downlink overlap "
    "(pipelined), with duplex per_node, most fixes may be missed and errors many times as large."
)


def left_out(setup: Setup) -> Iterator[str]:
    """Yield, in sentences, what the rates of `limits` leave out or assume."""
    scenario, protocol, rule = setup.scenario, setup.scenario.protocol, setup.broadcaster
    for _, words in _steep(setup):
        yield f"{words[0].upper()}{words[1:]}."
    if protocol.duplex == "per_node" and not protocol.asvs_ping:
        yield ALWAYS_HEARING
    if any(answers(setup)):
        yield (
            "Answers are taken not to meet: of AUVs that share a slot, those that hear two ASVs "
            "are fixed less often, or never."
        )
    if any(shifted_bands(setup)):
        yield "Signals that Doppler loses (doppler_limit_m_per_s) are taken to be decoded."
    if protocol.asvs_ping or protocol.replies:
        return
    if protocol.relay is not None or protocol.most_repeats != 0:
        yield (
            "What AUVs have by relays and repetition is not bounded: fixes are counted that come "
            "by the first frame, from its ASV."
        )
    if rule.at_once:
        yield "Rounds are taken to have one frame; with one behind another they are longer."
    by_group = setup.downlink.by_group and setup.schedule.groups != "each"
    if by_group and rule.chosen_by == "turn" and scenario.asvs.count > 1:
        yield (
            "Where ping groups change, ASVs are taken to send for all AUVs alike; between changes "
            "the same may send for the same ones, which some do not hear."
        )
