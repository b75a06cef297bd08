"""What an object works out when it is first asked for, and then has; facts are such, of something
that never changes.
"""

from collections.abc import Callable, Iterator
from typing import Any, Generic, NoReturn, Self, TypeVar, overload

Value = TypeVar("Value")


class cached_property(Generic[Value]):
    """As that of functools since Python 3.12: without a lock.

    Before, one lock stands for a property of all objects, and a process that is forked while a
    thread works one out waits for it for ever.  Threads that ask at once may work it out twice.
    """

    def __init__(self, work: Callable[[Any], Value]) -> None:
        self._work, self.__doc__ = work, work.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type | None = None) -> Self: ...

    @overload
    def __get__(self, instance: object, owner: type | None = None) -> Value: ...

    def __get__(self, instance: object, owner: type | None = None) -> Self | Value:
        if instance is None:
            return self
        value = instance.__dict__[self._name] = self._work(instance)
        return value


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
