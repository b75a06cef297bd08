"""The colours of results in figures, pages and exported scenes: each has one meaning.

Hues belong to AUVs, amber to the MF downlink, red to collisions, buff to land as on sea charts,
greys to the surroundings.  AUVs' names are written in their colours, which therefore have a
contrast of at least 4.5 : 1 on their ground (WCAG 2.2, 1.4.3); the first ones differ in lightness,
too, for readers who cannot tell all hues apart.
"""

# AUV0, AUV1, ... on white
COLOURS = (
    "#0b57b0", "#9a3b00", "#00785a", "#8a0a5c", "#8038c8", "#1f6480", "#5a3613", "#2f4b00",
)  # fmt: skip
INK, FAINT, PLANNED, HF = "#333333", "#d8d8d8", "#9aa5af", "#6f7d8a"
MF, ALARM = "#b97f00", "#d01030"
LAND, SHORE, DEPTH = "#e9dfc6", "#8a7b56", "#6ba3bf"

# The same on the dark ground of pages and viewers
COLOURS_ON_DARK = (
    "#4b9cff", "#ff9b78", "#2fe0a2", "#ffaaec", "#a57cd2", "#3cd6f5", "#d6963b", "#d6fc07",
)  # fmt: skip
PLANNED_ON_DARK, HF_ON_DARK, MF_ON_DARK, ALARM_ON_DARK = "#5f7080", "#8796a5", "#f2c230", "#ff4d5a"
LAND_ON_DARK, SHORE_ON_DARK, DEPTH_ON_DARK = "#38331f", "#a3946a", "#9fd0e8"

# Cividis: even steps of lightness, the same for every kind of colour vision.  Dark is bad.
SHADES = (
    "#00224e", "#1a345d", "#35456c", "#4e576e", "#666970", "#7d7c74",
    "#948e77", "#aea36e", "#c8b866", "#e3d04f", "#fee838",
)  # fmt: skip
# The first shades have white text on them, with a contrast of 4.5 : 1.
WHITE_ON = 5


def variables() -> str:
    """Return the colours as variables of a style sheet (`--c0`, ...), for a light and a dark theme.

    Also the classes `shade0` to `shade10`, whose ground is a shade.
    """
    shades = "".join(
        f".shade{number} {{ background: {code}; color: #{'fff' if number < WHITE_ON else '000'}; }}"
        for number, code in enumerate(SHADES)
    )
    light = {
        "plan": PLANNED, "hf": HF, "mf": MF, "collided": ALARM, "land": LAND, "shore": SHORE,
        "depth": DEPTH,
    }  # fmt: skip
    dark = {
        "plan": PLANNED_ON_DARK, "hf": HF_ON_DARK, "mf": MF_ON_DARK, "collided": ALARM_ON_DARK,
        "land": LAND_ON_DARK, "shore": SHORE_ON_DARK, "depth": DEPTH_ON_DARK,
    }  # fmt: skip
    themes = ((":root", light, COLOURS), (":root[data-theme=dark]", dark, COLOURS_ON_DARK))
    return f"{shades}\n" + "\n".join(
        f"{where} {{ "
        + " ".join(f"--{name}: {code};" for name, code in meanings.items())
        + " "
        + " ".join(f"--c{number}: {code};" for number, code in enumerate(colours))
        + " }"
        for where, meanings, colours in themes
    )
