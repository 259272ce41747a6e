"""Bad frames that are left out of all stages, and told in the report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...core.capture.bad_frames import BadFrame
from ...io.report import BadFrameReport, Report


@dataclass(frozen=True)
class LeftOut:
    """frames : by number.  bridged : whether their mesh moves from the frame before to the one after; otherwise the one before is held.

    The first and the last frame of a take, which have one frame beside them as before and after, hold that one.
    """

    frames: tuple[BadFrameReport, ...] = ()
    bridged: bool = True

    @classmethod
    def of(cls, bad: tuple[BadFrame, ...], numbers: tuple[int, ...], bridged: bool) -> LeftOut:
        """numbers : of all frames of the take."""
        entries = []
        for one in bad:
            before, after = numbers[one.before], numbers[one.after]
            moves = bridged and before != after
            entries.append(BadFrameReport(numbers[one.index], one.reason, tuple(one.place.tolist()), before, after, moves))
        return cls(tuple(entries), bridged)

    def advice(self, number: int) -> str:
        """What an error says of a frame that is not part of the job, if it is a bad one; otherwise nothing."""
        bad = next((one for one in self.frames if one.frame == number), None)
        if bad is None:
            return ""
        others = f"{bad.before}" if bad.before == bad.after else f"{bad.before} or {bad.after}"
        return f"; {bad.reason} in frame {number}: take {others}, or --bad-frames fit"

    def report(self, report: Report, warn: Callable[[str], None]) -> None:
        """Puts the frames into the report, with a warning for each run of them."""
        report.bad_frames = list(self.frames)
        for ends in dict.fromkeys((one.before, one.after) for one in self.frames):
            own = [one for one in self.frames if (one.before, one.after) == ends]
            first = own[0]
            which = f"frame {first.frame}" if len(own) == 1 else f"frames {first.frame}-{own[-1].frame}"
            where = "({:.4g}, {:.4g}, {:.4g})".format(*first.position)
            warn(f"{which}: {first.reason}, about {where}; {_treatment(first)} (--bad-frames)")


def _treatment(bad: BadFrameReport) -> str:
    if bad.before == bad.after:
        return f"left out, and frame {bad.before} is held"
    if bad.bridged:
        return f"bridged from frames {bad.before} and {bad.after}"
    return f"left out, and another mesh begins with frame {bad.after}"
