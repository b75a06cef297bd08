"""Pages of strangers' folders: data stay data, and a browser runs the package's scripts alone."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest
from browser_for_tests import Open, without_browser
from campaigns_for_tests import read_record, write_record
from commands_for_tests import call
from pages_for_tests import beside
from policy_for_tests import Parsed, assert_allows_its_own_alone
from test_report_sweep import BASE
from worlds import scenario

from bindusbl_des import Result, load_campaign, simulate, sweep
from bindusbl_des.apps.report.page import as_script, assembled
from bindusbl_des.support.mistakes import ScenarioWarning

pytestmark = pytest.mark.usefixtures("in_this_process")

ATTACK = "</code></script><script>window.owned = 1</script><img src=x onerror='window.owned = 2'>"
TERMINAL = "\x1b]0;owned\x07\x1b[31m\r\x9b31m\u202e\x7f"
OBEYED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u200b-\u200f\u202a-\u202e\u2066-\u2069]")


@pytest.fixture(scope="module")
def result() -> Result:
    """A mission with a name and warnings that would be scripts."""
    found = simulate(scenario(name=ATTACK, duration_s=5.0), 1)
    made = found.scenario, found.seed, found.arrow, found.wall_time_s
    return Result(*made, [ScenarioWarning(ATTACK, ATTACK)], violations=found.violations)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign's folder whose record holds scripts wherever it may hold a text."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "base.yaml").write_text(BASE)
    sweep(folder / "base.yaml", folder / "out", vary={"asvs.count": [1, 2]}, seeds=2, workers=1)
    record = read_record(folder / "out")
    record["name"] = ATTACK
    record["versions"] = {ATTACK: ATTACK}
    record["scenario"]["name"] = ATTACK
    write_record(folder / "out", record)
    (folder / "out" / "failures").mkdir(exist_ok=True)
    failure = {"mission": 0, "varied": {ATTACK: ATTACK}, "seed": ATTACK, "error": ATTACK}
    text = json.dumps({**failure, "reproduce": ATTACK})
    (folder / "out" / "failures" / "0.json").write_text(text)
    return folder / "out"


def pages(result: Result, campaign: Path) -> dict[str, str]:
    """Return each kind of page."""
    bare = scenario(name=ATTACK, duration_s=5.0, record={"detail": "summary"})
    return {
        "run": result.report(),
        "summary": simulate(bare).report(),
        "comparison": beside((ATTACK, result), (ATTACK, result)),
        "sweep": load_campaign(campaign).report(),
    }


@pytest.mark.parametrize("kind", ["run", "summary", "comparison", "sweep"])
def test_a_page_allows_its_own_scripts_alone(result: Result, campaign: Path, kind: str) -> None:
    """The policy names each script and style by its hash; nothing of the data became an element."""
    assert_allows_its_own_alone(Parsed(pages(result, campaign)[kind]))


def test_data_cannot_end_their_script() -> None:
    """What HTML or an old browser would read in JSON is escaped, and comes back as it was."""
    data = {"a": "</script><!--&\u2028\u2029"}
    assert not re.search("[<>&\u2028\u2029]", as_script(data))
    assert json.loads(as_script(data)) == data


@without_browser
@pytest.mark.parametrize("kind", ["run", "summary", "comparison", "sweep"])
def test_attacks_do_not_run(
    opened: Open,
    result: Result,
    campaign: Path,
    tmp_path: Path,
    kind: str,
) -> None:
    """In a browser the page works under its policy, without a complaint, and shows the attack."""
    (tmp_path / "page.html").write_text(pages(result, campaign)[kind], encoding="utf-8")
    it = opened(tmp_path / "page.html")
    assert it.ask("window.owned") is None
    assert "window.owned = 1" in it.ask("document.body.innerText")
    assert it.ask("getComputedStyle(document.getElementById('theme')).cursor") == "pointer"


@without_browser
def test_the_policy_holds_where_escaping_fails(browser: Any, tmp_path: Path) -> None:
    """A script, a handler or an address that got into the body is refused by the browser."""
    links = (
        "<a id='link' href='javascript:window.owned = 3'>x</a><style>body { color: red }</style>"
    )
    page = assembled("x", ATTACK + links, (), {}, "")
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    tab, complaints = browser.new_page(), []
    tab.on("console", lambda message: complaints.append(message.text))
    tab.goto((tmp_path / "page.html").as_uri())
    tab.click("#link")
    tab.wait_for_timeout(100)
    assert tab.evaluate("window.owned") is None
    assert tab.evaluate("getComputedStyle(document.body).color") != "rgb(255, 0, 0)"
    assert len([said for said in complaints if "Content Security Policy" in said]) >= 4
    tab.close()


def test_a_terminal_obeys_no_file(campaign: Path, tmp_path: Path) -> None:
    """Escape sequences, bells, returns, C1 and changes of direction are shown, not obeyed."""
    broken = shutil.copytree(campaign, tmp_path / "c")
    record = read_record(broken)
    record["name"] += TERMINAL  # which no program wrote, and so is refused
    write_record(broken, record)
    (tmp_path / "x.yaml").write_text('name: x\n"owned\\e[31m\\a\\u009b\\u202e": 1\n')
    for words in (
        ("status", str(campaign)), ("status", str(campaign), "--json"), ("status", str(broken)),
        ("report", str(broken)), ("validate", str(tmp_path / "x.yaml")),
    ):  # fmt: skip
        done = call(*words)
        assert ("owned" in done.output) == (str(broken) not in words), words
        assert not OBEYED.search(done.stdout + done.stderr), words
    shown = call("status", campaign, "--json").stdout
    assert json.loads(shown)["name"] == ATTACK


@pytest.mark.parametrize("key", ["plan_sha256", "scenario_sha256"])
def test_what_cannot_be_a_fingerprint_is_refused(campaign: Path, tmp_path: Path, key: str) -> None:
    """Scripts in the place of hashes reach no page."""
    folder = shutil.copytree(campaign, tmp_path / "c")
    write_record(folder, {**read_record(folder), key: ATTACK + TERMINAL})
    done = call("report", folder)
    assert done.exit_code == 2
    assert key in done.stderr
    assert not OBEYED.search(done.output)


def test_a_damaged_failure_is_told(campaign: Path, tmp_path: Path) -> None:
    """The file of a failed mission that is damaged is named, with what to do."""
    folder = shutil.copytree(campaign, tmp_path / "c")
    for text in ("[]", "null", "[" * 10_000, '{"mission": "0"}', ""):
        (folder / "failures" / "0.json").write_text(text)
        done = call("report", folder)
        assert done.exit_code == 2
        assert "0.json is damaged" in done.stderr
        assert "resume" in done.stderr
