"""Scenarios and experiments that ship are named without their files; shells complete them."""

import importlib.util
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from commands_for_tests import call

from bindusbl_des.support import shipped as shipping

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.usefixtures("in_empty_folder")


def test_all_that_ships_has_one_name() -> None:
    """The files of the top-level folders are those named; no name is of two kinds or a starter."""
    told = call("init", "xyz").stderr
    names = re.findall(r"there are ([^;]*);", told)[0].split(", ")
    assert names[:2] == ["starter", "paper"]
    for kind, those in re.findall(r"the (scenarios|experiments) ([^;\n]*)", told):
        assert those.split(", ") == sorted(it.stem for it in (ROOT / kind).glob("*.yaml"))
        names += those.split(", ")
    assert len(names) == len(set(names)) > 20


@pytest.mark.parametrize("name", sorted(it.stem for it in (ROOT / "experiments").glob("*.yaml")))
def test_what_ships_can_be_copied_and_is_right(name: str) -> None:
    """`init` copies an experiment that is valid where it then lies: it names a shipped scenario."""
    result = call("init", name, "--out", "mine.yaml")
    assert result.stderr == "Now try: bindusbl-des sweep mine.yaml\n"
    assert Path("mine.yaml").read_text() == (ROOT / "experiments" / f"{name}.yaml").read_text()
    checked = call("validate", "mine.yaml")
    assert (checked.exit_code, "mistake" in checked.stderr) == (0, False)


def test_a_shipped_scenario_is_read_and_copied() -> None:
    """Its name stands for its file, on every command that reads one."""
    assert call("init", "remus_1km").stdout == (ROOT / "scenarios/remus_1km.yaml").read_text()
    for name in ("timing", "coverage"):
        by_file = call(name, str(ROOT / "scenarios" / "quickstart.yaml"))
        assert call(name, "quickstart").stdout == by_file.stdout != ""
    ran = call("-q", "run", "quickstart", "--set", "duration_s=5", "--no-advice")
    assert ran.stdout.endswith("Results: results/quickstart-seed0\n")


def test_a_file_of_that_name_wins_and_a_folder_does_not() -> None:
    """What lies in the working folder is meant."""
    Path("quickstart").mkdir()
    for name in ("quickstart", "table_1"):
        assert call("validate", name).stdout == f"{name}: ok\n"
    Path("quickstart").rmdir()
    Path("quickstart").write_text("name: mine\nduration: 5\n")
    assert call("validate", "quickstart").stdout.startswith("quickstart:2:1: duration: unknown key")
    Path("recovery_140m").write_text("name: mine\nduration: 5\n")
    Path("e.yaml").write_text("scenario: recovery_140m\nvary: {auvs.count: [1, 2]}\n")
    assert call("validate", "e.yaml").stdout.startswith("recovery_140m:2:1: duration: unknown key")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ("run", "quikstart"),
            "ships; did you mean 'quickstart'? These do: the scenarios ahoi_100m",
        ),
        (("timing", "xyzzy"), "xyzzy: no such file, and nothing of that name ships; these do: the"),
        (("run", "table_1"), "is an experiment, of many missions; `bindusbl-des sweep table_1`"),
        (("run", "scenarios/quickstart.yaml"), "quickstart ships, so write `quickstart` alone"),
        (("sweep", "tabel_1"), "did you mean 'table_1'?"),
        (("sweep", "xyzzy"), "ugps_100m; the experiments ablations, baseline,"),
        (("init", "remus"), "no template 'remus'; did you mean 'remus_1km'? There are starter"),
        (("run", "other.yaml"), "other.yaml: no such file; `bindusbl-des init` writes a starter"),
    ],
)
def test_a_name_that_does_not_ship_is_told_with_those_that_do(
    words: tuple[str, ...], told: str
) -> None:
    result = call(*words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert told in result.stderr
    assert result.stderr.count("\n") == 1


def test_an_installed_package_brings_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the wheel the files lie in the package; what lies beside it is somebody else's."""
    package = tmp_path / "site" / "bindusbl_des"
    for folder, name in ((package, "ours"), (package.parent, "theirs")):
        (folder / "scenarios").mkdir(parents=True)
        (folder / "scenarios" / f"{name}.yaml").write_text(f"name: {name}\n")
    monkeypatch.setattr(shipping, "PACKAGE", package)
    shipping.shipped.cache_clear()
    try:
        assert "theirs: no such file" in call("validate", "theirs").stdout
        assert call("validate", "ours").stdout == "ours: ok\n"
    finally:
        shipping.shipped.cache_clear()


@pytest.mark.skipif(
    importlib.util.find_spec("hatchling") is None, reason="the builder of wheels is not installed"
)
def test_a_wheel_knows_what_ships(tmp_path: Path) -> None:
    """A wheel that was built and unpacked runs its scenarios by name, far from any checkout."""
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    with zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as wheel:
        wheel.extractall(tmp_path / "site")
    words = [sys.executable, "-m", "bindusbl_des.cli", "validate", "quickstart", "table_1"]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "quickstart: ok\ntable_1: ok\n")


def completed(line: str, shell: str = "bash") -> list[str]:
    """Return what a shell is offered for the last word of a line, and that nothing heavy loads."""
    words = line.split(" ")
    program = (
        "import sys\nfrom bindusbl_des.cli import main\n"
        "try: main(prog_name='bindusbl-des')\n"
        "finally: print(*{'numpy', 'pydantic', 'numba'} & set(sys.modules), file=sys.stderr)"
    )
    environment = {
        **os.environ,
        "_BINDUSBL_DES_COMPLETE": f"{shell}_complete",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(words) - 1),
    }
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr.strip()) == (0, "")
    return done.stdout.splitlines()


def test_shells_complete_what_ships() -> None:
    """Names that ship come with files that begin alike; files alone are left to the shell."""
    assert completed("bindusbl-des run two") == [
        "plain,two_asvs_140m_0deg",
        "plain,two_asvs_140m_30deg",
    ]
    Path("two_mine.yaml").write_text("")
    assert completed("bindusbl-des run two")[-1] == "plain,two_mine.yaml"
    assert completed("bindusbl-des -q run my") == ["file,my"]
    assert "plain,two_asvs" in completed("bindusbl-des sweep two")
    assert completed("bindusbl-des init st") == ["plain,starter", "plain,still"]
    assert completed("bindusbl-des --json init sta") == ["plain,starter"]
    assert completed("bindusbl-des cov") == ["plain,coverage"]
    assert "plain,--json" in completed("bindusbl-des coverage --")


def test_shells_complete_keys_and_metrics() -> None:
    """Of the schema, also those of what a section may be instead; and what is judged."""
    assert completed("bindusbl-des run quickstart --set asvs.c") == ["plain,asvs.count="]
    assert "plain,asvs.formation.amplitude_m=" in completed("bindusbl-des run x --set asvs.form")
    assert completed("bindusbl-des sweep x --vary auvs.route.lane_s") == [
        "plain,auvs.route.lane_spacing_m="
    ]
    assert "plain,position_error_p95_m=" in completed("bindusbl-des plan x --below posi")
    assert completed("bindusbl-des sweep x --until-ci worst_cross") == [
        "plain,worst_cross_track_error_m="
    ]
    for words in ("compare x --metric", "plot x curves --metric"):
        assert completed(f"bindusbl-des {words} worst_fix_ag") == [
            f"plain,worst_fix_age_{it}_s" for it in ("mean", "p95", "max")
        ]
    for words in ("params", "compare x --by", "plot x curves --x", "plot x heatmap --series"):
        assert completed(f"bindusbl-des {words} asvs.c") == ["plain,asvs.count"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_has_its_script(shell: str) -> None:
    """The mechanism of the manual prints what a shell reads once."""
    environment = {**os.environ, "_BINDUSBL_DES_COMPLETE": f"{shell}_source"}
    program = "from bindusbl_des.cli import main\nmain(prog_name='bindusbl-des')"
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )
    assert f"_BINDUSBL_DES_COMPLETE={shell}_complete" in done.stdout
