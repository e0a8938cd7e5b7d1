"""The methods by name: those of wgmb, and those that other installed packages announce."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint, distributions

from .. import interpreter
from ..errors import InputError
from .contract import Method
from .contract_check import check_contract
from .options import Option, options_of

GROUP = "wgmb.methods"
"""The entry points by which a package announces its methods: NAME = "module:Class"."""


class Methods(Mapping[str, type]):
    """Classes of the methods by their names: first those of wgmb.

    The code of another package is imported once one of its methods is asked for by name, or all
    are listed. A method that cannot be used is left out, and `faults` says why; a list of all warns
    of it once.
    """

    def __init__(self, own: Iterable[type]):
        self._own = tuple(method.name for method in own)
        self._loaded: dict[str, type] = {method.name: method for method in own}
        self._warned: set[str] = set()
        self.faults: dict[str, str] = {}
        """The faults of announced methods that cannot be used, by name: of those asked for."""
        self.packages: dict[str, str] = {}
        """Name and version of the package that brings a method, for those not of wgmb."""

    def __getitem__(self, name: str) -> type:
        if name not in self._loaded and name in self._announced:
            self._load(name)
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        for name in self._announced:
            if name in self._own or name not in self._loaded:
                self._load(name)
        for name in self.faults.keys() - self._warned:
            self._warned.add(name)
            warnings.warn(self.faults[name], RuntimeWarning, stacklevel=2)
        return iter(tuple(self._loaded))

    def __len__(self) -> int:
        return len(list(iter(self)))

    @cached_property
    def _announced(self) -> dict[str, list[EntryPoint]]:
        """The entry points of other packages, by the name of the method.

        Those of the current folder do not count, where files of strangers lie.
        """
        folders = [folder for folder in sys.path if not interpreter.is_current(folder)]
        found: dict[str, dict[str, EntryPoint]] = {}
        for package in distributions(path=folders):
            for entry in package.entry_points.select(group=GROUP):
                found.setdefault(entry.name, {}).setdefault(package.metadata["Name"], entry)
        return {name: list(entries.values()) for name, entries in sorted(found.items())}

    def _load(self, name: str) -> None:
        """Import an announced method, or write down why it cannot be used; once each."""
        if name in self.faults:
            return
        first, *others = map(_package, self._announced[name])
        try:
            if name in self._own:
                raise InputError("wgmb has a method of this name")
            if others:
                raise InputError(f"{' and '.join(others)} announces one of this name, too")
            method = _imported(self._announced[name][0])
            check_contract(method)
            if method.name != name:
                raise InputError(f"its class has the name {method.name!r}")
            self._check_options(method)
        except InputError as error:
            self.faults[name] = f"method {name!r} of {first} cannot be used: {error}"
        else:
            self._loaded[name], self.packages[name] = method, first

    def _check_options(self, method: type[Method]) -> None:
        """InputError where an option is something else than another method's of this name.

        All methods share one setting for each name.
        """
        known = {
            name: (one.name, option)
            for one in self._loaded.values()
            for name, option in options_of(one.Options).items()
        }
        for name, option in options_of(method.Options).items():
            owner, other = known.get(name, ("", option))
            if (option.kind, bool(option.choices)) != (other.kind, bool(other.choices)):
                kinds = " and ".join(_kind(one) for one in (option, other))
                raise InputError(f"its option {name} and that of {owner} differ: {kinds}")


def _kind(option: Option) -> str:
    return "a word of a list" if option.choices else option.kind.__name__


def _package(entry: EntryPoint) -> str:
    """Name and version of the package that an entry point belongs to."""
    package = entry.dist
    return f"{package.metadata['Name']} {package.version}" if package else "a package"


def _imported(entry: EntryPoint) -> type[Method]:
    """The class of an entry point; InputError if its module cannot be imported."""
    try:
        return entry.load()
    except (Exception, SystemExit) as error:  # whatever strangers' code raises
        why = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(f"{entry.value} cannot be imported: {why}") from None
