"""What `campaign.json` must hold: a record of somebody else's is checked before it is used."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...scenario.key_types import PRINTABLE

# A seed is at most what a column of whole numbers holds.
LARGEST_SEED = 2**63 - 1

# Each mission is a line of the plan.
MOST_MISSIONS = 5_000_000

Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Words = Annotated[str, Field(pattern=PRINTABLE, max_length=200)]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]
Count = Annotated[int, Field(ge=0)]
Width = (
    Annotated[float, Field(gt=0)] | Annotated[str, Field(pattern=r"^[0-9]{1,9}(\.[0-9]{1,9})? ?%$")]
)


class _Section(BaseModel):
    model_config = ConfigDict(strict=True, allow_inf_nan=False)


class _Named(_Section):
    name: Words


class _Experiment(_Section):
    name: Words
    scenario_as_given: dict[str, Any]
    points: Annotated[list[dict[str, Any]], Field(min_length=1)]
    seeds: Annotated[
        list[Annotated[int, Field(ge=0, le=LARGEST_SEED)]],
        Field(min_length=1, max_length=5_000_000),
    ]
    detail: Literal["summary", "full"]
    until_ci: dict[str, Width]


class _Session(_Section):
    began_at: float
    rows_before: Count


class _Record(_Section):
    name: Words
    status: Words
    missions: Count
    shard: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=2, max_length=2)] | None
    plan_sha256: Sha256
    model_version: Words
    versions: dict[Words, Words]
    scenario_sha256: Sha256
    scenario: _Named
    own_parts: dict[Words, Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")]]
    experiment: _Experiment
    session: _Session


def check_record(record: Any) -> None:
    """Refuse a record that lacks something or holds what it cannot.

    Raises:
        ValueError: naming the first key that is wrong.
    """
    try:
        _Record.model_validate(record)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        key = ".".join(map(str, first["loc"][:4]))
        raise ValueError(f"{key}: {first['msg']}") from None
    count = len(record["experiment"]["points"]) * len(record["experiment"]["seeds"])
    if count > MOST_MISSIONS:
        raise ValueError(f"experiment: makes {count:,} missions; at most {MOST_MISSIONS:,} can run")
    shard = record["shard"]
    if shard and shard[0] > shard[1]:
        raise ValueError(f"shard: there is no share {shard[0]} of {shard[1]}")
