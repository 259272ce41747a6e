"""Reads damaged files in child processes with limits: `python -m tests.fuzzing.fuzz INPUTS [SEED]`.

What escapes, hangs or takes too much memory is written to build/fuzz and named by its seed; the exit code is 1 then.
"""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from .inputs import damaged
from .readers import read
from .seeds import SEEDS

BATCH = 500  # inputs that one child reads
SECONDS, GIGABYTE = 5, 2**30  # limits of one input; memory beyond what the child had at its beginning
KEPT = Path("build") / "fuzz"


def child(first: int, last: int) -> None:
    """Reads the inputs of a range of seeds; prints a line for each that is wrong."""
    signal.signal(signal.SIGALRM, lambda *_: (_ for _ in ()).throw(TimeoutError("hangs")))
    with tempfile.TemporaryDirectory() as name:
        for kind, seeds in SEEDS.items():  # imports what is imported late
            read(kind, seeds[0], Path(name))
        before = _used_memory()
        for seed in range(first, last):
            rng = np.random.default_rng(seed)
            kind = list(SEEDS)[rng.integers(len(SEEDS))]
            data = damaged(kind, rng)
            signal.alarm(SECONDS)
            try:
                read(kind, data, Path(name))
            except Exception as error:  # whatever escapes is what is looked for
                _keep(seed, kind, data, repr(error))
            finally:
                signal.alarm(0)
            if _used_memory() - before > GIGABYTE:
                _keep(seed, kind, data, "takes more than a gigabyte")
                before = _used_memory()


def _used_memory() -> int:
    """Peak of this process, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def _keep(seed: int, kind: str, data: bytes, reason: str) -> None:
    KEPT.mkdir(parents=True, exist_ok=True)
    (KEPT / f"{seed}.{kind}").write_bytes(data)
    print(f"seed {seed}, {kind}: {reason[:300]}", flush=True)


def fuzz(count: int, seed: int) -> list[str]:
    """One line for each of `count` inputs, from `seed` on, that is neither read nor refused by name."""
    found = []
    for first in range(seed, seed + count, BATCH):
        command = [sys.executable, "-W", "ignore", "-m", "tests.fuzzing.fuzz", "child", str(first), str(min(first + BATCH, seed + count))]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=BATCH * SECONDS, check=False)
            found += [line for line in run.stdout.splitlines() if line.startswith("seed ")]
            if run.returncode:
                found.append(f"seeds from {first}: the process ended with {run.returncode}: {run.stderr[-300:]}")
        except subprocess.TimeoutExpired:
            found.append(f"seeds from {first}: do not end")
    return found


if __name__ == "__main__":
    if sys.argv[1] == "child":
        child(int(sys.argv[2]), int(sys.argv[3]))
    else:
        wrong = fuzz(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
        print(*wrong, sep="\n")
        sys.exit(1 if wrong else 0)
