"""The documentation is executed: commands, snippets, scenario files, citation."""

import contextlib
import importlib
import importlib.util
import io
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from pydoc import locate
from typing import get_args

import matplotlib.pyplot as plt
import pytest
import yaml
from campaigns_for_tests import OneThread
from click.testing import CliRunner

import bindusbl_des
from bindusbl_des import Scenario, load_scenario, simulate
from bindusbl_des.apps.campaigns import running
from bindusbl_des.apps.campaigns.statistics.differences import Verdict as PairedVerdict
from bindusbl_des.apps.campaigns.statistics.points_table import METRICS
from bindusbl_des.apps.planning import flying
from bindusbl_des.apps.planning.selecting import Verdict as PlanVerdict
from bindusbl_des.cli import main
from bindusbl_des.core.records.events import OUTCOMES
from bindusbl_des.core.results.schemas import data_dictionary
from bindusbl_des.core.results.summary import COLUMNS
from bindusbl_des.core.scenario.families import FAMILIES
from bindusbl_des.core.scenario.keys import keys

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs"))  # programs
python_page = importlib.import_module("make_python").python_page
reference = importlib.import_module("make_reference").reference
MANUAL = (
    "index.md", "tutorial.md", "tutorial_real_plan.md", "python.md", "model.md", "navigation.md",
    "replay.md", "live.md", "modems.md", "instruments.md", "acoustics.md", "surveys.md",
    "planning.md", "protocols.md", "tutorial_island.md",
    "vehicles.md", "frames.md", "extending.md", "clusters.md", "validation.md", "citing.md",
)  # fmt: skip
PICTURES = (".png", ".svg", ".webp")
# Language, the file that it is if it has a title, and content
FENCED = r'^```(\w+)(?: title="([\w.]+)")?\n(.*?)^```'
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.py"))
# What the longest do, the README, the manual's tutorial on a real plan and shorter pages and
# notebooks do every day.
EACH_PAGE, EACH_NOTEBOOK = (
    [
        pytest.param(it, marks=[pytest.mark.slow] if any(map(str(it).count, longest)) else [])
        for it in all_of
    ]
    for longest, all_of in (
        (("planning.md", "index.md", "protocols.md"), MANUAL),
        (("real_plan", "four_macs"), NOTEBOOKS),
    )
)
SCENARIOS = sorted((ROOT / "scenarios").glob("*.yaml"))
# Advice takes seconds, and no page's is compared.
SHORTLY_ADVISED = ("--advice-missions", "8")


def blocks(name: str, language: str) -> list[str]:
    """Return the fenced blocks of one language in a document."""
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / name).read_text(), flags=re.DOTALL)


def test_readme_commands_print_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each `bindusbl-des` command of the README runs, and its printed output is the one shown."""
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    monkeypatch.chdir(tmp_path)
    shown = blocks("README.md", "text")
    commands = [
        line
        for block in blocks("README.md", "console")
        for line in block.splitlines()
        if line.startswith("bindusbl-des")
    ]
    assert len(commands) == len(shown) == 3
    for command, expected in zip(commands, shown, strict=True):
        printed = typed(command)
        for part in expected.split("\n...\n"):
            assert part.strip() in printed, part


def test_the_cheat_sheet_names_what_ships() -> None:
    """Each part, command and scenario: what everybody looks up is the first to go stale."""
    page = (ROOT / "docs" / "cheatsheet.md").read_text()
    rows = dict(re.findall(r"^\| (`[^|]+`) \| (.+) \|$", page, re.MULTILINE))
    for family in FAMILIES:
        (shipped,) = [row for key, row in rows.items() if f"`{family.key}`" in key]
        assert set(family.siblings) <= set(re.findall(r"`(\w+)`", shipped)), family.key
    named = re.findall(r"`(?:bindusbl-des )?([a-z]+)[ `]", page)
    assert set(main.commands) <= set(named)
    assert {path.stem for path in SCENARIOS} <= set(re.findall(r"`(\w+)`", page))


def test_the_glossary_has_every_word_of_a_table() -> None:
    """Columns and metrics, what became of a signal, verdicts and headings of printed tables."""
    page = (ROOT / "docs" / "glossary.md").read_text()
    explained = set(re.findall(r"`([^`]+)`", page))
    columns = {column for table in data_dictionary().values() for column in table}
    worst = {it for it in columns if it.startswith("worst_")}
    assert {it.removeprefix("worst_").removesuffix("_auv") for it in worst} <= columns
    verdicts = {*get_args(PlanVerdict), *get_args(PairedVerdict)}
    verdicts |= {"accepted", "refused", "undecided"}
    assert ((columns - worst) | verdicts | set(OUTCOMES)) - explained == set()
    headings = {heading for heading, *_ in COLUMNS} | {heading for _, heading, *_ in METRICS}
    entries = re.findall(r"^\| ([^`|]+) \|", page, re.MULTILINE)
    assert headings - set(", ".join(entries).split(", ")) == set()


@pytest.mark.parametrize(
    ("word", "page"),
    [
        ("fairness", "glossary.md"),
        ("NMEA", "live.md"),
        ("ROS 2", "live.md"),
        ("ArduSub", "live.md"),
        ("DVL", "instruments.md"),
        ("INS", "instruments.md"),
        ("KML", "surveys.md"),
        ("SLURM", "clusters.md"),
        *(
            (word, "glossary.md")
            for word in ("battery", "EKF", "LBL", "multipath", "RTK", "Windows")
        ),
    ],
)
def test_a_search_finds_the_page(word: str, page: str) -> None:
    """What people look for by the field's word stands on the page that answers."""
    assert re.search(rf"\b{word}\b", (ROOT / "docs" / page).read_text())


def test_readme_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The Python of the README runs as it stands."""
    monkeypatch.chdir(tmp_path)
    (block,) = blocks("README.md", "python")
    assert "worst" in shown_by(block, {})


@pytest.mark.parametrize("page", EACH_PAGE)
def test_manual_does_what_it_says(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A page is followed from top to bottom: files, commands and Python, and what they print."""
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    printed, names = "", {"__name__": "page"}
    text = (ROOT / "docs" / page).read_text()
    for language, file, block in re.findall(FENCED, text, re.DOTALL | re.MULTILINE):
        if file:
            Path(file).write_text(block)
        elif language == "console":
            printed = "".join(typed(line) for line in block.splitlines())
        elif language == "python":
            printed = shown_by(block, names)
        elif language == "yaml":
            kept(block)
        elif language == "text":
            for part in block.split("\n...\n"):
                assert part.strip() in printed, f"{page} has:\n{part}\nbut printed is:\n{printed}"


@contextlib.contextmanager
def workers_if_asked(text: str) -> Iterator[None]:
    """Have campaigns run in this process unless their text speaks of workers: these take longer to
    start than the manual's missions take to fly.
    """
    with pytest.MonkeyPatch.context() as patch:
        if "workers" not in text:
            patch.setattr(running, "pool_for", OneThread)
            patch.setattr(flying, "pool_for", OneThread)
        yield


def typed(line: str) -> str:
    """Return what a command line of a page prints; what is not ours is not run."""
    command = shlex.split(line, comments=True)
    if command[:1] != ["bindusbl-des"]:
        return ""
    if "--advice" in command:
        command += SHORTLY_ADVISED
    with workers_if_asked(line):
        outcome = CliRunner().invoke(main, command[1:])
    expected = re.search(r"# exits with (\d)", line)
    assert outcome.exit_code == int(expected[1] if expected else 0), f"{line}: {outcome.output}"
    return outcome.stdout


def shown_by(block: str, names: dict[str, object]) -> str:
    """Return what Python of a page prints; a block that names a file becomes that file."""
    if named := re.match(r"# (\w+\.py)\n", block):
        Path(named[1]).write_text(block)
    with workers_if_asked(block), contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(block, names)
    return printed.getvalue()


def kept(block: str) -> None:
    """Write YAML that names its file; other YAML is part of a scenario, and valid."""
    if named := re.match(r"# (\w+\.yaml)\n", block):
        Path(named[1]).write_text(block)
    else:
        Scenario.model_validate({"name": "part"} | yaml.safe_load(block))


@pytest.mark.parametrize("path", EACH_NOTEBOOK, ids=lambda path: path.stem)
def test_notebooks_find_what_they_state(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each runs from top to bottom, and what it says in words it asserts of its numbers."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("matplotlib.pyplot.show", lambda: None)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.ExitStack() as after:
        after.callback(plt.close, "all")
        runpy.run_path(str(path))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_ask_and_answer(path: Path) -> None:
    """Each is short, answers each of its questions, and imports public names alone."""
    text = path.read_text()
    assert 60 <= text.count("\n") <= 130
    assert text.startswith("# %% [markdown]\n# # ")
    questions = re.split(r"^# ## .*\?$", text, flags=re.MULTILINE)[1:]
    assert len(questions) >= 3
    for answered in questions:
        assert re.search(r"^# (.* )?\*\*", answered, re.MULTILINE), answered
        assert re.search(r"^assert ", answered, re.MULTILINE), answered
    assert not re.search(r"(from|import) bindusbl_des\.", text)
    assert f"(notebooks/{path.name})" in (ROOT / "docs" / "index.md").read_text()


def test_a_part_of_ones_own_is_a_file_of_fifty_lines() -> None:
    """Each family has one in the manual, and none is patched into the program."""
    text = (ROOT / "docs" / "extending.md").read_text()
    files = re.findall(r"```python\n# (\w+\.py)\n(.*?)```", text, flags=re.DOTALL)
    assert {name for name, body in files if body.count("\n") > 50} == set()
    assert "patch" not in text
    for family in [it for it in FAMILIES if it.is_open]:
        assert f"`{family.key}" in text, family.key


def test_extending_names_the_commands_that_load_plugins() -> None:
    """All that have the option are named where permission is described, and no other."""
    text = (ROOT / "docs" / "extending.md").read_text()
    told = re.search(
        r"^\* `--allow-plugins` of (.*?), for the files", text, re.MULTILINE | re.DOTALL
    )
    assert told is not None
    offering = {
        name
        for name, command in main.commands.items()
        if any("--allow-plugins" in option.opts for option in command.params)
    }
    assert set(re.findall(r"`(\w+)`", told[1])) == offering


def test_every_page_has_its_place_in_the_site() -> None:
    """The navigation names each page of the manual once, and no page that is gone."""
    site = yaml.safe_load((ROOT / "mkdocs.yml").read_text())
    pages = [page for entry in site["nav"] for page in leaves(entry)]
    assert sorted(pages) == sorted(path.name for path in (ROOT / "docs").glob("*.md"))


def leaves(entry: object) -> list[str]:
    """Return the pages in an entry of the navigation."""
    if isinstance(entry, str):
        return [entry]
    inner = entry.values() if isinstance(entry, dict) else entry
    return [page for part in inner for page in leaves(part)]


def test_the_reference_is_that_of_this_program() -> None:
    """Commands, keys and tables are told as they are; the remedy stands at the head of the page."""
    stale = "python docs/make_reference.py > docs/reference.md"
    assert (ROOT / "docs" / "reference.md").read_text() == reference(), stale


def test_the_page_on_python_is_that_of_this_program() -> None:
    """Each public name has its heading and tells what it does, in plain Markdown."""
    page = (ROOT / "docs" / "python.md").read_text()
    assert page == python_page(), "python docs/make_python.py > docs/python.md"
    for name in bindusbl_des.__all__:
        part = page.partition(f"### {name}\n")[2].partition("\n### ")[0]
        assert re.search(r"^[A-Z][^|\n]+\.$", part, re.MULTILINE), name
    prose = re.sub(r"^```.*?^```", "", page, flags=re.DOTALL | re.MULTILINE)
    assert not re.search(r":\w+:`|``|^ ", prose, re.MULTILINE)
    equations = re.findall(r"^### (\w+)", page.partition("\n## Equations\n")[2], re.MULTILINE)
    assert [name for name in equations if name[0].isupper()] == []


def test_the_code_that_the_model_names_exists() -> None:
    """Each `module.name` on the page of the model is one, or a key of the scenario."""
    text = (ROOT / "docs" / "model.md").read_text()
    named = set(re.findall(r"`([a-z_.]+)\.([A-Za-z_]+)`", text))
    named -= {tuple(row.key.rsplit(".", 1)) for row in keys() if row.section}
    assert len(named) > 25
    for module, name in named:
        assert locate(f"bindusbl_des.{module}.{name}"), (module, name)


@pytest.mark.parametrize(
    ("page", "keys"),
    [
        ("protocols.md", ("schedule", "downlink", "broadcaster", "ranging")),
        ("channels.md", ("acoustics.hf.channel", "acoustics.mf.channel")),
        ("instruments.md", ("usbl.model",)),
        ("navigation.md", ("navigation.filter",)),
        ("vehicles.md", ("auvs.vehicle", "asvs.vehicle")),
        ("surveys.md", ("auvs.route",)),
        ("planning.md", ("asvs.formation",)),
    ],
)
def test_pages_tell_of_what_ships(page: str, keys: tuple[str, ...]) -> None:
    """Each part is named on the page of its family."""
    text = (ROOT / "docs" / page).read_text()
    for family in FAMILIES:
        if family.key.endswith(keys):
            missing = [it for it in family.siblings if not re.search(rf"[` ]{it}[`,}}]", text)]
            assert missing == [], family.key


def test_files_that_pages_name_are_there() -> None:
    """A path in a page is one of the repository, of its tests or of the package."""
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]
    for page in pages:
        for path in re.findall(r"`(\w+/[\w/]+\.(?:py|yaml))`", page.read_text()):
            if "NAME" in path:
                continue
            at = (ROOT, ROOT / "tests", ROOT / "bindusbl_des")
            assert any((folder / path).is_file() for folder in at), f"{page.name}: {path}"


def test_commands_that_pages_name_are_there() -> None:
    """Each `bindusbl-des COMMAND --option` of a page is one, also where it is not run."""
    pages = [ROOT / "README.md", ROOT / "scripts" / "demo", *(ROOT / "docs").glob("*.md")]
    for page in [*pages, *SCENARIOS, *(ROOT / "experiments").rglob("*.yaml")]:
        for name, rest in re.findall(r"bindusbl-des ([a-z]+)([^`\n]*)", page.read_text()):
            assert name in main.commands, f"{page.name}: {name}"
            offered = {it for option in main.commands[name].params for it in option.opts}
            asked = set(re.findall(r"(?<= )--[a-z-]+", rest))
            assert asked <= offered | {"--help"}, f"{page.name}: {name} {asked - offered}"


def test_readme_first_commands_exist() -> None:
    """The two scripts of the README are there and executable; the demo asks what it asks."""
    lines = "\n".join(blocks("README.md", "console")).splitlines()
    scripts = [line for line in lines if line.startswith("./")]
    assert len(scripts) == 2
    assert all((ROOT / line).stat().st_mode & 0o111 for line in scripts)
    (asked,) = re.findall(r"--ping \d+", (ROOT / "scripts" / "demo").read_text())
    assert asked in (ROOT / "README.md").read_text()


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_scenarios_say_what_they_show_and_run(path: Path) -> None:
    """Each scenario opens with a comment on what to look at, bears its file's name, and runs."""
    text = path.read_text()
    assert text.startswith("# yaml-language-server: $schema=scenario.schema.json\n# ")
    assert "# Look at: " in text
    scenario = load_scenario(path)
    assert scenario.name == path.stem
    result = simulate(scenario)
    assert result.mission.rounds[0] > 50


def test_versions_agree() -> None:
    """The package, what it prints and keeps, its citation and its changelog bear one version."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    changes = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert changes[:2] == ["Unreleased", f"{citation['version']} ({citation['date-released']})"]
    assert citation["version"] == project["version"]
    assert typed("bindusbl-des --version") == f"bindusbl-des {project['version']}\n"
    kept_by_run = simulate(Scenario(name="short", duration_s=1.0)).run_record()["versions"]
    assert kept_by_run["bindusbl-des"] == project["version"]


def test_pictures_are_light_and_have_words() -> None:
    """Each is shown somewhere, has a text for those who do not see it, and loads quickly."""
    shown = set()
    for document in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        for text, target in re.findall(r"!\[([^]]*)\]\(([^)]+)\)", document.read_text()):
            assert len(text) > 5, f"{document.name}: {target}"
            shown.add((document.parent / target).resolve())
    pictures = {path for path in (ROOT / "docs" / "figures").iterdir() if path.suffix in PICTURES}
    assert pictures <= shown
    assert all(path.stat().st_size < 250_000 for path in pictures)


def test_links_lead_somewhere() -> None:
    """Relative links in the documents lead to files that exist."""
    for document in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]:
        for target, place in re.findall(r"\]\(([^)#]*)(#[^)]*)?\)", document.read_text()):
            if not target.startswith("http"):
                page = document.parent / target if target else document
                assert page.exists(), f"{document.name}: {target}"
                assert not place or place[1:] in places(page), f"{document.name}: {target}{place}"


def places(page: Path) -> set[str]:
    """Return what links into a page can name: its headings, as browsers know them."""
    headings = re.findall(r"^#+ (.*)", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_no_warning_on_import() -> None:
    """Importing the package warns of nothing."""
    subprocess.run(
        [sys.executable, "-W", "error", "-c", "import bindusbl_des; bindusbl_des.simulate"],
        check=True,
    )


def test_public_names_are_what_they_say() -> None:
    """Each stands sorted, is defined where the table says, and bears no name of a package."""
    names = bindusbl_des.__all__
    assert names == sorted(bindusbl_des._HOMES)
    for name in names:
        found = getattr(bindusbl_des, name)
        home = f"bindusbl_des.{bindusbl_des._HOMES[name]}"
        assert (found.__module__, found.__name__) == (home, name)
        assert importlib.util.find_spec(f"bindusbl_des.{name}") is None, name


def test_equations_are_importable_by_their_own_names() -> None:
    """What the package offers is what its name says, also after everything has been loaded."""
    code = (
        "import bindusbl_des as b; b.simulate(b.Scenario(name='x', duration_s=1.0));"
        "b.covering_radius(60, b.formation(2, 50.0));"
        "assert all(callable(getattr(b, name)) for name in b.__all__), b.__all__"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
