"""Bad frames that are left out of all stages, and told in the report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...core.capture.bad_frames import BadFrame
from ...io.report import BadFrameReport, Report


@dataclass(frozen=True)
class LeftOut:
    """frames : by number.  bridged : whether their mesh moves from the frame before to the one after; otherwise the one before is held."""

    frames: tuple[BadFrameReport, ...] = ()
    bridged: bool = True

    @classmethod
    def of(cls, bad: tuple[BadFrame, ...], numbers: tuple[int, ...], bridged: bool) -> LeftOut:
        """numbers : of all frames of the take."""
        entries = [
            BadFrameReport(numbers[one.index], one.reason, tuple(one.place.tolist()), numbers[one.before], numbers[one.after], bridged)
            for one in bad
        ]
        return cls(tuple(entries), bridged)

    def advice(self, number: int) -> str:
        """What an error says of a frame that is not part of the job, if it is a bad one; otherwise nothing."""
        bad = next((one for one in self.frames if one.frame == number), None)
        return "" if bad is None else f"; {bad.reason} in frame {number}: take {bad.before} or {bad.after}, or --bad-frames fit"

    def report(self, report: Report, warn: Callable[[str], None]) -> None:
        """Puts the frames into the report, with a warning for each run of them."""
        report.bad_frames = list(self.frames)
        for before in dict.fromkeys(one.before for one in self.frames):
            own = [one for one in self.frames if one.before == before]
            first = own[0]
            which = f"frame {first.frame}" if len(own) == 1 else f"frames {first.frame}-{own[-1].frame}"
            where = "({:.4g}, {:.4g}, {:.4g})".format(*first.position)
            away = f"left out, and another mesh begins with frame {first.after}"
            what = f"bridged from frames {first.before} and {first.after}" if self.bridged else away
            warn(f"{which}: {first.reason}, about {where}; {what} (--bad-frames)")
