"""The channel `disc`: all signals within its range are decoded, except for `acoustics.loss`;
compiled with the propagation of sound (:mod:`...core.acoustics.propagation`).
"""

from ...core.scenario.families import ChannelTraits, Lossy


class Disc(Lossy):
    """Settings of the channel `disc`."""


disc = ChannelTraits(settings=Disc, frame_settings=Disc, ends_at_range=True, keeps_frames=True)
