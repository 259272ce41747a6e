"""Which picture belongs to a frame: the one its file names, or, where that is wrong, the one with its number."""

from __future__ import annotations

import re
from pathlib import Path

from .images import EXTENSIONS
from .regular_files import read_regular

_NUMBER = re.compile(r"[0-9]+(?!.*[0-9])")  # the last one in a name
_FOREIGN = re.compile(r"[A-Za-z]:/|/")  # a path on the machine that wrote the file

MOST_SHOWN = 80  # characters of a name in a message


class TextureFiles:
    """The files beside one frame; nothing outside the frame's folder is ever opened.

    notes : sentences about what was refused, missing or chosen in place of something else.
    contents : bytes of all files that were read, in their order.  paths : of these.  pictures : those of them that `picture` returned.
    """

    def __init__(self, frame: Path):
        self.frame = frame
        self.folder = frame.parent.resolve()
        self.notes: list[str] = []
        self.contents: list[bytes] = []
        self._known: dict[Path, bytes] = {}
        self._listings: dict[Path, dict[str, Path]] = {}
        self.paths: list[Path] = []
        self.pictures: list[Path] = []

    def read(self, name: str) -> bytes | None:
        """Bytes of a file that the frame names, whatever the case of its letters; None, and a note, when it cannot be had."""
        path = self.find(name)
        return None if path is None else self._bytes(path)

    def picture(self, name: str, only: bool = True) -> tuple[Path, bytes] | None:
        """Path and bytes of the picture that the frame names, or of the one with the frame's number where that is not there.

        only : the frame names no other picture. Then one named with another frame's number gives way to that of this frame.
        """
        told = len(self.notes)
        named = self.find(name) if name else None
        path = (self._renumbered(named) if named and only else None) or named or (self.by_number() if only else None)
        if path is not None and named is not None and path != named:
            self.notes.append(f"{self.frame}: names '{name}', which belongs to another frame; {path.name} is used")
        elif path is not None and named is None and name:
            self.notes.append(f"{self.frame}: names '{name}', which is not there; {path.name} is used")
        elif path is None and name and len(self.notes) == told:  # otherwise a refusal has said why
            self.notes.append(f"{self.frame}: names '{name}', which is not there; put it beside the frame")
        data = None if path is None else self._bytes(path)
        if path is None or data is None:
            return None
        self.pictures.append(path)
        return path, data

    def find(self, name: str) -> Path | None:
        """The file of this name in the frame's folder or below; paths of other machines are looked up by their last part."""
        if not name or "\0" in name:
            return None
        try:
            return self._found(name)
        except (OSError, RuntimeError) as error:  # a name that is too long, a loop of links
            reason = getattr(error, "strerror", None) or "a loop of links"
            self.notes.append(f"{self.frame}: names '{name[:MOST_SHOWN]}', which cannot be opened ({reason})")
            return None

    def holds(self, name: str) -> bool:
        """Whether a file of this name is there, a regular one inside of the frame's folder."""
        path = self.find(name)
        return path is not None and path.is_file()

    def _found(self, name: str) -> Path | None:
        inside, beside = self.folder / name, self.folder / Path(name).name
        if _FOREIGN.match(name):
            return self._other_case(beside)
        if not inside.resolve().is_relative_to(self.folder):
            self.notes.append(f"{self.frame}: names '{name}', outside its own folder, which is not opened; put the file beside the frame")
            return None
        return self._other_case(inside) or self._other_case(beside)

    def by_number(self) -> Path | None:
        """The picture with the frame's own name, or the only one with its number."""
        pictures = [path for path in sorted(self.folder.iterdir()) if path.suffix.lower() in EXTENSIONS and self._inside(path)]
        same = [path for path in pictures if path.stem.lower() == self.frame.stem.lower()]
        number = _number(self.frame.stem)
        numbered = [path for path in pictures if number is not None and _number(path.stem) == number]
        return same[0] if same else numbered[0] if len(numbered) == 1 else None

    def _renumbered(self, named: Path) -> Path | None:
        """The sibling of a picture whose name holds the frame's number in place of another; None where there is none."""
        number, own = _number(self.frame.stem), _number(named.stem)
        if number is None or own is None or number == own:
            return None
        shape = _NUMBER.sub("#", named.stem)
        siblings = [path for path in sorted(named.parent.iterdir()) if path.suffix.lower() == named.suffix.lower()]
        fitting = [path for path in siblings if _NUMBER.sub("#", path.stem) == shape and _number(path.stem) == number]
        return fitting[0] if len(fitting) == 1 and self._inside(fitting[0]) else None

    def _other_case(self, path: Path) -> Path | None:
        if path.exists():
            return path if self._inside(path) else None
        if not path.parent.is_dir():
            return None
        same = self._listing(path.parent).get(path.name.lower())
        return same if same is not None and self._inside(same) else None

    def _listing(self, folder: Path) -> dict[str, Path]:
        """Paths in a folder by their names in lower case, the first in order for each; listed once, as a frame can name thousands."""
        if folder not in self._listings:
            self._listings[folder] = {path.name.lower(): path for path in sorted(folder.iterdir(), reverse=True)}
        return self._listings[folder]

    def _inside(self, path: Path) -> bool:
        return path.resolve().is_relative_to(self.folder)

    def _bytes(self, path: Path) -> bytes | None:
        real = path.resolve()
        if real in self._known:  # under another name
            return self._known[real]
        try:
            self._known[real] = read_regular(path)
            self.contents.append(self._known[real])
            self.paths.append(path)
            return self.contents[-1]
        except OSError as error:
            self.notes.append(f"{path}: cannot be read ({error.strerror or error})")
            return None


def _number(stem: str) -> int | None:
    match = _NUMBER.search(stem)
    return int(match[0]) if match else None
