"""Who may ask the workbench, and what it keeps."""

import json
import os
import resource
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from websockets.exceptions import InvalidStatus
from workbench_for_tests import SURVEY, Server, started

from bindusbl_des import load_scenario, plan
from bindusbl_des.apps.campaigns.storage.folder import locked


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("desk") / "cove.yaml"
    file.write_text(SURVEY)
    return file


@pytest.fixture(scope="module")
def server(survey: Path) -> Iterator[Server]:
    with started(survey) as found:
        yield found


def test_the_page_and_what_it_needs_are_there(server: Server) -> None:
    """All that it loads comes from here, and its policy lets nothing else in."""
    status, page, heads = server.ask()
    assert status == 200
    assert "default-src 'none'" in heads["content-security-policy"]
    assert heads["referrer-policy"] == "no-referrer"  # the token is in its address
    assert b"http" not in page
    for name in (part.partition(b'"')[0].decode() for part in page.split(b'"assets/')[1:]):
        assert server.ask(f"assets/{name}")[0] == 200, name


@pytest.mark.parametrize(
    ("path", "heads"),
    [
        ("/", {}),
        ("/wrong-token/", {}),
        ("/wrong-token/talk", {}),
        ("", {"Host": "attacker.example"}),  # a name that was bound to this address anew
        ("", {"Host": "127.0.0.1:1"}),
        ("", {"Origin": "http://attacker.example"}),
        ("", {"Origin": "null"}),  # a sandboxed frame
        ("keys", {"Origin": "http://localhost:1"}),
    ],
)
def test_others_are_refused(server: Server, path: str, heads: dict[str, str]) -> None:
    status, said, _ = server.ask(path, **heads)
    assert status == 403
    assert b"cove" not in said


@pytest.mark.parametrize("origin", [None, "null", "http://attacker.example"])
def test_windows_and_files_come_from_the_page_alone(server: Server, origin: str | None) -> None:
    """A page elsewhere can open a socket to this host, and post to it: its origin tells."""
    heads = {} if origin is None else {"Origin": origin}
    assert server.ask("drop?name=a.kml", "POST", b"<kml/>", **heads)[0] == 403
    with pytest.raises(InvalidStatus), server.window(origin=origin):
        pass


@pytest.mark.parametrize(
    "path", ["assets/../server.py", "assets/%2e%2e%2fserver.py", "assets/..%5cserver.py",
             "pages/1/..%2f..%2fjob.json", "pages/99/0", "export/1/kml", "export/99/kml"],
)  # fmt: skip
def test_no_other_files_are_served(server: Server, path: str) -> None:
    assert server.ask(path)[0] == 404


def test_it_listens_on_this_machine_alone(server: Server) -> None:
    """Another address of the same machine reaches nothing."""
    with pytest.raises(ConnectionRefusedError), socket.create_connection(
        ("127.0.0.2", int(server.host.partition(":")[2])), timeout=2
    ):  # fmt: skip
        pass


@pytest.mark.parametrize("name", ["../../up.kml", "/tmp/up.kml", ".hidden.kml", "a\0b.kml"])
def test_dropped_files_lie_beside_the_scenario(server: Server, survey: Path, name: str) -> None:
    """Whatever they are called, under a name that nothing else has."""
    origin = {"Origin": f"http://{server.host}"}
    where = f"drop?name={quote(name)}"
    kept = [json.loads(server.ask(where, "POST", raw, **origin)[1])["name"]
            for raw in (b"<kml/>", b"<kml></kml>", b"<kml/>")]  # fmt: skip
    assert kept[0] == kept[2] != kept[1]  # the same again is there
    assert all((survey.parent / one).is_file() for one in kept)
    assert not any(one.startswith(".") or "/" in one for one in kept)
    assert server.ask("drop?name=run.sh", "POST", b"", **origin)[0] == 400


def test_what_is_asked_in_vain_is_said(server: Server) -> None:
    """No message of a page, however wrong, ends the window or leaves a traceback."""
    with server.window() as window:
        for text in ("[]", "{}", "no JSON", '{"do": "vessels"}', '{"do": "__init__"}',
                     '{"do": "begin", "kind": "rm"}', '{"do": "stop", "job": 7}'):  # fmt: skip
            window.socket.send(text)
            assert window.until("said")["bad"] is True
        window.do("begin", kind="plan", below=["position_error_m=1 --out /tmp/x"])
        assert "NAME=VALUE" in window.until("said")["text"]


def test_changes_are_those_of_the_file(server: Server, survey: Path) -> None:
    """What is drawn stands in the file, comments stay, and every step can be gone back."""
    with server.window() as window:
        before = window.desk["text"]
        look = window.change("vessels", stations=[[1, 2], [3.004, -4], [5, 6]])
        assert look["chart"]["stations"] == [[1, 2], [3.0, -4], [5, 6]]
        assert load_scenario(survey).asvs.count == 3
        corners = [[0, 0], [100, 0], [100, 80]]
        assert window.change("area", corners=corners)["chart"]["outline"] == corners
        assert len(window.change("ways", points=[[[10, 10], [60, 20]]])["chart"]["ways"]) == 1
        window.change("key", key="acoustics.hf.range_m", value="70")
        assert window.desk["given"]["acoustics.hf.range_m"] == 70
        text = survey.read_text()
        assert text.startswith("# what is said of it stays")
        assert "# a square" in text
        for _ in range(4):
            window.change("step", by=-1)
        assert survey.read_text() == before
        window.change("step", by=1)
        assert load_scenario(survey).asvs.count == 3
        window.change("step", by=-1)


# An island in a hole of the area's chart
CHART = [
    [[153.0, -33.0], [153.003, -33.0], [153.003, -33.002], [153.0, -33.002], [153.0, -33.0]],
    [[153.001, -33.001], [153.0012, -33.001], [153.0012, -33.0012], [153.001, -33.001]],
]


def test_land_is_drawn_moved_and_erased(server: Server, survey: Path) -> None:
    """Land and keep-outs are polygons of the scenario; what lies on land can be moved off it."""
    with server.window() as window:
        before = window.desk["text"]
        island, fairway = [[30, -10], [50, -10], [50, 10]], [[-60, 40], [60, 40], [60, 50]]
        window.change("shapes", name="keep_out", polygons=[fairway])
        chart = window.change("shapes", name="land", polygons=[island])["chart"]
        assert (chart["land"], chart["keep_out"]) == ([island], [fairway])
        assert load_scenario(survey).survey.land == (tuple(map(tuple, island)),)
        hidden = window.change("vessels", stations=[[45, -30]])["chart"]["shadows"]
        assert hidden  # behind the island
        look = window.change("vessels", stations=[[45, -2]])
        assert "on land" in look["mistakes"][0]["message"]
        assert (look["chart"]["land"], look["chart"]["stations"]) == ([island], [[45, -2]])
        assert window.change("shapes", name="land", polygons=[])["mistakes"] == []
        assert load_scenario(survey).survey.land is None
        window.change("text", text=before)


def test_a_chart_is_what_one_says_it_is(server: Server, survey: Path) -> None:
    """A file that may be several things is asked about; holes of an area stay land as it is drawn
    anew.
    """
    origin = {"Origin": f"http://{server.host}"}

    def dropped(name: str, rings: object) -> str:
        raw = json.dumps({"type": "Polygon", "coordinates": rings}).encode()
        kept = json.loads(server.ask(f"drop?name={name}", "POST", raw, **origin)[1])["name"]
        assert isinstance(kept, str)
        return kept

    bay, isle = dropped("bay.geojson", CHART), dropped("isle.geojson", CHART[1:])
    with server.window() as window:
        before = window.desk["text"]
        moored = before.replace("positions_m: [[-30, 0], [30, 0]]", "positions_m: [[99, 0]]")
        window.change("text", text=moored.replace("asvs: {count: 2", "asvs: {count: 1"))
        look = window.change("file", name=bay)  # nothing says where on Earth land would be
        (hole,) = look["chart"]["land"]
        assert len(hole) == 3
        corners = [[-90, -120], [120, -140], [100, 130], [-100, 140]]
        chart = window.change("area", corners=corners)["chart"]
        assert chart["outline"] == corners
        assert chart["land"][0] == [pytest.approx(corner, abs=0.01) for corner in hole]
        assert load_scenario(survey).survey.area is None
        window.do("file", name=isle)
        assert window.until("choose")["among"][:2] == ["the area", "land"]
        look = window.change("file", name=isle, **{"as": "land"})
        assert look["chart"]["land"][0] == [pytest.approx(corner, abs=0.01) for corner in hole]
        assert load_scenario(survey).survey.land.endswith("isle.geojson")
        window.change("text", text=before)


def test_a_chart_of_several_areas_is_asked_about_by_their_names(
    server: Server, survey: Path
) -> None:
    """As Google Earth saves them; a name may be anything."""
    bay = "".join(f"{x},{y} " for x, y in CHART[0])
    marks = "".join(
        f"<Placemark><name>{name}</name><Polygon><outerBoundaryIs><LinearRing><coordinates>"
        f"{bay}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>"
        for name in ("North bay", "&lt;b>: 7")
    )
    raw, origin = f"<kml><Document>{marks}</Document></kml>", f"http://{server.host}"
    kept = server.ask("drop?name=two.kml", "POST", raw.encode(), Origin=origin)
    name = json.loads(kept[1])["name"]
    with server.window() as window:
        before = window.desk["text"]
        window.do("file", name=name)
        among = window.until("choose")["among"]
        assert among[:2] == ["the area North bay", "the area <b>: 7"]
        window.change("file", name=name, **{"as": among[1]})
        assert load_scenario(survey).survey.area_name == "<b>: 7"
        window.change("text", text=before)


def test_vessels_of_several_kinds_stay_what_they_are(server: Server, survey: Path) -> None:
    """Who is dragged, gone or new leaves the others with their groups; new ones are as the last."""
    with server.window() as window:
        before = window.desk["text"]
        kinds = "[{count: 1}, {count: 1, vehicle: otter}, {count: 1, usbl: {gnss_sd_m: 2}}]"
        window.change("vessels", stations=[[-30, 0], [0, 5], [30, 0]])
        window.change("text", text=window.desk["text"].replace("count: 3", f"groups: {kinds}"))

        def counts() -> list[tuple[int, str | None]]:
            groups = load_scenario(survey).asvs.groups
            return [(own.count, own.vehicle and str(own.vehicle)) for own in groups]

        def moored(*stations: list[float]) -> list[tuple[int, str | None]]:
            assert window.change("vessels", stations=stations)["mistakes"] == []
            return counts()

        assert counts() == [(1, None), (1, "otter"), (1, None)]
        assert moored([-30, 0], [9, 5], [30, 0]) == [(1, None), (1, "otter"), (1, None)]
        assert moored([-30, 0], [9, 5], [30, 0], [7, 7]) == [(1, None), (1, "otter"), (2, None)]
        assert moored([-30, 0], [30, 0], [7, 7]) == [(1, None), (2, None)]
        assert load_scenario(survey).asvs.groups[1].usbl.gnss_sd_m == 2
        window.change("text", text=before)


def test_mistakes_have_lines_and_do_no_harm(server: Server, survey: Path) -> None:
    with server.window() as window:
        look = window.change("text", text=SURVEY.replace("count: 2}", "cuont: 2}", 1))
        (mistake,) = look["mistakes"]
        assert (mistake["line"], mistake["key"]) == (5, "auvs.cuont")
        window.do("begin", kind="simulate", seeds=1)
        assert "mistakes" in window.until("said")["text"]
        assert window.change("text", text=SURVEY)["mistakes"] == []


def test_two_windows_see_the_same(server: Server, survey: Path) -> None:
    """Who changes what another window, or an editor, has changed meanwhile is told so."""
    with server.window() as one, server.window() as other:
        old = other.desk["version"]
        one.change("vessels", stations=[[9, 9]])
        other.until("desk", version=one.desk["version"])
        other.do("vessels", version=old, stations=[[0, 0]])
        assert "another window" in other.until("said")["text"]
        assert load_scenario(survey).asvs.formation.positions_m == ((9, 9),)
        survey.write_text(SURVEY)  # by an editor
        one.until("desk", text=SURVEY)


def test_the_error_of_other_places_is_predicted(server: Server, survey: Path) -> None:
    """Nothing is kept of what is tried, and what is kept is worth what was told of it."""
    with server.window() as window:
        near, far = [[-30, 0], [30, 0]], [[900, 0], [930, 0]]
        errors = []
        for number, stations in enumerate((near, far)):
            window.do("try", id=number, stations=stations)
            errors.append(window.until("tried", id=number)["worst"]["position_error_m"])
        assert errors[0] < 0.5 * errors[1]
        assert window.desk["text"] == survey.read_text() == SURVEY
        window.change("vessels", stations=far)
        kept = window.until("forecast", version=window.desk["version"])["found"]["worst"]
        assert kept["position_error_m"] == pytest.approx(errors[1], rel=1e-9)
        window.change("step", by=-1)


def test_a_plan_is_asked_in_words(server: Server) -> None:
    """What is predicted is judged by its goal; its command says all that was chosen; it stops."""
    with server.window() as window:
        window.until("forecast")
        for below, met in (("position_error_m=50", True), ("fix_age_p95_s=0.01", False)):
            window.do("goal", below=below)
            told = window.until("forecast")["found"]["goal"]
            assert (told["met"], told["top"]) == (met, 50.0 if met else None)
            assert "predicted" in told["told"]
        for wrong in ({"survive": "1; rm"}, {"placed": ["ring; rm"]}, {"budget_missions": -1}):
            window.do("begin", kind="plan", below=["position_error_m=5"], **wrong)
            assert next(iter(wrong)) in window.until("said")["text"]
        more = {"survive": 1, "budget_missions": 3, "placed": ["ring", "follow"]}
        window.do("begin", kind="plan", below=["position_error_m=5"], vary=["asvs.count=2"], **more)
        plans = list[Any]()
        while not plans:
            plans = [job for job in window.until("jobs")["jobs"] if job["kind"] == "plan"]
        job, number = plans[0], plans[0]["number"]
        for part in ("--survive 1", "--budget-missions 3", "model=ring,follow", "scenario.yaml"):
            assert part in job["command"]
        window.do("stop", job=number)
        assert "Traceback" not in window.job(number, "stopped", "failed", "complete")["told"]


def test_a_recorded_log_is_replayed_and_fitted(server: Server, survey: Path) -> None:
    """Its tables are dropped together; the noise that was fitted to them can be the scenario's."""
    origin = {"Origin": f"http://{server.host}"}
    rows = [(k, 1.5 * k, 20.0 + 2.0 * (k % 3), 0.0) for k in range(60)]
    tables = {
        "odometry": ("time_s,x_m,y_m,yaw_rad", rows),
        "fixes": (
            "time_s,x_m,y_m,sd_x_m,sd_y_m",
            [(k, x + 0.3 * (k % 2), y, 0.5, 0.5) for k, x, y, _ in rows],
        ),
    }
    for name, (head, values) in tables.items():
        raw = "\n".join([head, *(",".join(map(str, row)) for row in values)]).encode()
        assert server.ask(f"drop?name={name}.csv&log=dive", "POST", raw, **origin)[0] == 200
    with server.window() as window:
        number = len(window.until("jobs")["jobs"]) + 1
        window.do("begin", kind="replay", log="../dive")
        assert window.job(number, "failed", "complete")["status"] == "failed"
        window.do("begin", kind="replay", log="dive")
        found = window.job(number + 1, "failed", "complete")
        assert found["status"] == "complete", found["told"]
        assert "60" in found["said"]
        assert server.ask(f"pages/{number + 1}/picture")[1].startswith(b"\x89PNG")
        window.do("begin", kind="fit", of=number + 1)
        found = window.job(number + 2, "failed", "complete")
        assert found["status"] == "complete", found["told"]
        assert window.change("noise", job=number + 2)["mistakes"] == []
        assert load_scenario(survey).navigation.random_walk_m_per_sqrt_s > 0
        window.change("step", by=-1)


def test_another_program_is_not_stopped(tmp_path: Path) -> None:
    """It is told at once that this plan is not the workbench's to stop; its answer is compared."""
    file = tmp_path / "cove.yaml"
    file.write_text(SURVEY)
    folder = tmp_path / "team"
    vary = {"asvs.formation": [{"positions_m": [[10, 0], [-10, 0]]}]}
    plan(file, folder, below={"position_error_m": 50}, vary=vary, workers=1, budget_missions=2)
    with started(folder, cwd=tmp_path) as server, server.window() as window:
        (job,) = window.until("jobs")["jobs"]
        with locked(folder / "missions"):
            window.do("stop", job=job["number"])
            assert "another program" in window.until("said")["text"]
        window.do("compare", jobs=[job["number"], job["number"]])
        told = window.until("compared")
        assert told["head"][:3] == ["plan", "ASVs", "price"]
        assert [row[1] for row in told["rows"]] == ["2", "2"]


@pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="needs Linux")
def test_a_full_disk_and_a_dead_worker_are_said(tmp_path: Path) -> None:
    """What cannot be written is told in a line, and is not there; what has died can go on."""
    file = tmp_path / "cove.yaml"
    file.write_text(SURVEY)
    with started(file) as server, server.window() as window:
        window.until("forecast")
        window.do("begin", kind="simulate", seeds=1000)
        window.job(1, "running")
        (process,) = (tmp_path / "workbench").glob("*/jobs/0001/process.txt")
        os.kill(int(process.read_text()), signal.SIGKILL)
        assert window.job(1, "stopped", "failed")["done"] < 1000
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (400_000, 400_000))
        window.do("text", text=f"{SURVEY}# {'x' * 500_000}")
        assert "large" in window.until("said")["text"]
        assert file.read_text() == SURVEY
        origin = {"Origin": f"http://{server.host}"}
        status, told, _ = server.ask("drop?name=a.kml", "POST", b"x" * 500_000, **origin)
        assert (status, b"a.kml: " in told) == (507, True)
        assert not (tmp_path / "a.kml").exists()
        assert window.change("vessels", stations=[[1, 2]])["mistakes"] == []


def test_missions_outlive_a_kill(tmp_path: Path) -> None:
    """A server that is killed and started again has scenario, history, and what was flown."""
    file = tmp_path / "cove.yaml"
    file.write_text(SURVEY)
    with started(file) as server, server.window() as window:
        window.change("vessels", stations=[[-20, 0], [20, 0]])
        window.do("begin", kind="simulate", seeds=3)
        found = window.job(1, "complete", "failed")
        assert found["status"] == "complete", found["told"]
        assert [row["seed"] for row in found["seeds_flown"]] != []
        errors = [row["worst_position_error_m"] for row in found["seeds_flown"]]
        assert errors == sorted(errors)
        assert len(errors) == 3
        status, page, heads = server.ask(f"pages/1/{found['seeds_flown'][0]['seed']}")
        assert (status, b"<h1>cove</h1>" in page) == (200, True)
        assert heads["content-security-policy"].startswith("sandbox ")
        window.do("begin", kind="simulate", seeds=1000)
        window.job(2, "running")
        server.process.send_signal(signal.SIGKILL)
        server.process.wait()
    text = file.read_text()
    assert "[[-20" in text
    with started(file) as server, server.window() as window:
        assert window.desk["text"] == text
        assert window.desk["undo"]
        jobs = {job["number"]: job for job in window.until("jobs")["jobs"]}
        assert jobs[1]["status"] == "complete"
        assert jobs[2]["status"] in ("running", "stopped", "failed")
        window.change("step", by=-1)
        assert window.desk["text"] == SURVEY
        if jobs[2]["status"] == "running":  # it outlived its server
            window.do("stop", job=2)
        stopped = window.job(2, "stopped", "failed") if jobs[2]["status"] == "running" else jobs[2]
        assert stopped["done"] < 1000


@pytest.mark.slow
def test_the_answer_of_a_plan_is_opened(tmp_path: Path) -> None:
    """Beside its folder, which stays as it was; its other teams are put on the chart as well."""
    file = tmp_path / "cove.yaml"
    file.write_text(SURVEY)
    folder = tmp_path / "team"
    moored = [{"positions_m": [[x, 0], [-x, 0]]} for x in (10, 25)]
    made = plan(file, folder, below={"position_error_m": 50}, vary={"asvs.formation": moored},
                workers=1)  # fmt: skip
    before = sorted(folder.rglob("*"))
    for _ in range(2):  # once again it is as one left it
        with started(folder, cwd=tmp_path) as server, server.window() as window:
            (job,) = window.until("jobs")["jobs"]
            assert job["answered"][0].startswith(made.record["told"][0][:12])
            first, other, *_ = (team["number"] for team in job["teams"])
            assert first == made.record["chosen"]
            window.change("take", job=job["number"], team=other)
            places = made.record["candidates"][other]["stations"]
            text = (tmp_path / "team-team.yaml").read_text()
            kept = load_scenario(tmp_path / "team-team.yaml").asvs.formation.positions_m
            assert [list(place) for place in kept] == places
            assert server.ask(f"pages/{job['number']}/plan")[0] == 200
            window.do("take", job=job["number"], team=99)
            assert "no team 99" in window.until("said")["text"]
            window.change("step", by=-1)
            assert made.scenario is not None
            assert load_scenario(tmp_path / "team-team.yaml").asvs == made.scenario.asvs
            window.change("step", by=1)
            assert (tmp_path / "team-team.yaml").read_text() == text
            window.change("step", by=-1)
    assert sorted(folder.rglob("*")) == before


def test_a_busy_port_is_said(server: Server, survey: Path) -> None:
    port = server.host.partition(":")[2]
    command = [sys.executable, "-m", "bindusbl_des", "workbench", str(survey), "--port", port]
    done = subprocess.run([*command, "--no-browser"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(f"port {port}: ")
    assert "Traceback" not in done.stderr


def test_a_folder_begins_with_a_scenario(tmp_path: Path) -> None:
    """What a stranger is given first is right, and warned of by nothing."""
    with started(tmp_path) as server, server.window() as window:
        look = window.until("look")
        assert (look["mistakes"], look["warnings"]) == ([], [])
        assert load_scenario(tmp_path / "scenario.yaml").name == look["chart"]["name"]
