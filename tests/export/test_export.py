"""Exports are read back: MCAP with its reference reader, CSV as spreadsheets and pandas do."""

import csv
import json
import math
import resource
import tracemalloc
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from click.testing import Result
from commands_for_tests import call
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from worlds import QUIET_NAVIGATION, scenario

from bindusbl_des import load_result, simulate
from bindusbl_des.apps.export import mcap_file, scenery
from bindusbl_des.apps.export import messages as streamed
from bindusbl_des.core.geometry.geodesy import ned_from_geodetic

pytestmark = pytest.mark.usefixtures("in_this_process")

ORIGIN = {"lat_deg": 54.33, "lon_deg": 10.18}
TABLES = (
    *("rounds", "pings", "receptions", "broadcasts", "frame_receptions", "assignments"),
    *("fixes", "tracks", "auvs", "mission"),
)


def invoke(*arguments: str | Path) -> Result:
    return call(*([str(argument) for argument in arguments]))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a short mission with an origin, in which some sound is lost, and AUVs
    are told their slots.
    """
    folder = tmp_path_factory.mktemp("export") / "run"
    asked = scenario(
        name="Kiel Fjord",
        duration_s=40.0,
        environment={"origin": ORIGIN},
        acoustics={"loss": {"combine": "clamp_first"}},
        protocol={"knowledge": "broadcast"},
    )
    simulate(asked, seed=3).write(folder)
    return folder


class JsonDecoders:
    """Decoders of JSON messages, for the reference reader."""

    def decoder_for(self, encoding: str, _: object) -> Any:
        return json.loads if encoding == "json" else None


Read = dict[str, list[tuple[Any, Any, Any]]]


@pytest.fixture(scope="module")
def read(run: Path) -> Read:
    """Return what the reference reader finds, by topic: (schema, log time in ns, content)."""
    outcome = invoke("export", run, "--to", "mcap")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout.strip() == str(run / "Kiel_Fjord.mcap")
    return messages_of(run / "Kiel_Fjord.mcap")


def messages_of(path: Path) -> Read:
    """Return what the reference reader finds in a file, by topic."""
    found: Read = defaultdict(list)
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory(), JsonDecoders()])
        for schema, channel, message, content in reader.iter_decoded_messages(log_time_order=False):
            found[channel.topic].append((schema.name, message.log_time, content))
    return found


def rows(read: Read, table: str) -> list[dict[str, Any]]:
    """Return the rows of a table from all vehicles' topics."""
    topics = [topic for topic in read if topic.rpartition("/")[2] == table]
    return [row for topic in topics for name, _, row in read[topic] if name.startswith("bindusbl")]


def entities(read: Read, topic: str) -> Iterator[Any]:
    return (entity for _, _, update in read[topic] for entity in update.entities)


@pytest.mark.parametrize("table", TABLES)
def test_every_row_of_every_table_is_a_message(run: Path, read: Read, table: str) -> None:
    """The rows read back are those of the Parquet tables; what is missing is left out."""
    expected = [
        {name: value for name, value in row.items() if value is not None}
        for row in load_result(run).arrow[table].to_pylist()
    ]
    assert len(expected) > 0
    assert Counter(map(json.dumps, rows(read, table))) == Counter(map(json.dumps, expected))


def test_every_vehicle_has_its_topics(run: Path, read: Read) -> None:
    """A topic holds the rows of one vehicle, so that plots need no filter."""
    for topic, messages in read.items():
        _, vehicle, *rest = topic.split("/")
        for schema, _, row in messages:
            if rest and schema.startswith("bindusbl"):
                named = (
                    {row.get("auv"), row.get("vehicle")} if rest != ["broadcasts"] else {row["asv"]}
                )
                assert vehicle in named


def test_log_times_are_mission_times_and_rise_strictly(read: Read) -> None:
    """Rows lie at their instant within a few ns; nothing on a topic happens at the same time."""
    instants = {
        "rounds": "started_at_s",
        "pings": "sent_at_s",
        "receptions": "arrived_at_s",
        "frame_receptions": "arrived_at_s",
        "broadcasts": "sent_at_s",
        "fixes": "pinged_at_s",
        "tracks": "time_s",
    }
    for topic, messages in read.items():
        times = [at for _, at, _ in messages]
        assert (np.diff(times) > 0).all(), topic
        if instant := instants.get(topic.rpartition("/")[2]):
            if messages[0][0].startswith("foxglove"):
                continue
            for _, at, row in messages:
                assert at == pytest.approx(row[instant] * 1e9, abs=8)


def test_messages_are_written_in_the_order_of_time(run: Path, read: Read) -> None:
    """A viewer can play the file without sorting it."""
    with open(run / "Kiel_Fjord.mcap", "rb") as file:
        messages = make_reader(file).iter_messages(log_time_order=False)
        times = [message.log_time for _, _, message in messages]
    assert np.diff(times).min() > -8  # but for what falls on the same instant


def test_frames_lie_where_the_tracks_are(run: Path, read: Read) -> None:
    """East is y, north is x, up is -z; the bow points where the heading does."""
    tracks = load_result(run).tables["tracks"].set_index(["vehicle", "time_s"])
    placed = {}
    for _, at, message in read["/tf"]:
        for transform in message.transforms:
            assert transform.parent_frame_id == "map"
            assert transform.timestamp.seconds * 10**9 + transform.timestamp.nanos == at
            placed[transform.child_frame_id, at / 1e9] = transform
    assert len(placed) == len(tracks) + 2 * tracks.estimate_x_m.notna().sum()
    for (vehicle, time), row in tracks.iterrows():
        truth = placed[vehicle, time]
        where = truth.translation
        assert (where.y, where.x, -where.z) == (row.x_m, row.y_m, row.z_m)
        bow = 2 * math.atan2(truth.rotation.z, truth.rotation.w)
        assert (math.sin(bow), math.cos(bow)) == pytest.approx(
            (math.cos(row.yaw_rad), math.sin(row.yaw_rad)), abs=1e-9
        )
        if vehicle.startswith("AUV"):
            estimate = placed[f"{vehicle}/estimate", time].translation
            imu = placed[f"{vehicle}/imu", time].translation
            assert (estimate.y, estimate.x, -estimate.z) == tuple(
                row[["estimate_x_m", "estimate_y_m", "estimate_z_m"]]
            )
            assert (imu.y, imu.x) == tuple(row[["imu_x_m", "imu_y_m"]])


def test_the_scene_stands_from_the_start(run: Path, read: Read) -> None:
    """Survey, paths, vehicles and ranges are there at 0; ranges go with their ASV."""
    result = load_result(run)
    for topic in ("survey", "planned", "truth", "estimate", "imu", "vehicles", "ranges"):
        assert [at for _, at, _ in read[f"/scene/{topic}"]] == [0]
    for kind, prefix in (("truth", ""), ("estimate", "estimate_")):
        for entity in entities(read, f"/scene/{kind}"):
            track = result.tables["tracks"].query("vehicle == @entity.id")
            drawn = [(point.y, point.x, -point.z) for point in entity.lines[0].points]
            columns = [f"{prefix}{axis}_m" for axis in "xyz"]
            assert drawn == [tuple(place) for place in track[columns].to_numpy()]
    ranges = list(entities(read, "/scene/ranges"))
    assert [entity.frame_id for entity in ranges] == ["ASV0", "ASV1", "ASV2"]
    radii = [math.hypot(line.points[5].x, line.points[5].y) for line in ranges[0].lines]
    assert radii == pytest.approx([50.0, 100.0])
    assert len(list(entities(read, "/scene/planned"))) == 3


def test_a_slant_range_is_drawn_as_it_reaches_the_depth_of_the_auvs(tmp_path: Path) -> None:
    """50 m through the water reach 40 m far at 30 m depth, as on the page and in figures."""
    hf = {"range_m": 50.0, "range_metric": "slant"}
    deep = scenario(duration_s=2.0, survey={"depth_m": 30.0}, acoustics={"hf": hf})
    simulate(deep, seed=3).write(tmp_path / "run")
    invoke("export", tmp_path / "run", "--to", "mcap", "--out", tmp_path / "a.mcap")
    for asv in entities(messages_of(tmp_path / "a.mcap"), "/scene/ranges"):
        radii = [math.hypot(line.points[5].x, line.points[5].y) for line in asv.lines]
        assert radii == pytest.approx([40.0, 100.0])


def test_pings_have_a_ray_to_every_asv_in_range(run: Path, read: Read) -> None:
    """A ray begins at the AUV, ends at the ASV, and its colour tells what became of the ping."""
    tables = load_result(run).tables
    pings, receptions = tables["pings"], tables["receptions"]
    drawn = list(entities(read, "/scene/pings"))
    assert len(drawn) == len(pings)
    in_range = receptions[receptions.outcome != "out_of_range"]
    assert {"heard", "lost"} <= set(in_range.outcome)
    rays = Counter()
    for entity in drawn:
        dot = entity.spheres[0].pose.position
        for line in entity.lines:
            for point, colour in zip(line.points[::2], line.colors[::2], strict=True):
                assert (point.x, point.y, point.z) == (dot.x, dot.y, dot.z)
                rays[round(colour.r * 255)] += 1
    counts = Counter(in_range.outcome)
    assert rays[0x00] == counts["heard"]
    assert rays[0xD5] == counts["lost"]
    assert rays.total() == len(in_range)


def test_ellipses_hold_the_fix_with_its_covariance(run: Path, read: Read) -> None:
    """All points of an ellipse have the Mahalanobis distance of 95 % in the plane."""
    fixes = load_result(run).tables["fixes"].set_index("fix")
    drawn = list(entities(read, "/scene/fixes"))
    assert len(drawn) == len(fixes)
    for entity in drawn:
        fix = fixes.loc[int(entity.id.removeprefix("fix "))]
        away = np.array([(p.y - fix.x_m, p.x - fix.y_m) for p in entity.lines[0].points])
        covariance = np.array([[fix.sd_x_m**2, fix.cov_xy_m2], [fix.cov_xy_m2, fix.sd_y_m**2]])
        squared = np.einsum("ni,ij,nj->n", away, np.linalg.inv(covariance), away)
        assert squared == pytest.approx(np.full(len(away), 5.991464547), rel=1e-6)


def test_ellipses_of_estimates_are_those_of_the_tracks(run: Path, read: Read) -> None:
    """At each instant a disc lies about each AUV's estimate; its rim is where 95 % end."""
    tracks = load_result(run).tables["tracks"].set_index(["vehicle", "time_s"])
    known = tracks[tracks.estimate_sd_x_m.notna()]
    rim, seen = np.linspace(0.0, 2 * np.pi, 17), 0
    for _, at, update in read["/scene/certainty"]:
        assert [entity.id for entity in update.entities] == ["AUV0", "AUV1", "AUV2"]
        for entity in update.entities:
            row, (disc,) = known.loc[entity.id, at / 1e9], entity.cylinders
            where, turn = disc.pose.position, disc.pose.orientation
            place = (row.estimate_y_m, row.estimate_x_m, -row.estimate_z_m)
            assert (where.x, where.y, where.z) == place
            yaw = 2 * math.atan2(turn.z, turn.w)
            along, aside = disc.size.x / 2 * np.cos(rim), disc.size.y / 2 * np.sin(rim)
            east = math.cos(yaw) * along - math.sin(yaw) * aside
            north = math.sin(yaw) * along + math.cos(yaw) * aside
            xy = row.estimate_cov_xy_m2
            covariance = np.array([[row.estimate_sd_x_m**2, xy], [xy, row.estimate_sd_y_m**2]])
            seen += 1
            if at == 0:  # sure of where it starts
                assert (disc.size.x, disc.size.y) == (0.0, 0.0)
                continue
            squared = np.sum([north, east] * np.linalg.solve(covariance, [north, east]), axis=0)
            assert squared == pytest.approx(np.full(17, 5.991464547), rel=1e-6)
    assert seen == len(known) > 100
    stretched = [
        entity.cylinders[0].size for _, _, update in read["/scene/certainty"]
        for entity in update.entities
    ]  # fmt: skip
    assert max(size.y / size.x for size in stretched if size.x) > 1.5


def test_an_auv_that_is_never_unsure_has_no_ellipse(tmp_path: Path) -> None:
    """Dead reckoning without any noise is right, and knows it."""
    quiet = {"filter": "dead_reckoning", **QUIET_NAVIGATION}
    simulate(scenario(duration_s=3.0, navigation=quiet)).write(tmp_path / "run")
    assert invoke("export", tmp_path / "run", "--to", "mcap").exit_code == 0
    (path,) = (tmp_path / "run").glob("*.mcap")
    with open(path, "rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    topics = {channel.topic for channel in summary.channels.values()}
    assert "/scene/fixes" in topics
    assert "/scene/certainty" not in topics


def test_rows_come_in_time_with_few_in_memory(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of tables sixty times as long, all of whose rows would take 120 MB as Python objects."""
    monkeypatch.setattr(streamed, "ROWS_AT_ONCE", 100, raising=False)
    result = load_result(run)
    for table in streamed.TOPICS.keys() & result.arrow:
        result.arrow[table] = pa.concat_tables([result.arrow[table]] * 60)
    streams = [streamed.transforms(result), scenery.certainty(result)]
    streams += [mcap_file._pings(result), mcap_file._broadcasts(result), mcap_file._fixes(result)]
    streams += [*streamed.location_streams(result), *streamed.row_streams(result)]
    tracemalloc.start()
    try:
        for stream in streams:
            next(stream, None)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 20e6
    received = result.arrow["frame_receptions"]
    rows = [row for row in received.to_pylist() if row["arrived_at_s"] is not None]
    rows.sort(key=lambda row: row["arrived_at_s"])
    assert list(streamed.rows_in_time(received, "arrived_at_s")) == rows


def test_locations_lead_back_to_the_survey(run: Path, read: Read) -> None:
    """WGS-84 positions of vehicles and fixes are the survey's, and a fix has its covariance."""
    tables = load_result(run).tables
    track = tables["tracks"].query("vehicle == 'AUV1'")
    places = [
        ned_from_geodetic(fix.latitude, fix.longitude, fix.altitude, **{
            "lat_deg": 54.33, "lon_deg": 10.18
        })
        for _, _, fix in read["/AUV1/location"]
    ]  # fmt: skip
    assert np.array(places) == pytest.approx(track[["x_m", "y_m", "z_m"]].to_numpy(), abs=1e-6)
    assert len(read["/AUV1/location/estimate"]) == len(track)
    assert len(read["/ASV2/location"]) == len(track)
    fixes = tables["fixes"].query("auv == 'AUV1'").sort_values("pinged_at_s")
    messages = [message for _, _, message in read["/AUV1/location/fix"]]
    assert len(messages) == len(fixes) > 0
    first, fix = messages[0], fixes.iloc[0]
    assert first.position_covariance[0] == pytest.approx(fix.sd_y_m**2)  # east is y
    assert first.position_covariance[4] == pytest.approx(fix.sd_x_m**2)
    assert first.position_covariance[2] == pytest.approx(-fix.cov_yz_m2)  # up is -z


def test_a_file_says_what_it_shows(run: Path, read: Read) -> None:
    """Scenario, seed, clock and frames travel with the file."""
    with open(run / "Kiel_Fjord.mcap", "rb") as file:
        reader = make_reader(file)
        (told,) = reader.iter_metadata()
        (attached,) = reader.iter_attachments()
    assert told.metadata["scenario"] == "Kiel Fjord"
    assert told.metadata["seed"] == "3"
    assert "ENU" in told.metadata["frames"]
    assert json.loads(attached.data)["environment"]["origin"] == ORIGIN


def test_without_an_origin_nothing_is_on_earth(tmp_path: Path) -> None:
    """No position on Earth is made up."""
    simulate(scenario(duration_s=3.0)).write(tmp_path / "run")
    outcome = invoke("export", tmp_path / "run", "--to", "mcap", "--out", tmp_path / "a.mcap")
    assert outcome.exit_code == 0
    assert "environment.origin" in outcome.stderr
    with open(tmp_path / "a.mcap", "rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert not any("location" in channel.topic for channel in summary.channels.values())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "run"]


@pytest.mark.parametrize("table", TABLES)
def test_csv_is_what_parquet_is(run: Path, tmp_path: Path, table: str) -> None:
    """Values, columns and missing values come back as they were."""
    assert invoke("export", run, "--to", "csv", "--out", tmp_path / "csv").exit_code == 0
    exact = {} if pd.__version__ >= "3.1" else {"float_precision": "round_trip"}
    back = pd.read_csv(tmp_path / "csv" / f"{table}.csv", **exact)
    original = pq.read_table(run / f"{table}.parquet").to_pandas()
    pd.testing.assert_frame_equal(back, original, check_dtype=False, check_exact=True)


def test_csv_comes_with_a_description_of_every_column(run: Path, tmp_path: Path) -> None:
    """Unit, meaning and frame of each column stand in a table of their own."""
    invoke("export", run, "--to", "csv", "--out", tmp_path / "csv")
    with open(tmp_path / "csv" / "columns.csv", encoding="utf-8", newline="") as file:
        told = {(row["table"], row["column"]): row for row in csv.DictReader(file)}
    assert told["fixes", "latency_s"]["unit"] == "s"
    assert told["tracks", "yaw_rad"]["frame"].startswith("survey:")
    for table in TABLES:
        with open(tmp_path / "csv" / f"{table}.csv", encoding="utf-8", newline="") as file:
            header = next(csv.reader(file))
        assert header == [column for name, column in told if name == table]


def test_a_campaign_becomes_csv(tmp_path: Path) -> None:
    """The missions and their AUVs, with what was varied and its unit."""
    (tmp_path / "mission.yaml").write_text("name: tiny\nduration_s: 5\n")
    (tmp_path / "sweep.yaml").write_text(
        "scenario: mission.yaml\nvary: {asvs.count: [1, 2]}\nseeds: 2\n"
    )
    folder = tmp_path / "campaign"
    swept = invoke("sweep", tmp_path / "sweep.yaml", "--out", folder, "--workers", "1")
    assert swept.exit_code == 0, swept.output
    outcome = invoke("export", folder, "--to", "csv")
    assert outcome.exit_code == 0, outcome.output
    missions = pd.read_csv(folder / "csv" / "missions.csv")
    assert missions["asvs.count"].tolist() == [1, 1, 2, 2]
    assert len(pd.read_csv(folder / "csv" / "auvs.csv")) == 12
    refused = invoke("export", folder, "--to", "mcap")
    assert refused.exit_code == 2
    assert "give the folder of a run" in refused.output


def test_an_earlier_export_gives_way_only_to_force(run: Path, tmp_path: Path) -> None:
    """And by force nothing else than an export gives way."""
    for kind, out in (("mcap", tmp_path / "a.mcap"), ("csv", tmp_path / "csv")):
        arguments = ("export", run, "--to", kind, "--out", out)
        assert invoke(*arguments).exit_code == 0
        assert "--force" in invoke(*arguments).output
        assert invoke(*arguments).exit_code == 2
        assert invoke(*arguments, "--force").exit_code == 0
    (tmp_path / "csv" / "notes.txt").write_text("mine")
    for kind, said in (("mcap", "is a folder"), ("csv", "no earlier export (it holds notes.txt)")):
        outcome = invoke("export", run, "--to", kind, "--out", tmp_path / "csv", "--force")
        assert outcome.exit_code == 2
        assert said in outcome.output
    assert (tmp_path / "csv" / "notes.txt").read_text() == "mine"


def test_what_cannot_be_exported_is_refused_with_a_remedy(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder without a run, a place that does not exist, a run of metrics only."""
    simulate(scenario(duration_s=3.0, record={"detail": "summary"})).write(tmp_path / "metrics")
    for arguments, said in (
        ((tmp_path / "nowhere", "--to", "mcap"), "is no result folder"),
        ((tmp_path, "--to", "csv"), "is no result folder"),
        ((run, "--to", "mcap", "--out", tmp_path / "no" / "a.mcap"), "does not exist"),
        ((tmp_path / "metrics", "--to", "mcap"), "record.detail=full"),
        ((run, "--to", "rosbag"), "'mcap', 'ros2bag', 'csv'"),
    ):
        outcome = invoke("export", *arguments)
        assert outcome.exit_code == 2, outcome.output
        assert said in outcome.output
    assert invoke("export", tmp_path / "metrics", "--to", "csv").exit_code == 0


def test_a_link_where_a_draft_was_leads_nowhere(run: Path, tmp_path: Path) -> None:
    """An export into a stranger's folder changes no file of one's own."""
    (tmp_path / "mine").write_text("precious")
    (tmp_path / ".a.mcap.tmp").symlink_to(tmp_path / "mine")
    assert invoke("export", run, "--to", "mcap", "--out", tmp_path / "a.mcap").exit_code == 0
    assert (tmp_path / "mine").read_text() == "precious"
    assert sorted(it.name for it in tmp_path.iterdir()) == [".a.mcap.tmp", "a.mcap", "mine"]


def test_a_table_of_ones_own_keeps_the_folder_of_an_export(run: Path, tmp_path: Path) -> None:
    """Force replaces the files that an export writes, and no other CSV file."""
    arguments = ("export", run, "--to", "csv", "--out", tmp_path / "csv", "--force")
    assert invoke(*arguments).exit_code == 0
    (tmp_path / "csv" / "mine.csv").write_text("precious")
    outcome = invoke(*arguments)
    assert outcome.exit_code == 2
    assert "csv: is no earlier export (it holds mine.csv)" in outcome.output
    assert (tmp_path / "csv" / "mine.csv").read_text() == "precious"


def test_a_missing_extra_is_named_with_its_remedy(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without foxglove-sdk the command says what to install; CSV needs nothing."""
    import sys

    for name in [name for name in sys.modules if name.startswith("bindusbl_des.apps.export.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "foxglove", None)
    outcome = invoke("export", run, "--to", "mcap", "--out", tmp_path / "a.mcap")
    assert outcome.exit_code == 2
    assert "bindusbl-des[mcap]" in outcome.output
    assert invoke("export", run, "--to", "csv", "--out", tmp_path / "csv").exit_code == 0


def test_an_export_to_a_disk_that_is_full_leaves_nothing(run: Path, tmp_path: Path) -> None:
    """No file may grow beyond 1000 bytes: in the middle of a recording, as on a full disk."""
    most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, most[1]))
    try:
        outcome = invoke("export", run, "--to", "mcap", "--out", tmp_path / "a.mcap")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, most)
    assert outcome.exit_code == 2
    assert "a.mcap: cannot be written (is the disk full? " in outcome.output
    assert not list(tmp_path.iterdir())
