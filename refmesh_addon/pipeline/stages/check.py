"""The check of a sequence before hours of work go into it: what may be wrong with its frames, and their preview."""

from __future__ import annotations

from ...core.capture.bad_frames import bad_frames
from ...core.capture.diagnosis import FrameStatistics, describe_take, diagnose
from ...core.capture.openness import CLOSED, take_kind
from ...core.capture.transients import visits
from ...core.errors import RefMeshError
from ...core.findings import Finding
from ...io.files import output_folder
from ...io.findings import CHECK_NAME, CHECK_TEXT, write_findings
from ...io.meshes import read_bytes
from ...io.preview import preview_path, remove_other_previews
from ...io.sequence import Frame, Sequence
from ...io.textures import missing_textures
from ..session.cache import Cache
from ..session.capture import CapturedFile, CapturedSequence, capture_sequence
from ..session.job import CACHE_FOLDER, CHECK, JobSpec
from ..session.session import Session, WorkerPool
from ..session.stage_share import Notify, StageShare
from ..session.unusable_frames import with_remedy
from ..session.written_files import WrittenFiles


def check_sequence(spec: JobSpec, sequence: Sequence, notify: Notify, workers: WorkerPool) -> list[Finding]:
    """Reads every frame that is new or has changed, and writes the findings as JSON and as text.

    A frame that cannot be read is a finding, not an error. Raises RefMeshError when there is no place to write to, and what
    `notify` raises.
    """
    output = output_folder(spec.output)
    damaged: list[str] = []
    session = Session(output, Cache(output / CACHE_FOLDER, spec.resume, damaged.append), workers, notify)
    errors: dict[int, RefMeshError] = {}
    captured = capture_sequence(session, sequence, StageShare(CHECK), errors.__setitem__)
    statistics = [
        _unreadable(frame, errors[index]) if index in errors else _statistics(frame, captured.files[index], captured.keys[index])
        for index, frame in enumerate(sequence.frames)
    ]
    findings = diagnose(statistics, sequence.gaps, spec.settings.tracking.surface)
    findings += _transients(sequence, captured)
    if take_kind([one.kind for one in statistics if not one.error], spec.settings.tracking.surface) == CLOSED:
        findings += _bad_frames(sequence, captured)
    findings += [Finding("names", "note", sequence.numbers[0], note) for note in sequence.notes]
    findings += [Finding("scene", "note", sequence.numbers[0], note) for note in spec.notes]
    findings += [Finding("cache", "note", sequence.numbers[0], note) for note in damaged]
    remove_other_previews(output, [preview_path(output, frame.path) for frame in sequence.frames if frame.path.is_file()])
    files = WrittenFiles(output)
    for name in (CHECK_NAME, CHECK_TEXT):
        files.claim(name)
    write_findings(output, sequence, findings, describe_take(statistics, spec.settings.tracking.surface))
    return findings


def _transients(sequence: Sequence, captured: CapturedSequence) -> list[Finding]:
    transients = visits(file.pieces for file in captured.files.values()).transient
    message = "{} pieces are there for a few frames only; they are not followed but shown as captured, there and nowhere else"
    numbers = [sequence.numbers[index] for index in captured.files]
    return [Finding("transient", "note", number, message.format(len(own))) for number, own in zip(numbers, transients) if len(own)]


def _bad_frames(sequence: Sequence, captured: CapturedSequence) -> list[Finding]:
    """What is lost or doubled for a moment, in a take of closed bodies."""
    numbers = [sequence.numbers[index] for index in captured.files]
    found = bad_frames(file.pieces for file in captured.files.values())
    return [Finding("bad", "note", numbers[bad.index], f"{bad.reason}; the frame is not fitted (--bad-frames)") for bad in found]


def _unreadable(frame: Frame, error: RefMeshError) -> FrameStatistics:
    return FrameStatistics(frame.number, with_remedy(str(error).replace(f"{frame.path}: ", "")))


def _statistics(frame: Frame, file: CapturedFile, key: str) -> FrameStatistics:
    textures = missing_textures(read_bytes(frame.path), frame.path)  # looked up each time: they are files of their own
    statistics = vars(file.captured.statistics)
    return FrameStatistics(frame.number, content=key, missing_textures=textures, omitted_faces=file.omitted_faces, **statistics)
