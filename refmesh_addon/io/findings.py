"""The findings of a check, as JSON for the panel and as text for the user."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from ..core.counted import counted
from ..core.errors import RefMeshError
from ..core.findings import SEVERITIES, Finding
from .files import atomic_file, write_json
from .frame_range import format_ranges
from .regular_files import read_json
from .sequence import Sequence

CHECK_NAME, CHECK_TEXT = "sequence_check.json", "sequence_check.txt"  # in the output folder


def read_findings(output: str | Path) -> list[Finding]:
    """The findings in an output folder. Raises RefMeshError when there are none that can be read."""
    path = Path(output) / CHECK_NAME
    try:
        return [_finding(entry) for entry in read_json(path)["findings"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RefMeshError(f"{path}: cannot be read ({error}); check the sequence again") from error


def read_kind(output: str | Path) -> str:
    """What kind of capture the checked take is, in a clause; "" where the files of the check do not say it."""
    try:
        kind = read_json(Path(output) / CHECK_NAME)["kind"]
    except (OSError, ValueError, KeyError, TypeError):
        return ""
    return kind if isinstance(kind, str) else ""


def _finding(entry: dict) -> Finding:
    finding = Finding(**entry)
    texts = (finding.kind, finding.severity, finding.message)
    if not all(isinstance(text, str) for text in texts) or type(finding.frame) is not int or finding.severity not in SEVERITIES:
        raise ValueError("a finding has values of other types")
    return finding


def write_findings(output: Path, sequence: Sequence, findings: list[Finding], kind: str = "") -> None:
    """Both files, into the output folder.  kind : of the capture, see `read_kind`. Raises RefMeshError when they cannot be written."""
    write_json(output / CHECK_NAME, {"sequence": sequence.name, "kind": kind, "findings": [asdict(finding) for finding in findings]})
    with atomic_file(output / CHECK_TEXT) as file:
        file.write(report_text(sequence, findings, kind).encode("utf-8"))


def report_text(sequence: Sequence, findings: list[Finding], kind: str = "") -> str:
    """The findings as text, by severity, below what kind of capture it is, which a note may have said already."""
    lines = [f"{sequence.name}: {counted(len(sequence.frames), 'frame')}, {format_ranges(sequence.numbers)}"]
    if kind and all(finding.message != kind for finding in findings):
        lines.append(kind)
    for severity, meaning in SEVERITIES.items():
        chosen = [finding for finding in findings if finding.severity == severity]
        if chosen:
            lines += ["", f"{severity}s ({meaning[0].lower()}{meaning[1:]})"]
            lines += [f"  frame {finding.frame}: {finding.message}" for finding in chosen]
    return "\n".join(lines if findings else [*lines, "", "nothing found"]) + "\n"
