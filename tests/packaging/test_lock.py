"""The lock files: everything pinned and hashed, and nothing but what the .in files ask for at the top."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LOCKS = {
    "environment/requirements.txt": "environment/requirements.in",
    "environment/peers.txt": "environment/peers.in",
    "extension/wheels-cp311.txt": "extension/wheels.in",
    "extension/wheels-cp313.txt": "extension/wheels.in",
    "extension/pymeshlab.txt": "extension/pymeshlab.in",
}


def entries(text: str) -> list[str]:
    """One string for each requirement, its continued lines joined."""
    lines = [line for line in text.replace("\\\n", " ").splitlines() if line.strip() and not line.lstrip().startswith("#")]
    return [line.strip() for line in lines]


@pytest.mark.parametrize("lock", LOCKS)
def test_every_entry_is_pinned_and_hashed(lock):
    for entry in entries((ROOT / lock).read_text()):
        assert re.match(r"[a-z0-9-]+==\S+\s+--hash=sha256:[0-9a-f]{64}", entry), entry


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_holds_what_was_asked_for(lock):
    locked = {entry.split()[0] for entry in entries((ROOT / lock).read_text())}
    asked: dict[str, set[str]] = {}
    for entry in entries((ROOT / LOCKS[lock]).read_text()):
        pin = entry.split("#")[0].split(";")[0].strip()
        asked.setdefault(pin.split("==")[0], set()).add(pin)
    for name, pins in asked.items():
        assert len(pins & locked) == 1, f"{name}: {pins} are asked for; run `make lock`"


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_names_no_host(lock):
    assert "://" not in (ROOT / lock).read_text()


def test_extension_leaves_numpy_to_blender():
    assert not [lock for lock in LOCKS if lock.startswith("extension") and "numpy==" in (ROOT / lock).read_text()]
