"""Results of stages on disk, under keys derived from what they depend on."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np

from ...core.array_layout import check_layouts
from ...core.arrays import Arrays, Result, from_arrays, to_arrays
from ...io.files import output_folder, remove_if_possible
from ...io.sealed_npz import read_sealed, write_sealed

KEY_LENGTH = 12  # hexadecimal digits of a key in a file name: 48 bits, for at most thousands of entries


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
        self._written: set[Path] = set()
        self._damaged: set[Path] = set()
        self._folders: set[Path] = {self.folder}

    def path(self, name: str, key: str) -> Path:
        """Where the entry is, or would be."""
        return self.folder / f"{name}-{key[:KEY_LENGTH]}.npz"

    def load(self, name: str, key: str, declared: Mapping[str, str] | None = None) -> Arrays | None:
        """The arrays of an entry; None when it is absent.  declared : what they must be, as in `check_layouts`."""
        path = self.path(name, key)
        if not self._resume and path not in self._written:
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
        if path.parent not in self._folders:
            self._folders.add(output_folder(path.parent, self._shared))
        write_sealed(path, self._sealed_name(path), arrays)
        self._damaged.discard(path)
        self._written.add(path)
        self.remove_stale(name, keep=[key])

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
            return None if arrays is None else from_arrays(kind, arrays)
        except (LookupError, TypeError, ValueError) as error:  # written by a version that kept other fields, or by somebody else
            self._warn_of(self.path(name, key), error)
            return None

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

    def remove_stale(self, name: str, keep: Iterable[str]) -> None:
        """Removes all entries of this name except those with the keys to keep."""
        kept = {self.path(name, key).name for key in keep}
        stem = Path(name).name
        entry = re.compile(re.escape(stem) + rf"-[0-9a-f]{{{KEY_LENGTH}}}\.npz")
        for path in (self.folder / name).parent.glob("*.npz"):
            if entry.fullmatch(path.name) and path.name not in kept:
                remove_if_possible(path)


def _in_c_order(arrays: Mapping[str, np.ndarray]) -> Arrays:
    """Laid out as in a loaded entry: the order of memory can change the last bit of a sum."""
    return {name: np.asarray(array, order="C") for name, array in arrays.items()}
