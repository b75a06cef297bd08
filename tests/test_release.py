"""What is published agrees: wheel, sdist, conda recipe, image, and what they say of themselves."""

import importlib.util
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = SETTINGS["project"]
NAME = re.compile(r"[A-Za-z0-9-]+")
# Packages that conda-forge names otherwise
CONDA = {"PyYAML": "pyyaml", "matplotlib": "matplotlib-base"}
# What a published project says of itself
URLS = {"Homepage", "Documentation", "Source", "Issues", "Changelog"}
# What is under the GPL, and the extras that bring it: the user's, and those of the checks
GPL, ASKED = {"pelagic", "ns3"}, {"bellhop", "peers", "test", "dev"}


def test_the_recipe_has_what_the_package_needs() -> None:
    """Version, Python, packages with their bounds, builder, entry point and licence."""
    recipe = yaml.safe_load((ROOT / "scripts" / "recipe.yaml").read_text())
    assert recipe["context"]["version"] == PROJECT["version"]
    assert f">={recipe['context']['python_min']}" == PROJECT["requires-python"]
    assert recipe["package"]["name"] == PROJECT["name"]
    needed = [
        re.sub("^[^>]+", lambda it: CONDA.get(it[0], it[0]) + " ", it)
        for it in PROJECT["dependencies"]
    ]
    assert recipe["requirements"]["run"] == ["python >=${{ python_min }}", *needed]
    (builder,) = SETTINGS["build-system"]["requires"]
    assert builder.replace(">", " >") in recipe["requirements"]["host"]
    ((script, function),) = PROJECT["scripts"].items()
    assert recipe["build"]["python"]["entry_points"] == [f"{script} = {function}"]
    assert recipe["about"]["summary"] == PROJECT["description"]


def test_the_image_has_what_the_package_is_built_of() -> None:
    """Each file copied is there, none that the wheel needs is missing; its commands are ours."""
    text = (ROOT / "scripts" / "Dockerfile").read_text()
    copied = {
        it for line in re.findall("^COPY (.*)$", text, re.MULTILINE) for it in line.split()[:-1]
    }
    assert all((ROOT / path).exists() for path in copied)
    wheel = SETTINGS["tool"]["hatch"]["build"]["targets"]["wheel"]
    needed = [*wheel["packages"], *wheel["force-include"], PROJECT["readme"], "pyproject.toml"]
    assert {path.partition("/")[0] for path in needed} | {PROJECT["license"]["file"]} <= copied
    (run,) = re.findall("^RUN (.*)$", text, re.MULTILINE)
    index = (ROOT / "docs" / "index.md").read_text()
    for command in run.replace(" --no-cache-dir", "").split(" && "):
        assert f"\n{command}\n" in index
    (base,) = re.findall(r"^FROM python:(3\.\d+)-slim$", text, re.MULTILINE)
    assert base in pythons()


def pythons() -> list[str]:
    """Return the versions of Python that the package says it is for."""
    said = (re.search(r"Python :: (3\.\d+)$", it) for it in PROJECT["classifiers"])
    return [it[1] for it in said if it]


def test_each_python_is_named() -> None:
    """From the first that can install it, without gaps."""
    first = int(PROJECT["requires-python"].removeprefix(">=3."))
    assert pythons() == [f"3.{first + k}" for k in range(len(pythons()))]


def test_nothing_under_the_gpl_comes_unasked() -> None:
    """Who installs the package, or another extra, may use it under any licence."""
    extras = PROJECT["optional-dependencies"]
    brought = {name: {NAME.match(it)[0] for it in packages} for name, packages in extras.items()}  # type: ignore[index]
    assert {NAME.match(it)[0] for it in PROJECT["dependencies"]} & GPL == set()  # type: ignore[index]
    assert {name for name, packages in brought.items() if packages & GPL} <= ASKED
    for name in set(extras) - ASKED:
        assert not any(
            f"[{it}" in line or f",{it}" in line for line in extras[name] for it in ASKED
        )


def test_what_is_not_yet_published_is_on_the_checklist() -> None:
    """An address is in the package, or in the lines to add; none is invented."""
    checklist = (ROOT / "CONTRIBUTING.md").read_text().partition("\n## Releases\n")[2]
    to_add = re.findall(r'^(\w+) = "https://HOST/', checklist, re.MULTILINE)
    assert set(to_add) == URLS - set(PROJECT["urls"])
    assert not any("HOST" in url for url in PROJECT["urls"].values())


@pytest.mark.skipif(
    importlib.util.find_spec("hatchling") is None, reason="the builder of wheels is not installed"
)
def test_the_sdist_makes_the_wheel_of_the_checkout(tmp_path: Path) -> None:
    """File for file, so that a distribution can build from it; and it holds the tests."""
    build = [sys.executable, "-m", "hatchling", "build", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    (sdist,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        if hasattr(tarfile, "data_filter"):  # not in Python 3.11.0 to 3.11.3; later ones ask for it
            archive.extraction_filter = tarfile.data_filter
        archive.extractall(tmp_path)
    source = tmp_path / sdist.name.removesuffix(".tar.gz")
    assert (source / "tests" / Path(__file__).name).is_file()
    again = [*build[:-1], str(tmp_path / "again"), "-t", "wheel"]
    subprocess.run(again, cwd=source, check=True, capture_output=True)
    with zipfile.ZipFile(wheel) as one, zipfile.ZipFile(tmp_path / "again" / wheel.name) as other:
        contents = [{it.filename: it.CRC for it in file.infolist()} for file in (one, other)]
    assert contents[0] == contents[1]
    assert f"bindusbl_des-{PROJECT['version']}.dist-info/entry_points.txt" in contents[0]
    for room in ("report", "workbench"):  # pages, their scripts, and the licences of libraries
        assets = f"bindusbl_des/apps/{room}/assets"
        kept = {f"{assets}/{path.name}" for path in (ROOT / assets).iterdir()}
        assert kept
        assert kept <= contents[0].keys()
