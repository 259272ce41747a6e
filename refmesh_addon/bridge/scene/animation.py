"""Keyframes of single properties; those of other properties, which a person may have added, stay."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

Span = tuple[int | None, int | None]


def key_only_between(target: bpy.types.Object, attribute: str, span: Span, inside: object, outside: object) -> None:
    """Keyframes an attribute as `key_between` does, in place of other keyframes of it; does nothing where they are the same already."""
    required = [(float(frame), float(value)) for frame, value in _keys(span, inside, outside)]
    present = [tuple(point.co) for curve in _curves(target, attribute) for point in curve.keyframe_points]
    if present == required:
        return
    for curve in list(_curves(target, attribute)):
        _remove(target, curve)
    key_between(target, attribute, span, inside, outside)


def key_between(target: bpy.types.Object | bpy.types.ShapeKey, attribute: str, span: Span, inside: object, outside: object) -> None:
    """Keyframes an attribute to `inside` from scene frame `span[0]` up to, not including, `span[1]`; None is unbounded.

    Keys are on consecutive frames, so that the interpolation mode does not matter.
    """
    setattr(target, attribute, inside)
    for scene_frame, value in _keys(span, inside, outside):
        setattr(target, attribute, value)
        target.keyframe_insert(attribute, frame=scene_frame)


def key_peak(target: bpy.types.ShapeKey, attribute: str, span: Span, at: int) -> None:
    """Keyframes an attribute to 1 in frame `at`, and to 0 in the frames of the span; None is unbounded, where it holds its 1."""
    for scene_frame, value in ((span[0], 0.0), (at, 1.0), (span[1], 0.0)):
        if scene_frame is not None:
            setattr(target, attribute, value)
            target.keyframe_insert(attribute, frame=scene_frame)


def make_linear(holder: bpy.types.Key) -> None:
    """Gives all keyframes linear interpolation, whatever the preferences say of new ones."""
    for curves in _holders(holder):
        for point in (point for curve in curves for point in curve.keyframe_points):
            point.interpolation = "LINEAR"


def keep_only_modifiers(target: bpy.types.Object) -> None:
    """Gives a copy of an object an action of its own, with the keyframes of modifiers alone."""
    data = target.animation_data
    if data is None or data.action is None:
        return
    slot = getattr(data, "action_slot", None)
    identifier = slot.identifier if slot else ""
    data.action = data.action.copy()
    if identifier:
        data.action_slot = data.action.slots[identifier]
    for holder in _holders(target):
        for curve in [curve for curve in holder if not curve.data_path.startswith("modifiers")]:
            holder.remove(curve)


def _keys(span: Span, inside: object, outside: object) -> list[tuple[int, object]]:
    first, end = span
    keys = [(first - 1, outside), (first, inside)] if first is not None else []
    return keys + ([(end - 1, inside), (end, outside)] if end is not None else [])


def _curves(target: bpy.types.Object, attribute: str) -> Iterator[bpy.types.FCurve]:
    for holder in _holders(target):
        yield from (curve for curve in holder if curve.data_path == attribute)


def _remove(target: bpy.types.Object, curve: bpy.types.FCurve) -> None:
    for holder in _holders(target):
        if any(candidate == curve for candidate in holder):
            holder.remove(curve)
            return


def _holders(target: bpy.types.Object | bpy.types.Key) -> list:
    """The lists of curves of an object's action: one for each strip of its slot, the action's own before Blender 4.4."""
    data = target.animation_data
    if data is None or data.action is None:
        return []
    if not hasattr(data, "action_slot"):
        return [data.action.fcurves]
    bags = [strip.channelbag(data.action_slot) for layer in data.action.layers for strip in layer.strips] if data.action_slot else []
    return [bag.fcurves for bag in bags if bag is not None]
