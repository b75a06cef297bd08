"""The channel `disc`: within its range all is decoded, but for `acoustics.loss`; compiled with the
spreading of sound (:mod:`...core.acoustics.propagation`).
"""

from ...core.scenario.families import ChannelTraits, Lossy


class Disc(Lossy):
    """The settings of the channel `disc`."""


disc = ChannelTraits(settings=Disc, frame_settings=Disc, ends_at_range=True, keeps_frames=True)
