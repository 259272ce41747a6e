"""The process that reads files for Blender, which a damaged one can then neither end nor fill the memory of.

`python -m refmesh_addon.pipeline.process.reading_process` takes lines of JSON on standard input, {"task": ..., "arguments": [...]}, and
answers each with a line of JSON on standard output: {"size": ...} and as many bytes of an .npz, or {"error": ...}.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
import threading
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...core.errors import RefMeshError

IDLE = 60.0  # seconds without a request after which the process ends; the next request starts another one


def frame(path: str) -> dict[str, np.ndarray]:
    """A mesh file as `PreviewMesh` holds it."""
    from ...io.meshes import read_mesh
    from ...io.preview import PreviewMesh

    return vars(PreviewMesh.of(read_mesh(path)))


def colors(path: str, folder: str) -> dict[str, np.ndarray]:
    """The colors of a frame as `SourceColors` holds them; pictures that are in no file of their own are written to the folder."""
    from ...io.source_colors import read_source_colors

    return read_source_colors(Path(path), Path(folder)).to_arrays()


def surface(path: str) -> dict[str, np.ndarray]:
    """kind : of the surface of a mesh file, one of `openness.KINDS`."""
    from ...core.capture.cleaning import cleaned
    from ...core.capture.openness import surface_kind
    from ...io.meshes import read_mesh

    statistics = cleaned(read_mesh(path)).statistics
    return {"kind": np.array(surface_kind(statistics.capped, statistics.compactness, statistics.of_pieces))}


def stream_entries(path: str) -> dict[str, np.ndarray]:
    """numbers : of all frames of a .refmesh file.  counts : how many of them each group has."""
    from ...io.refmesh_stream.reader import StreamReader

    entries = StreamReader(path).entries
    numbers = [number for entry in entries for number in entry.numbers]
    return {"numbers": np.array(numbers, np.int64), "counts": np.array([len(entry.numbers) for entry in entries], np.int64)}


def stream_group(path: str, index: int) -> dict[str, np.ndarray]:
    """One group of a .refmesh file as `FrameGroup` holds it."""
    from ...io.refmesh_stream.reader import StreamReader

    group = StreamReader(path).group(index)
    return {"numbers": np.array(group.numbers, np.int64), "positions": group.positions, "triangles": group.triangles}


def decode(path: str, folder: str) -> dict[str, np.ndarray]:
    """Writes the frames of a .refmesh file; returns the paths."""
    from ...io.refmesh_stream.decoding import decode_stream

    return {"written": np.array([str(written) for written in decode_stream(path, folder)])}


TASKS = {task.__name__: task for task in (frame, colors, surface, stream_entries, stream_group, decode)}


def answer(line: str) -> tuple[dict[str, object], bytes]:
    """What is sent for one request."""
    request = json.loads(line)
    path = request["arguments"][0]
    try:
        file = io.BytesIO()
        np.savez(file, **TASKS[request["task"]](*request["arguments"]))
        return {"size": len(file.getvalue())}, file.getvalue()
    except RefMeshError as error:
        return {"error": str(error)}, b""
    except ImportError as error:
        return {"error": str(error), "package": error.name or ""}, b""
    except MemoryError:
        return {"error": f"{path}: needs more memory than there is"}, b""
    except Exception as error:  # the edge of the process: a bug of ours or of a library, which the parent must learn of
        return {"error": f"{path}: cannot be read ({type(error).__name__}: {' '.join(str(error).split())})"}, b""


def main() -> None:
    """Answers requests until there is nobody to ask, or nothing is asked for some time."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is not part of the answer
    _limit_memory()
    while line := _next_line():  # ends with the parent, at the end of its pipe
        head, data = answer(line)
        _send(replies, head, data)


def _next_line() -> str:
    idle = threading.Timer(IDLE, os._exit, (0,))
    idle.daemon = True
    idle.start()
    try:
        return sys.stdin.readline()
    finally:
        idle.cancel()


def _send(replies: BinaryIO, head: dict[str, object], data: bytes) -> None:
    replies.write(json.dumps(head).encode("ascii") + b"\n" + data)
    replies.flush()


def _limit_memory() -> None:
    """What cannot be had ends in MemoryError, which names a file, before the system ends a process of its choice."""
    with contextlib.suppress(ImportError, OSError, ValueError, AttributeError):  # only where the system knows such limits
        import resource

        total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        resource.setrlimit(resource.RLIMIT_AS, (total, resource.getrlimit(resource.RLIMIT_AS)[1]))


if __name__ == "__main__":
    main()
