"""RefMesh's own code on the workers of a Dask cluster: sent once to each, so that none has to have it installed, or Blender.

Dask reads functions and arguments on its scheduler too. What it gets is therefore bytes, and one small function that cloudpickle
sends by value.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PACKAGE = __name__.partition(".")[0]
PACKAGE_FOLDER = Path(__file__).resolve().parents[2]
SENT = ("core", "io", "pipeline")  # all that work needs
_STAMP = (1980, 1, 1, 0, 0, 0)  # of every member, so that the same code has the same digest


def code_archive() -> tuple[str, bytes]:
    """A zip with the sources that workers need, and its digest."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in _sources():
            name = f"{PACKAGE}/{path.relative_to(PACKAGE_FOLDER).as_posix()}"
            archive.writestr(zipfile.ZipInfo(name, _STAMP), path.read_bytes(), zipfile.ZIP_DEFLATED)
    data = buffer.getvalue()
    return hashlib.blake2b(data, digest_size=8).hexdigest(), data


def sendable(digest: str, archive: bytes) -> tuple[Any, Any]:
    """A worker plugin that unpacks the code on each worker, also on those that come later, and the function that runs a task with it.

    Both are complete in themselves: the worker cannot import the module that they are defined in.
    """
    from distributed.diagnostics.plugin import WorkerPlugin

    folder_name, package = f"refmesh-{digest}", PACKAGE

    class CodePlugin(WorkerPlugin):
        """Unpacks the code into the worker's own folder."""

        def setup(self, worker):
            import io
            import os
            import zipfile

            with zipfile.ZipFile(io.BytesIO(archive)) as code:
                code.extractall(os.path.join(worker.local_directory, folder_name))

    def run(packed: bytes) -> bytes:
        import os
        import sys
        import threading
        from importlib import import_module

        from distributed import get_worker

        worker = get_worker()
        # Threads of one worker take turns: what is built once for a group serves one task at a time.
        with worker.__dict__.setdefault("refmesh_turn", threading.Lock()):
            folder = os.path.join(worker.local_directory, folder_name)
            if sys.path[0] != folder:  # the first task, or the last one was sent by another version
                sys.path[:] = [folder, *(path for path in sys.path if os.path.basename(path)[:8] != "refmesh-")]
                for name in [name for name in sys.modules if name.partition(".")[0] == package]:
                    del sys.modules[name]
            return import_module(f"{package}.pipeline.session.cluster_task").execute(packed)

    return CodePlugin(), run


def _sources() -> Iterator[Path]:
    yield PACKAGE_FOLDER / "__init__.py"
    for folder in SENT:
        yield from sorted((PACKAGE_FOLDER / folder).rglob("*.py"))
