"""How long a mission lasts: a number of seconds, or until its survey is flown."""

from typing import Annotated, Any

from pydantic import (
    Field,
    PlainSerializer,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
)

from ..key_types import Real

SURVEY = "survey"
SHORTEST_S, LONGEST_S = 0.001, 1e7


class SurveyEnd(float):
    """The length of a mission (s) that ends with its survey; in a file it is the word `survey`.

    It is not a number until the survey is planned.
    """


def _read(value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
    if isinstance(value, str) and value == SURVEY:
        return SurveyEnd("nan")
    return value if isinstance(value, SurveyEnd) else validate(value)


Duration = Annotated[
    Real,
    Field(ge=SHORTEST_S, le=LONGEST_S),
    WrapValidator(_read),
    PlainSerializer(lambda value: SURVEY if isinstance(value, SurveyEnd) else value),
    WithJsonSchema(
        {"anyOf": [{"type": "number", "minimum": SHORTEST_S, "maximum": LONGEST_S},
                   {"const": SURVEY}]}
    ),
]  # fmt: skip
