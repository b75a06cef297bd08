"""Colours: what is written in them can be read, and no two of them are taken for one another."""

import re
from importlib.resources import files
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from bindusbl_des.support import palette

TEXT, GRAPHICS = 4.5, 3.0  # WCAG 2.2: 1.4.3 and 1.4.11

# Linear RGB to OKLab (Ottosson 2020), in which distances are about as large as they look
LMS = np.array(
    [[0.4122214708, 0.5363325363, 0.0514459929], [0.2119034982, 0.6806995451, 0.1073969566],
     [0.0883024619, 0.2817188376, 0.6299787005]]
)  # fmt: skip
LAB = np.array(
    [[0.2104542553, 0.7936177850, -0.0040720468], [1.9779984951, -2.4285922050, 0.4505937099],
     [0.0259040371, 0.7827717662, -0.8086757660]]
)  # fmt: skip


def linear(code: str) -> NDArray[np.float64]:
    """Return the linear RGB of a colour."""
    part = np.array([int(code[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours (WCAG 2.2)."""
    light = sorted(float(linear(code) @ [0.2126, 0.7152, 0.0722]) for code in (one, other))
    return (light[1] + 0.05) / (light[0] + 0.05)


def chrome(theme: str) -> dict[str, str]:
    """Return the colours of a page about its data, by their names in the style sheet."""
    text = (files("bindusbl_des.apps.report") / "assets" / "page.css").read_text()
    light, dark = re.findall(r":root[^{]*\{([^}]*--paper[^}]*)\}", text)
    return dict(re.findall(r"--(\w+): (#\w{6})", light if theme == "light" else dark))


THEMES = {
    "light": (palette.COLOURS, palette.HF, palette.MF, palette.ALARM, palette.PLANNED),
    "dark": (
        palette.COLOURS_ON_DARK, palette.HF_ON_DARK, palette.MF_ON_DARK, palette.ALARM_ON_DARK,
        palette.PLANNED_ON_DARK,
    ),
}  # fmt: skip


@pytest.mark.parametrize("theme", THEMES)
def test_labels_can_be_read(theme: str) -> None:
    """Names in the colours of AUVs and all other words reach 4.5 : 1 on every ground they have."""
    auvs, hf, mf, alarm, _ = THEMES[theme]
    own = chrome(theme)
    for ground in (own["paper"], own["sheet"], own["sea"]):
        for code in (*auvs, alarm, own["ink"], own["soft"], own["accent"]):
            assert contrast(code, ground) >= TEXT, (code, ground)
        for code in (hf, mf):
            assert contrast(code, ground) >= GRAPHICS, (code, ground)


@pytest.mark.parametrize("theme", THEMES)
def test_a_colour_means_one_thing(theme: str) -> None:
    """No AUV looks like another, like a range, a frame, a collision, a plan, or the ink."""
    auvs, *meanings = THEMES[theme]
    places = {code: LAB @ np.cbrt(LMS @ linear(code)) for code in (*auvs, *meanings)}
    places["ink"] = LAB @ np.cbrt(LMS @ linear(chrome(theme)["ink"]))
    assert len(places) == len(auvs) + len(meanings) + 1
    for (one, here), (other, there) in combinations(places.items(), 2):
        assert np.linalg.norm(here - there) > 0.08, (one, other)


def test_pages_have_the_colours_of_the_figures() -> None:
    """The style sheet's variables are the palette, which has as many colours for each theme."""
    _, light, dark = palette.variables().splitlines()
    assert re.findall(r"--c\d: (#\w{6})", light) == list(palette.COLOURS)
    assert re.findall(r"--c\d: (#\w{6})", dark) == list(palette.COLOURS_ON_DARK)
    assert len(palette.COLOURS) == len(palette.COLOURS_ON_DARK) == 8


def test_shades_can_be_read() -> None:
    """What is written on a shade reaches 4.5 : 1, and each shade is lighter than the one before."""
    shades = re.findall(r"background: (#\w{6}); color: #(\w{3});", palette.variables())
    assert [code for code, _ in shades] == list(palette.SHADES)
    script = (files("bindusbl_des.apps.report") / "assets" / "base.js").read_text()
    stops = eval(re.findall(r"CIVIDIS = (\[\[.*?\]\])", script)[0])  # maps draw between these
    assert [f"#{bytes(it).hex()}" for it in stops] == list(palette.SHADES[::2])
    assert all(contrast(code, f"#{2 * ink}") >= TEXT for code, ink in shades)
    lights = [float(linear(code) @ [0.2126, 0.7152, 0.0722]) for code, _ in shades]
    assert lights == sorted(lights)
