"""Folders that version 0.2 wrote, read by this one; once it is out they are kept as they are."""

import json
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from commands_for_tests import call

from bindusbl_des import load_campaign, load_result
from bindusbl_des.apps.campaigns.experiments.experiment import model_version
from bindusbl_des.core.results.schemas import SCHEMA_VERSION

WRITTEN = Path(__file__).parent / "reference" / "results_0_2"


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """Return a copy of the folders, which may be written to."""
    return Path(shutil.copytree(WRITTEN, tmp_path / "kept"))


def test_a_kept_run_is_read(kept: Path) -> None:
    run = kept / "run"
    result = load_result(run)
    assert result.seed == 3
    assert len(result.tables["fixes"]) == pq.read_metadata(run / "fixes.parquet").num_rows > 0
    assert "102 rounds" in result.summary()
    for words in (("explain", "--fix", "0"), ("report",)):
        told = call(*words, str(run))
        assert told.exit_code == 0, (words, told.output)
    assert (run / "report.html").stat().st_size > 10_000


def test_a_kept_campaign_is_read(kept: Path) -> None:
    folder = kept / "campaign"
    campaign = load_campaign(folder)
    assert len(campaign.missions) == 4
    assert "2 of 2 points keep every AUV surely below 1 m" in campaign.summary()
    for command in ("status", "compare", "report"):
        told = call(command, str(folder))
        assert told.exit_code == 0, (command, told.output)


@pytest.mark.parametrize("model", ["0.2.0/4", "0.0.9/4"])
def test_a_campaign_goes_on_with_its_own_model_only(kept: Path, model: str) -> None:
    """Missions of two versions are not mixed; the one that began it is named."""
    record = kept / "campaign" / "campaign.json"
    record.write_text(json.dumps({**json.loads(record.read_text()), "model_version": model}))
    resumed = call("resume", str(kept / "campaign"))
    assert resumed.exit_code == 2, resumed.output
    assert f"began with model {model}, this is model {model_version()}" in resumed.stderr
    assert f"install bindusbl-des {model.partition('/')[0]}" in resumed.stderr


def test_each_file_says_its_schema() -> None:
    """Tables, run.json and campaign.json."""
    assert json.loads((WRITTEN / "run" / "run.json").read_text())["schema"] == SCHEMA_VERSION
    for path in (WRITTEN / "run").glob("*.parquet"):
        metadata = pq.read_schema(path).metadata
        assert metadata[b"bindusbl.schema"].decode() == f"{path.stem}/{SCHEMA_VERSION}"
    assert json.loads((WRITTEN / "campaign" / "campaign.json").read_text())["format"] == 2


@pytest.mark.parametrize(
    ("record", "key", "command", "told"),
    [
        ("run/run.json", "schema", "report", "run.json is of schema 9, of a newer bindusbl-des"),
        ("campaign/campaign.json", "format", "status", "campaign.json has format 9, of another"),
    ],
)
def test_a_newer_folder_is_refused(
    kept: Path, record: str, key: str, command: str, told: str
) -> None:
    path = kept / record
    path.write_text(json.dumps({**json.loads(path.read_text()), key: 9}))
    refused = call(command, str(path.parent))
    assert refused.exit_code == 2
    assert told in refused.stderr
    assert len(refused.stderr.splitlines()) == 1
