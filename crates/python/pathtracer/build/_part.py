"""Base of all parts of scenes."""

import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar, Protocol, TypeAlias

from numpy.typing import ArrayLike


class SupportsDLPack(Protocol):
    """An array of any library, in the memory of the processor."""

    def __dlpack__(self) -> Any: ...

    def __dlpack_device__(self) -> Any: ...


Array: TypeAlias = ArrayLike | SupportsDLPack
Vector: TypeAlias = Sequence[float] | ArrayLike | SupportsDLPack
Color: TypeAlias = float | Vector


class Part:
    """Part of a scene. Fields that are None have their defaults."""

    type: ClassVar[str | None] = None
    """Value of the key ``type`` in scene files."""
    table: ClassVar[str | None] = None
    """Table of the scene to which the part belongs."""

    def __repr__(self) -> str:
        assert dataclasses.is_dataclass(self)
        values = [(field.name, getattr(self, field.name)) for field in dataclasses.fields(self)]
        given = ", ".join(f"{name}={value!r}" for name, value in values if value is not None)
        return f"{self.__class__.__name__}({given})"
