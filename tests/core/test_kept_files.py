"""Files that a scenario names, by their contents."""

from pathlib import Path

import pytest

from bindusbl_des.core.kept_files import (
    FILES,
    KEPT,
    check_kept,
    copies_of,
    keep,
    kept_name,
    named_files,
    portable,
    renamed_point,
)


def test_a_copy_is_named_by_folder_contents_and_ending(tmp_path: Path) -> None:
    file = tmp_path / "Kiel fjord.geojson"
    file.write_text("{}")
    name = kept_name(str(file), "charts")
    # the first digits of the sha256 of "{}"
    assert name == "charts/Kiel_fjord-44136fa355b3678a.geojson"
    assert KEPT.fullmatch(name)
    file.write_text("[]")
    assert kept_name(str(file), "charts") != name


def test_files_of_all_ways_are_found_and_kept(tmp_path: Path) -> None:
    """Copies named by a copied scenario have the same names again."""
    data: dict[str, object] = {"auvs": {"route": {"files": []}}, "survey": {"area": None}}
    assert named_files(data) == []
    assert copies_of(data) == {}
    (tmp_path / "a.csv").write_text("a")
    (tmp_path / "b.kml").write_text("b")
    track, area = str(tmp_path / "a.csv"), str(tmp_path / "b.kml")
    data = {"auvs": {"route": {"files": [track, track]}}, "survey": {"area": area}}
    assert named_files(data) == [track, track, area]
    copies = copies_of(data)
    assert list(copies.values()) == [track, area]
    keep(copies, tmp_path)
    check_kept(list(copies), tmp_path)
    kept = {"survey": {"area": str(tmp_path / portable(data)["survey"]["area"])}}
    assert portable(kept)["survey"] == portable(data)["survey"]
    (tmp_path / list(copies)[1]).write_text("c")
    with pytest.raises(ValueError, match="has been changed since; put the file back"):
        check_kept(list(copies), tmp_path)


@pytest.mark.parametrize("way", FILES)
def test_points_of_campaigns_name_files_on_every_level(way: tuple[str, ...]) -> None:
    for depth in range(1, len(way) + 1):
        value: object = "x"
        for name in reversed(way[depth:]):
            value = {name: value}
        point = {".".join(way[:depth]): value, "auvs.count": 3}
        seen: list[str] = []

        def note(name: str, folder: str, seen: list[str] = seen) -> str:
            seen.append(f"{folder}/{name}")
            return name

        assert renamed_point(point, note) == point
        assert seen == [f"{FILES[way]}/x"]
