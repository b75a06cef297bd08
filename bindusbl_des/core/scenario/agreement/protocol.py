"""Rules for the protocol: slots, frames that name slots, relays, data, and messages that hold a
fix.
"""

from collections.abc import Iterator
from importlib.util import find_spec

from ....models.presets.modems import airtime_table
from ....support.mistakes import Problem
from ..families import CHANNEL, DOWNLINK, RANGING
from ..part_choice import PartChoice
from ..site import Site
from .vehicles import no_such_asv

# The number of addresses of each make of modem
MOST_MODEMS = {"seatrac": 15, "evologics": 254}


def protocol_problems(site: Site) -> Iterator[Problem]:
    """Yield contradictions among the keys of the protocol."""
    yield from _fixed(site)
    yield from _unslotted(site)
    yield from _ordered(site)
    yield from _exchanged(site)
    yield from _laden(site)


def _fixed(site: Site) -> Iterator[Problem]:
    """Yield that the one ASV chosen to broadcast does not exist."""
    broadcaster, count = site.scenario.protocol.broadcaster, site.scenario.asvs.count
    asv = broadcaster.settings.get("asv")
    if site.broadcaster.chosen_by == "one" and isinstance(asv, int) and asv >= count > 0:
        yield Problem(
            "protocol.broadcaster.asv",
            no_such_asv(asv, count),
            ("asvs.count",),
        )


def _unslotted(site: Site) -> Iterator[Problem]:
    """Yield parts that need slots where AUVs use random access."""
    protocol = site.scenario.protocol
    if not site.scenario.protocol.random_access:
        return
    if not site.scenario.asvs.count:
        yield Problem(
            "asvs.count",
            f"is 0, and with {protocol.program} AUVs send to ASVs; give at least one, or use a "
            "schedule with slots, of which none begins without an ASV",
            ("protocol.schedule", "protocol.access"),
        )
    works_in_slots = not site.ranging.own_clocks
    refused = {"ranging": works_in_slots, "downlink": protocol.downlink.is_own}
    for name, known in (
        ("ranging", _by_own_clocks()),
        ("downlink", "one that ships"),
    ):
        if refused[name]:
            yield Problem(
                f"protocol.{name}",
                f"{getattr(protocol, name)} works in slots, and with {protocol.program} AUVs ping "
                f"as they like; use {known}, or a schedule with slots",
                ("protocol.schedule",),
            )


def modems_problems(site: Site) -> Iterator[Problem]:
    """Yield why hosts cannot use modems in this scenario."""
    scenario, protocol = site.scenario, site.scenario.protocol
    if scenario.modems is None:
        return
    if protocol.asvs_ping or protocol.signals or scenario.navigation.peers is not None:
        yield Problem(
            "modems",
            "need a vehicle's ear for themselves; remove them, or what else listens: passive "
            "ranging, navigation.peers, or a protocol.access that hears others",
            ("protocol.ranging", "navigation.peers", "protocol.access"),
        )
    make, vehicles = scenario.modems.make, scenario.auvs.count + scenario.asvs.count
    if vehicles > MOST_MODEMS[make]:
        yield Problem(
            "modems.make",
            f"{make} has addresses for {MOST_MODEMS[make]} modems, and there are {vehicles} "
            "vehicles; ask for fewer" + (", or for evologics" if make == "seatrac" else ""),
            ("auvs.count", "asvs.count"),
        )


def peers_problems(site: Site) -> Iterator[Problem]:
    """Yield why AUVs cannot range each other in this scenario."""
    scenario, peers = site.scenario, site.scenario.navigation.peers
    if peers is None:
        return
    protocol, filter_, usbl = scenario.protocol, scenario.navigation.filter, scenario.usbl
    if protocol.asvs_ping or protocol.random_access:
        yield Problem(
            "navigation.peers",
            "needs AUVs that ping in slots, beside which they speak to each other; remove it, or "
            f"use a schedule with slots in the place of {protocol.rule}, and ranging by their "
            "pings",
            ("protocol.ranging", "protocol.access", "protocol.schedule"),
        )
    if filter_.is_own or site.navigator.is_smoother or not site.navigator.weighs:
        yield Problem(
            "navigation.filter",
            f"{filter_} takes nothing in of what AUVs measure of each other (navigation.peers); "
            "use kalman",
            ("navigation.peers",),
        )
    if filter_.settings.get("range_rate"):
        yield Problem(
            "navigation.filter.range_rate",
            "is not taken in where AUVs range each other (navigation.peers); remove it",
            ("navigation.peers",),
        )
    has_array = peers.bearing == "array"
    if not peers.traits.ranges and not has_array:
        yield Problem(
            "navigation.peers.bearing",
            "none leaves nothing to measure with kind: angles; use array",
            ("navigation.peers.kind",),
        )
    states_angles = usbl.model.settings.get("bearing_sd_deg", 0.0) is not None
    if has_array and (usbl.model.is_own or not states_angles):
        yield Problem(
            "navigation.peers.bearing",
            f"array: AUVs carry what usbl says, and {usbl.model} says nothing of angles; use "
            "bearing: none, or usbl.model: array",
            ("usbl.model",),
        )
    airtime = 8.0 * peers.message_bytes / scenario.acoustics.hf.bit_rate_bps
    answers = scenario.auvs.count - 1 if peers.traits.asks else 1
    crossing = scenario.acoustics.hf.range_m / site.sound_speed_m_per_s
    needed = scenario.auvs.count * answers * (airtime + crossing)
    if needed > peers.every_s:
        yield Problem(
            "navigation.peers.every_s",
            f"{scenario.auvs.count} AUVs need {needed:.4g} s for their turns, of messages of "
            f"{airtime:.4g} s; use at least that, or fewer message_bytes; got {peers.every_s:g}",
            ("navigation.peers.message_bytes", "acoustics.hf.bit_rate_bps", "auvs.count"),
        )


def _ordered(site: Site) -> Iterator[Problem]:
    """Yield parts that do not fit a schedule that calls AUVs, or that tells them when to ping."""
    protocol, others = site.scenario.protocol, ("protocol.schedule",)
    schedule = site.schedule
    if schedule.calls and protocol.pings_by_steps:
        known = [name for name, traits in RANGING.traits.items() if not traits.asvs_ping]
        yield Problem(
            "protocol.ranging",
            f"{protocol.schedule} calls the AUVs itself, so that {protocol.ranging} has nothing to "
            f"do; use {' or '.join(known)}, or another schedule",
            others,
        )
    if schedule.pace != "packed":
        return
    ranging = site.ranging
    if not ranging.own_clocks and not ranging.asvs_ping:
        yield Problem(
            "protocol.ranging",
            f"{protocol.schedule} tells AUVs when to ping, on their own clocks, which "
            f"{protocol.ranging} does not let them; use {_by_own_clocks()}, or another "
            "schedule",
            others,
        )
    if site.downlink.by_group:
        *known, last = DOWNLINK.having(lambda traits: not traits.by_group)
        yield Problem(
            "protocol.downlink",
            f"{protocol.schedule} packs the pings of a whole round, and {protocol.downlink} would "
            f"hold them up for each frame; use {', '.join(known)} or {last}",
            others,
        )


def _exchanged(site: Site) -> Iterator[Problem]:
    """Yield why frames cannot be acknowledged, repeated or relayed in this scenario."""
    protocol, count = site.scenario.protocol, site.scenario.auvs.count
    asked = {
        "acknowledge": protocol.acknowledge != "none",
        "repeat": protocol.most_repeats != 0,
        "relay": protocol.relay is not None,
    }
    words = {
        "acknowledge": protocol.acknowledge,
        "repeat": protocol.repeat,
        "relay": "AUVs that forward frames",
    }
    for name in (name for name, is_asked in asked.items() if is_asked):
        message = f"{words[name]} needs frames that ASVs broadcast; "
        if protocol.asvs_ping:
            message += (
                f"with ranging {protocol.ranging} AUVs fix themselves, and nobody broadcasts; "
                f"remove it, or use ranging {_by_own_clocks()}"
            )
            yield Problem(f"protocol.{name}", message, ("protocol.ranging",))
        elif protocol.replies:
            message += (
                f"with downlink {protocol.downlink} each ping is answered by itself; remove it, or "
                f"use {' or '.join(_foreseen())}"
            )
            yield Problem(f"protocol.{name}", message, ("protocol.downlink",))
    if protocol.most_repeats is None and not asked["acknowledge"]:
        yield Problem(
            "protocol.repeat",
            f"{protocol.repeat} needs AUVs that acknowledge; set protocol.acknowledge to ping or "
            "frame, or give how many more times",
            ("protocol.acknowledge",),
        )
    if site.broadcaster.at_once and protocol.sends_auv_frames:
        name = "relay" if asked["relay"] else "acknowledge"
        yield Problem(
            f"protocol.{name}",
            f"what AUVs send behind broadcasts of several ASVs at once (broadcaster "
            f"{protocol.broadcaster}) would meet; remove it, use acknowledge ping, or another "
            "broadcaster",
            ("protocol.broadcaster",),
        )
    for auv in protocol.relays(count):
        if auv >= count:
            yield Problem(
                "protocol.relay.who",
                f"there is no AUV{auv}; {count} AUVs have numbers from 0 to {count - 1}",
                ("auvs.count",),
            )


def _laden(site: Site) -> Iterator[Problem]:
    """Yield why AUVs cannot send data behind their pings in this scenario."""
    protocol = site.scenario.protocol
    if site.scenario.traffic is None:
        return
    if protocol.asvs_ping:
        yield Problem(
            "traffic",
            f"data follow pings of AUVs, and with ranging {protocol.ranging} ASVs ping; remove it, "
            f"or use {_by_own_clocks()}",
            ("protocol.ranging",),
        )
    elif protocol.replies:
        yield Problem(
            "traffic",
            f"{protocol.downlink} answers a ping while its data arrive; remove it, or use "
            f"{' or '.join(_foreseen())}",
            ("protocol.downlink",),
        )
    elif site.scenario.navigation.peers is not None:
        yield Problem(
            "traffic",
            "AUVs that range each other (navigation.peers) may send at any time, also while their "
            "data are on the air; remove one of both",
            ("navigation.peers",),
        )
    elif site.schedule.pace:
        yield Problem(
            "traffic",
            f"{protocol.schedule} leaves no room for data behind pings; remove it, or use a "
            "schedule with slots of T_UL, such as one_per_slot",
            ("protocol.schedule",),
        )


def _by_own_clocks() -> str:
    """Return in words the rangings in which AUVs ping by their own clocks.

    Their slots hold a ping alone.
    """
    return " or ".join(RANGING.having(lambda traits: traits.own_clocks))


def _foreseen() -> list[str]:
    """Return the downlinks whose next round begins at an instant that a frame can announce."""
    return DOWNLINK.having(lambda traits: traits.is_foreseen)


def telling_problems(site: Site) -> Iterator[Problem]:
    """Yield why frames cannot tell AUVs their slots, where they have to."""
    if not site.tells_slots:
        return
    downlink = site.scenario.protocol.downlink
    if not site.downlink.is_foreseen:
        why = (
            "answers each ping at once, and broadcasts no frame that could name the slots of AUVs"
            if site.downlink.replies
            else "begins its rounds at instants that no frame can tell beforehand"
        )
        yield Problem(
            "protocol.knowledge",
            f"broadcast needs frames that name the slots of a round to come; {downlink} {why};"
            f" use {' or '.join(_foreseen())}, or knowledge shared",
            ("protocol.downlink",),
        )
    schedule = site.scenario.protocol.schedule
    names_all = site.schedule.names_all
    if site.scenario.protocol.dissemination.missed == "contention" and not names_all:
        yield Problem(
            "protocol.knowledge.missed",
            f"contention needs rounds that name all AUVs but those that are lost; {schedule} names "
            "some, and the others cannot tell; use silent or last_slot, or another schedule",
            ("protocol.schedule",),
        )
    room = _room(site)
    if room is not None:
        yield from _overfull(site, room)


def _room(site: Site) -> int | None:
    """Return the capacity (bytes) of a message beside its header; None if it is unlimited."""
    mf = site.scenario.acoustics.mf
    try:
        measured = None if mf.airtimes is None else airtime_table(mf.airtimes).most_bytes
    except ValueError:
        return None  # reported elsewhere
    sizes = [size for size in (mf.payload_bytes, measured) if size is not None]
    return min(sizes) - mf.header_bytes if sizes else None


def _overfull(site: Site, room: int) -> Iterator[Problem]:
    """Yield why messages with a capacity of `room` bytes cannot tell AUVs their slots."""
    each, count, mf = (
        site.scenario.protocol.dissemination.assignment_bytes,
        site.scenario.auvs.count,
        site.scenario.acoustics.mf,
    )
    key, others = (
        "protocol.knowledge.assignment_bytes",
        ("acoustics.mf.payload_bytes", "acoustics.mf.modem"),
    )
    if each > room:
        yield Problem(
            key,
            f"a message has room for {room} B beside its header, and one slot takes {each} B; "
            "make it smaller, or use a modem with larger messages",
            others,
        )
    elif mf.overfull != "split" and each * count + mf.fix_bytes > room:
        yield Problem(
            key,
            f"a broadcast of one message (overfull {mf.overfull}) has room for {room} B beside its "
            f"header, and tells {count} AUVs their slots in {each * count} B, which leaves no fix "
            f"of {mf.fix_bytes} B; use overfull split, or larger messages",
            (*others, "acoustics.mf.overfull", "auvs.count"),
        )


def acoustics_problems(site: Site) -> Iterator[Problem]:
    """Yield contradictions about channels, and about messages of the downlink."""
    yield from _channels(site)
    yield from _messages(site)


def _channels(site: Site) -> Iterator[Problem]:
    for band in ("hf", "mf"):
        channel = site.scenario.acoustics.bands[band].channel
        for setting, message in _bottom_mistakes(channel, site.deepest_m):
            yield Problem(
                f"acoustics.{band}.channel.{setting}",
                message,
                ("survey.depth_m", "survey.depths_m"),
            )


def _bottom_mistakes(channel: PartChoice, deepest_m: float) -> Iterator[tuple[str, str]]:
    """Yield (setting, message) where no rays or echoes can be computed down to `deepest_m` (m)."""
    declared = CHANNEL.declared(channel)
    traced = declared.traces_rays and channel.settings.get("rays") is None
    if not traced and not declared.has_echoes:
        return
    tracing = CHANNEL.having(lambda traits: traits.traces_rays)[0]
    usual = CHANNEL.settings[tracing].model_fields["bottom_m"].default if traced else None
    bottom = channel.settings.get("bottom_m", usual)
    if isinstance(bottom, int | float) and bottom <= deepest_m:
        yield (
            "bottom_m",
            f"the sea, {bottom:g} m deep, ends above the survey at {deepest_m:g} m; give its depth",
        )
    if traced and find_spec("pelagic") is None:
        yield (
            "rays",
            "rays are traced by the package pelagic (pip install 'bindusbl-des[bellhop]'); or give "
            "a table of them",
        )


def _messages(site: Site) -> Iterator[Problem]:
    """Yield why ASVs cannot send messages of the downlink."""
    mf, protocol = site.scenario.acoustics.mf, site.scenario.protocol
    try:
        measured = None if mf.airtimes is None else airtime_table(mf.airtimes).most_bytes
    except ValueError as error:
        yield Problem("acoustics.mf.airtimes", str(error))
        return
    if not protocol.sends_frames:
        return
    most, key = mf.payload_bytes, "acoustics.mf.payload_bytes"
    if measured is not None:
        if most is not None and most > measured:
            yield Problem(
                key,
                f"{most} B exceed the table of airtimes, which ends at "
                f"{measured} B; use that at most",
                ("acoustics.mf.airtimes", "acoustics.mf.modem"),
            )
        most = min(measured, most or measured)
    needed = mf.header_bytes + mf.fix_bytes
    if most is not None and most < needed:
        yield Problem(
            key,
            f"a message of {most} B holds no fix, which with its header takes header_bytes + "
            f"fix_bytes = {needed} B; make these smaller, or use a modem with larger messages",
            ("acoustics.mf.header_bytes", "acoustics.mf.fix_bytes", "acoustics.mf.modem"),
        )
