"""Parts of a home that can be exchanged: classes by name, by import path, and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from sgm.messages import shorten

if TYPE_CHECKING:
    from typing_extensions import Self


class Part:
    """A frozen dataclass whose fields are the rules of one part of a home."""

    __slots__ = ()

    def describe(self) -> dict[str, Any]:
        """Return the fields as JSON values, from which `from_json` makes the same part."""
        fields: dict[str, Any] = json.loads(json.dumps(asdict(self)))  # type: ignore[call-overload]
        return fields

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Make a part from what `describe` returned; a part with nested fields overrides this.

        Raises:
            TypeError, ValueError: if a field is unknown or out of range.
        """
        return cls(**data)


AnyPart = TypeVar("AnyPart", bound=Part)
AnyClass = TypeVar("AnyClass")


class Registry(dict[str, str], Generic[AnyPart]):
    """Names of the parts of one kind, and the import path of each.

    A part of one's own needs no entry: its import path is its name. With one, homes that were
    recorded with it can be loaded: files name parts by their entries alone.
    """

    def __init__(self, base: type[AnyPart], noun: str, **paths: str) -> None:
        """Name the base class of the parts, their kind, for errors, and the parts."""
        super().__init__(paths)
        self._base = base
        self._noun = noun

    def find(self, name: str) -> type[AnyPart]:
        """Return the class of a name or an import path, "package.module.Class".

        Never give it a path that was read from a file: importing runs code.

        Raises:
            ValueError: if there is none, or it is no class of that kind.
        """
        module, _, attribute = self.get(name, name).rpartition(".")
        found, problem = None, ""
        if module:
            try:
                found = getattr(import_module(module), attribute, None)
            except ImportError as error:
                problem = f": {error}"
        if not (isinstance(found, type) and issubclass(found, self._base)):
            raise ValueError(
                f"{self._noun} must be one of {', '.join(self)}, or the import path of a class, "
                f"got {shorten(name)}{problem}. Choose one of these, or write package.module.Class."
            )
        return found

    def describe(self, part: Part) -> dict[str, Any]:
        """Return the name of a part and its fields as JSON values."""
        path = f"{type(part).__module__}.{type(part).__qualname__}"
        name = next((name for name, class_path in self.items() if class_path == path), path)
        return {"name": name, **part.describe()}

    def read(self, data: Mapping[str, Any]) -> AnyPart:
        """Make a part from what `describe` returned and a file has kept.

        Raises:
            ValueError: if its name has no entry here, or a field is unknown or out of range.
        """
        fields = dict(data)
        name = fields.pop("name")
        if name not in self:
            raise ValueError(
                f"{self._noun} of a file must be one of {', '.join(self)}, got {shorten(name)}. "
                "Add it to the registry first."
            )
        try:
            return self.find(name).from_json(fields)
        except TypeError as error:
            raise ValueError(f"{self._noun} {shorten(name)} has other fields: {error}") from None


class ClassesByName(Mapping[str, type[AnyClass]]):
    """Classes of one kind by the name that commands use, each imported when it is asked for."""

    def __init__(self, noun: str, base: str, **paths: str) -> None:
        """Name the kind, for errors, and the import paths of the base class and of the classes."""
        self._noun = noun
        self._base = base
        self._paths = paths

    def __getitem__(self, name: str) -> type[AnyClass]:
        """Return the class of a known name."""
        found: type[AnyClass] = import_class(self._paths[name])
        return found

    def __iter__(self) -> Iterator[str]:
        """Go through the names; nothing is imported."""
        return iter(self._paths)

    def __len__(self) -> int:
        """Return the number of names."""
        return len(self._paths)

    def __or__(self, other: ClassesByName[AnyClass]) -> ClassesByName[AnyClass]:
        """Return these and others of the same kind."""
        return ClassesByName(self._noun, self._base, **self._paths, **other._paths)

    def find(self, name: str) -> type[AnyClass]:
        """Return the class of a known name, or import one of a user's own, "my_module:MyClass".

        Raises:
            ValueError: if there is no class of that kind of that name.
        """
        module, _, base = self._base.rpartition(".")
        found = find_named(self._noun, name, self, f"My{base}")
        if not (isinstance(found, type) and issubclass(found, import_class(self._base))):
            raise ValueError(
                f"{self._noun} must be a subclass of {module}.{base}, got {shorten(name)}. "
                f"Derive it from {base}, or check the name."
            )
        return found


def import_class(path: str) -> Any:
    """Return the class of an import path, "package.module.Class"."""
    module, _, name = path.rpartition(".")
    return getattr(import_module(module), name)


def find_named(noun: str, name: str, known: Mapping[str, Any], example: str) -> Any:
    """Return what a known name stands for, or import what "module:name" says.

    Its kind, and an example of a name in a module, are for errors.

    Raises:
        ValueError: if there is nothing of that name.
    """
    if name in known:
        return known[name]
    module, separator, attribute = name.partition(":")
    if not separator:
        raise ValueError(
            f"{noun} must be one of {', '.join(known)}, got {shorten(name)}. Choose one of these, "
            f"or name one of your own as my_module:{example}."
        )
    try:
        return getattr(import_module(module), attribute)
    except (ImportError, TypeError, ValueError, AttributeError) as error:  # also of names as "..x"
        raise ValueError(
            f"{noun} must be in a module that can be imported, got {shorten(name)}: {error}. Run "
            "the command in the folder of the module, or install its package."
        ) from error
