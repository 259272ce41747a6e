"""Results of stages on disk, under keys derived from what they depend on."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ...core.array_layout import check_layouts
from ...core.arrays import Arrays, Result, from_arrays, to_arrays
from ...io.files import output_folder, remove_if_possible
from ...io.sealed_npz import read_sealed, write_sealed

KEY_LENGTH = 12  # hexadecimal digits of a key in a file name: 48 bits, for at most thousands of entries
_ENTRY = re.compile(rf"(.+)-[0-9a-f]{{{KEY_LENGTH}}}\.npz")


def digest(*parts: object) -> str:
    """A key derived from what a result depends on: upstream keys, settings, schema number, the bytes of a file.

    Equal parts give equal keys on any machine; anything that JSON or bytes can hold is taken, mappings in any order.
    """
    total = hashlib.blake2b(digest_size=16)
    for part in parts:
        data = part if isinstance(part, bytes) else json.dumps(part, sort_keys=True, allow_nan=False).encode("utf-8")
        # The length in front keeps ("ab", "c") and ("a", "bc") apart.
        total.update(b"%d:%d:" % (isinstance(part, bytes), len(data)))
        total.update(data)
    return total.hexdigest()


class Cache:
    """Entries `<name>-<key>.npz` in one folder, one for each name; a name may hold folders, "tracking/frame_0006".

    An entry is complete or absent. One with another key, or one that is damaged, counts as absent.
    With `resume=False` so do all entries of earlier runs.
    warn : called for each damaged entry.  shared : other processes work on other entries of the folder at the same time.
    """

    def __init__(
        self, folder: str | Path, resume: bool = True, warn: Callable[[str], None] = lambda _: None, shared: bool = False
    ):
        self.folder = output_folder(folder, shared)
        self._resume, self._warn, self._shared = resume, warn, shared
        self._whole: dict[str, str] = {}  # name -> key of each entry that this run has written, or read without a fault
        self._damaged: set[Path] = set()
        self._earlier: dict[Path, dict[str, list[str]]] = {}  # folder -> stem -> file names of entries before this run wrote there

    def path(self, name: str, key: str) -> Path:
        """Where the entry is, or would be."""
        return self.folder / f"{name}-{key[:KEY_LENGTH]}.npz"

    def load(self, name: str, key: str, declared: Mapping[str, str] | None = None) -> Arrays | None:
        """The arrays of an entry; None when it is absent.  declared : what they must be, as in `check_layouts`."""
        path = self.path(name, key)
        if not self._resume and self._whole.get(name) != key:
            return None
        try:
            arrays = read_sealed(path, self._sealed_name(path))
            if declared is not None:
                check_layouts(arrays, declared)
            return arrays
        except FileNotFoundError:
            return None
        except ValueError as error:
            self._warn_of(path, error)
            return None

    def save(self, name: str, key: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Writes an entry, then removes those of the same name with other keys."""
        path = self.path(name, key)
        if path.parent not in self._earlier:
            self._earlier[path.parent] = _entries(output_folder(path.parent, self._shared))
        write_sealed(path, self._sealed_name(path), arrays)
        self._damaged.discard(path)
        stale = self._earlier[path.parent].pop(Path(name).name, [])
        stale += [self.path(name, self._whole[name]).name] if name in self._whole else []
        for other in set(stale) - {path.name}:
            remove_if_possible(path.with_name(other))
        self._whole[name] = key

    def load_or_make(
        self, name: str, key: str, make: Callable[[], Mapping[str, np.ndarray]], declared: Mapping[str, str] | None = None
    ) -> Arrays:
        """The arrays of an entry; computed by `make` and written first where it is absent.  declared : as in `load`."""
        arrays = self.load(name, key, declared)
        if arrays is None:
            arrays = _in_c_order(make())
            self.save(name, key, arrays)
        return arrays

    def load_result(self, name: str, key: str, kind: type[Result]) -> Result | None:
        """The result dataclass that an entry holds; None when it is absent."""
        arrays = self.load(name, key)
        try:
            result = None if arrays is None else from_arrays(kind, arrays)
        except (LookupError, TypeError, ValueError) as error:  # written by a version that kept other fields, or by somebody else
            self._warn_of(self.path(name, key), error)
            return None
        if result is not None:
            self._whole[name] = key
        return result

    def holds_result(self, name: str, key: str, kind: type[Result]) -> bool:
        """Whether there is an entry that holds such a result; one that this run has written or read is not read again for this."""
        return self._whole.get(name) == key or self.load_result(name, key, kind) is not None

    def save_result(self, name: str, key: str, result: object) -> None:
        """Writes a result dataclass as an entry, as `save` does."""
        self.save(name, key, _in_c_order(to_arrays(result)))

    def load_or_make_result(self, name: str, key: str, kind: type[Result], make: Callable[[], Result]) -> Result:
        """The result dataclass of an entry; computed by `make` and written first where it is absent."""
        result = self.load_result(name, key, kind)
        if result is None:
            arrays = _in_c_order(to_arrays(make()))
            self.save(name, key, arrays)
            result = from_arrays(kind, arrays)
        return result

    def _sealed_name(self, path: Path) -> str:
        """Part of the checksum, so that an entry that was put in the place of another is noticed."""
        return path.relative_to(self.folder).as_posix()

    def _warn_of(self, path: Path, error: Exception) -> None:
        if path not in self._damaged:
            self._damaged.add(path)
            self._warn(f"{path}: the cache entry cannot be used and is computed again ({error})")


def _entries(folder: Path) -> dict[str, list[str]]:
    """Names of the entries in a folder, by what stands before their keys. Read once: a take has thousands, each of which is saved."""
    entries: dict[str, list[str]] = {}
    for name in os.listdir(folder):
        entry = _ENTRY.fullmatch(name)
        if entry:
            entries.setdefault(entry[1], []).append(name)
    return entries


def _in_c_order(arrays: Mapping[str, np.ndarray]) -> Arrays:
    """Laid out as in a loaded entry: the order of memory can change the last bit of a sum."""
    return {name: np.asarray(array, order="C") for name, array in arrays.items()}
