"""Wrong scenario files are told apart, all their mistakes at once; right ones are read as meant."""

import json
import pickle
from pathlib import Path

import pytest
from commands_for_tests import call
from worlds import parse_scenario
from wrong_scenarios import HEAD, ROUTE, WRONG, text_of

from bindusbl_des import Scenario, ScenarioError, load_scenario
from bindusbl_des.support.mistakes import Mistake
from bindusbl_des.support.plain_yaml import read_yaml, scalar


@pytest.mark.parametrize("case", WRONG)
def test_wrong_file_gets_exactly_its_messages(case: str) -> None:
    """Every mistake has one line with its place, key, value and remedy, and nothing follows."""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text_of(case), "f.yaml")
    assert str(caught.value).splitlines() == [f"f.yaml:{line}" for line in WRONG[case][1]]


@pytest.mark.parametrize("command", ["validate", "run", "timing", "coverage"])
@pytest.mark.parametrize("case", WRONG)
def test_wrong_file_ends_a_command_with_2(
    case: str, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wrong file ends every command with its messages, exit code 2 and nothing left behind."""
    monkeypatch.chdir(tmp_path)
    Path("f.yaml").write_text(text_of(case), encoding="utf-8")
    result = call(command, "f.yaml")
    assert result.exit_code == 2
    assert [line for line in result.output.splitlines() if line.startswith("f.yaml")] == [
        f"f.yaml:{line}" for line in WRONG[case][1]
    ]
    assert "Traceback" not in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["f.yaml"]


def test_all_mistakes_are_told_at_once_in_the_order_of_the_file() -> None:
    """Typing, range, spelling and contradictions come in one go, by line, without follow-ups."""
    text = """\
nam: m
duration_s: 12:30
survey: {side: 10, depth_m: -3}
auvs:
  count: "3"
  route: {kind: hold, positions_m: [[1, 2]]}
asvs: {count: 4, formation: {positions_m: [[0, 0]]}}
acoustics: {hf: {range_m: 0x10}, hf: {ping_s: 1}}
protocol: {ranging: echo}
usbl: [1]
"""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "f.yaml")
    assert [(mistake.line, mistake.key) for mistake in caught.value.mistakes] == [
        (1, "nam"),
        (2, "duration_s"),
        (3, "survey.side"),
        (3, "survey.depth_m"),
        (5, "auvs.count"),  # so the positions are not counted against the default of 3
        (7, "asvs.formation.positions_m"),
        (8, "acoustics.hf.range_m"),
        (8, "acoustics.hf"),
        (9, "protocol.ranging"),
        (10, "usbl"),
    ]


def test_a_misspelt_key_is_no_missing_one_too() -> None:
    """Positions under a misspelt key are not blamed for being absent."""
    text = HEAD + ROUTE + "{kind: hold, position_m: [[0, 0], [1, 1]]}}\n"
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "f")
    assert [mistake.key for mistake in caught.value.mistakes] == ["auvs.route.position_m"]


def test_an_alias_bomb_costs_no_more_than_its_length() -> None:
    """Nested aliases, 10^9 items if they were followed, are only counted."""
    levels = "".join(f"l{n}: &l{n} [{', '.join([f'*l{n - 1}'] * 10)}]\n" for n in range(1, 10))
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(f"{HEAD}l0: &l0 [x]\n{levels}", "bomb")
    assert sum("alias" in mistake.message for mistake in caught.value.mistakes) == 90


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such file; `bindusbl-des init` writes a starter"),
        (b"name: \xff\n", "not UTF-8 text (byte 0xff at 6); save it as UTF-8"),
        (b"# " + b"x" * 1_000_000, "larger than 1,000,000 bytes; is this a scenario file?"),
    ],
)
def test_a_file_that_is_no_text_has_one_line(
    content: bytes | None, message: str, tmp_path: Path
) -> None:
    """A missing, binary or huge file is told as such."""
    path = tmp_path / "f.yaml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    assert str(caught.value) == f"{path}: {message}"


def test_a_folder_is_no_scenario(tmp_path: Path) -> None:
    """A folder in place of a file is told as such."""
    with pytest.raises(ScenarioError) as caught:
        load_scenario(tmp_path)
    assert str(caught.value) == f"{tmp_path}: is a folder; name a scenario file in it"


def test_the_smallest_file_is_the_default_scenario() -> None:
    """Only the name has no default."""
    assert parse_scenario("name: m") == Scenario(name="m")


def test_a_file_may_have_a_byte_order_mark_and_carriage_returns(tmp_path: Path) -> None:
    """Files from other systems are read alike."""
    path = tmp_path / "f.yaml"
    path.write_bytes(b"\xef\xbb\xbfname: m\r\nduration_s: 5\r\n")
    assert load_scenario(path) == Scenario(name="m", duration_s=5.0)


def test_values_are_read_as_in_yaml_1_2() -> None:
    """Numbers are decimal, the words true, false and null mean what they say, all else is text."""
    words = [
        "1e3",
        "-1.5",
        ".5",
        "5.",
        "+7",
        "off",
        "NO",
        "1:30",
        "0x1f",
        "007",
        "1_0",
        "True",
        "~",
    ]
    meant = [1000.0, -1.5, 0.5, 5.0, 7, "off", "NO", "1:30", "0x1f", "007", "1_0", True, None]
    assert [scalar(word) for word in words] == meant
    assert [type(scalar(word)) for word in words] == [type(value) for value in meant]


def test_text_stays_text() -> None:
    """The paper's `combine: off` is a word and no truth value; quotes make a number a text."""
    scenario = parse_scenario("name: '140'\nacoustics: {loss: {combine: off, law: none}}")
    assert (scenario.name, scenario.acoustics.loss.combine) == ("140", "off")


def test_places_count_from_one() -> None:
    """Lines and columns are those that editors show."""
    document = read_yaml("a:\n  b: [1, 2]\n", "f")
    assert (document.keys["a", "b"].line, document.keys["a", "b"].column) == (2, 3)
    assert (document.values["a", "b", 1].line, document.values["a", "b", 1].column) == (2, 10)


def test_options_override_the_file() -> None:
    """`--set` reaches sections, lists, items of lists and defaults that the file leaves out."""
    text = HEAD + "asvs: {count: 2, formation: {positions_m: [[0, 0], [9, 9]]}}\n"
    scenario = parse_scenario(
        text,
        overrides=[
            "name=n",
            "acoustics.hf.range_m=1e2",
            "asvs.formation.positions_m.1.0=5",
            "navigation.velocity_bias_m_per_s.1=0",
            "auvs.route={kind: hold, positions_m: [[1, 2]]}",
            "auvs.count=7",
            "auvs.count=1",
        ],
    )
    assert scenario.name == "n"
    assert scenario.acoustics.hf.range_m == 100.0
    assert scenario.asvs.formation.positions_m == ((0, 0), (5, 9))
    assert scenario.navigation.velocity_bias_m_per_s == (0.06, 0.0)
    assert scenario.auvs.count == 1


@pytest.mark.parametrize(
    ("section", "option"),
    [
        ("asvs: {formation: {radius_m: 30, angle_deg: 10}}", "asvs.formation.model=follow"),
        ("asvs: {formation: {model: zigzag, amplitude_m: 9}}", "asvs.formation.model=ring"),
        ("auvs: {route: {lane_spacing_m: 9}}", "auvs.route={kind: hold, positions_m: [[1, 2]]}"),
        ("auvs: {route: {kind: hold, positions_m: [[1, 2]]}}", "auvs.route.kind=lawnmower"),
        ("navigation: {filter: {model: kalman, untold: []}}", "navigation.filter.model=fixed_gain"),
    ],
)
def test_another_model_drops_the_settings_of_the_one_before(section: str, option: str) -> None:
    """An option that names a model alone works; what else an option gives is never dropped."""
    text = f"{HEAD}{section}\n"
    chosen = parse_scenario(text, overrides=["auvs.count=1", option])
    assert chosen == parse_scenario(HEAD, overrides=["auvs.count=1", option])
    with pytest.raises(ScenarioError, match=r"formation\.period_s: no key of a ring placement"):
        parse_scenario(HEAD, overrides=["asvs.formation.period_s=9", "asvs.formation.model=ring"])


def test_an_option_mends_the_file() -> None:
    """A wrong value that an option replaces is no mistake any more."""
    assert parse_scenario("name: m\nduration_s: on", overrides=["duration_s=5"]).duration_s == 5
    text = "name: m\nasvs: {count: 1, formation: {positions_m: [[0, 0]]}}"
    assert parse_scenario(text, overrides=["asvs.count=4", "asvs.formation={model: ring}"])


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("auvs.cout=3", "auvs.cout: unknown key; did you mean 'count'?"),
        ("hf.range_m=3", "hf: unknown key; it belongs under acoustics"),
        (
            "auvs.count=on",
            "auvs.count: needs a whole number (>= 1 and <= 100000); got the text 'on'",
        ),
        ("auvs.count", "needs the form dotted.key=value, such as acoustics.hf.range_m=100"),
        ("=5", "needs the form dotted.key=value, such as acoustics.hf.range_m=100"),
        ("a..b=5", "needs the form dotted.key=value, such as acoustics.hf.range_m=100"),
        ("name.b=5", "name.b: name has no keys; it is the text 'm'"),
        (
            "asvs.formation.positions_m.x=5",
            "asvs.formation.positions_m.x: asvs.formation.positions_m is a list; "
            "its items are numbered from 0",
        ),
        ("0=5", "0: the scenario is no list, so it has no item 0"),
        ("auvs.0=5", "auvs.0: auvs is no list, so it has no item 0"),
        (
            "navigation.velocity_bias_m_per_s.2=5",
            "navigation.velocity_bias_m_per_s.2: navigation.velocity_bias_m_per_s has no item 2; "
            "the items are 0 to 1",
        ),
        ("auvs.count=*x", "auvs.count: alias *x is not allowed; write the value out"),
        (
            "auvs.count=[1",
            "auvs.count: YAML syntax: [ or { is not closed, or a comma is missing",
        ),
        (
            "protocol.ranging=echo",
            "protocol.ranging: 'echo' is no ranging (one of owtt_sync, twtt, passive, or your own "
            "as module:object)",
        ),
        (
            "asvs.count=4",
            "asvs.formation.positions_m: needs one [x, y] per ASV: 4 expected, 1 given; or have "
            "them placed by `asvs.formation: {model: ring}` (--set 'asvs.formation={model: ring}')",
        ),
    ],
)
def test_a_wrong_option_is_its_own_place(option: str, message: str) -> None:
    """Mistakes in `--set` options are told like those in files, with the option as the place."""
    text = HEAD + "auvs: {speed_m_per_s: 1}\nasvs: {count: 1, formation: {positions_m: [[0, 0]]}}\n"
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "f.yaml", overrides=[option])
    (mistake,) = caught.value.mistakes
    place = "f.yaml:3:43" if option == "asvs.count=4" else f"--set {option}"
    assert str(mistake) == f"{place}: {message}"


def test_file_mistakes_come_before_those_of_options() -> None:
    """First the file by line, then the options in their order."""
    with pytest.raises(ScenarioError) as caught:
        parse_scenario("nmae: x\nauvs: {count: 0}", "f", overrides=["b=1", "duration_s=0", "a=1"])
    keys = [mistake.key for mistake in caught.value.mistakes]
    assert keys == ["nmae", "auvs.count", "b", "duration_s", "a"]


def test_tracks_are_sought_beside_the_scenario(tmp_path: Path) -> None:
    """Track files become absolute, wherever the program runs."""
    (tmp_path / "a.csv").write_text("time_s,x_m,y_m,depth_m\n0,0,0,1\n1,1,0,1\n")
    path = tmp_path / "f.yaml"
    path.write_text("name: m\nauvs: {count: 1, route: {kind: track, files: [a.csv]}}\n")
    route = load_scenario(path).auvs.route
    assert route.kind == "track"
    assert route.files == (str((tmp_path / "a.csv").resolve()),)


def test_wrong_tracks_are_told_with_their_place(tmp_path: Path) -> None:
    """A missing and a broken track are mistakes of the scenario, beside their number."""
    (tmp_path / "b.csv").write_text("time,x\n")
    path, missing = tmp_path / "f.yaml", (tmp_path / "a.csv").resolve()
    path.write_text("name: m\nauvs: {count: 3, route: {kind: track, files: [a.csv, b.csv]}}\n")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    lines = str(caught.value).splitlines()
    assert lines[0] == f"{path}:2:46: auvs.route.files: needs one file per AUV: 3 expected, 2 given"
    assert lines[1].startswith(f"{path}:2:47: auvs.route.files.0: no such file: {missing};")
    assert "column time_s, x_m, y_m, depth_m missing" in lines[2]


def test_the_error_travels_between_processes() -> None:
    """A sweep's worker can send the mistakes back."""
    error = ScenarioError([Mistake("f", 1, 2, "a.b", "is wrong")])
    back = pickle.loads(pickle.dumps(error))
    assert (back.mistakes, str(back)) == (error.mistakes, "f:1:2: a.b: is wrong")


def test_validate_tells_machines_the_same(tmp_path: Path) -> None:
    """The JSON of `validate` holds file, line, column, key and message."""
    path = tmp_path / "f.yaml"
    path.write_text("name: m\nduration_s: 0\n")
    result = call("-q", "validate", str(path), "--json")
    report = json.loads(result.stdout)
    assert report == {
        "valid": False,
        "files": {
            str(path): [
                {
                    "file": str(path),
                    "line": 2,
                    "column": 13,
                    "key": "duration_s",
                    "message": "must be >= 0.001 and <= 10000000 s; got 0",
                }
            ]
        },
        "warnings": {str(path): []},
    }
    assert (result.exit_code, result.stderr) == (2, "")
