"""Facts: what follows from something that never changes, worked out once and kept."""

from collections.abc import Iterator
from typing import NoReturn, TypeVar

from .lazy import cached_property

Value = TypeVar("Value")


class fact(cached_property[Value]):  # it is used as `property` is
    """An attribute that is derived when it is first asked for, and kept from then on.

    Its docstring says what it is, and in which unit.
    """


class Facts:
    """Something that never changes, and the facts that follow from it."""

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"{type(self).__name__} is facts: {name} cannot be set")

    @classmethod
    def facts(cls) -> Iterator[tuple[str, str]]:
        """Yield the name of each fact and what it is, as its docstring's first paragraph says."""
        for kind in reversed(cls.__mro__):
            for name, value in vars(kind).items():
                if isinstance(value, fact):
                    meaning = (value.__doc__ or "").partition("\n\n")[0]
                    yield name, " ".join(meaning.split())
