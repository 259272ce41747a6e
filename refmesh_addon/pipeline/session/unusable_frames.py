"""What is said of frames that cannot be used, and how the job runs without them."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.errors import RefMeshError
from ...io.frame_range import format_ranges, format_selection
from ...io.sequence import Sequence

BRIDGED = "the resulting mesh moves on over a few missing frames"


def with_remedy(reason: str, option: str = "--frames") -> str:
    """Why a frame cannot be used, and what to do.  option : the one that leaves it out."""
    remedy = f"export this frame again, or leave it out with {option}: {BRIDGED}"
    return f"{reason} E{remedy[1:]}" if reason.endswith("?") else f"{reason}; {remedy}"


def unusable_frames(errors: Mapping[int, RefMeshError], sequence: Sequence) -> RefMeshError:
    """One error for all frames that cannot be used, with the option that leaves them out, so that a run need not fail for each in turn.

    errors : index of the frame -> why, with the file; at least one.
    """
    numbers = sequence.numbers
    first, unusable = min(errors), sorted(numbers[index] for index in errors)
    rest = [number for number in numbers if number not in unusable]
    if not rest:
        return RefMeshError(f"{errors[first]}; none of the {len(numbers)} frames can be used" if len(numbers) > 1 else str(errors[first]))
    option = f"--frames {format_selection(rest, numbers)}"
    if len(unusable) == 1:
        return RefMeshError(with_remedy(str(errors[first]), option))
    others = f"{len(unusable)} of {len(numbers)} frames cannot be used: {format_ranges(unusable, numbers)}"
    return RefMeshError(f"{others}; export them again, or leave them out with {option}: {BRIDGED}. The first: {errors[first]}")
