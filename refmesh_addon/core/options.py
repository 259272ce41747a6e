"""How a setting is declared and checked: a dataclass field with its range or choices, help text and label."""

from __future__ import annotations

from dataclasses import Field, field, fields

from .errors import RefMeshError


def option(
    default,
    help: str,
    *,
    low=None,
    high=None,
    choices: dict[str, str] | None = None,
    titles: dict[str, str] | None = None,
    label: str | None = None,
    manual: int | None = None,
):
    """A dataclass field with what a panel or a command line needs to show it.

    low, high : inclusive bounds of a number.  choices : name -> one-line explanation.
    titles : name -> how the panel writes it, where that is not the name itself.  label : as the panel shows the setting.
    manual : of a number that is chosen automatically where it is 0: what it begins with when a person sets it.
    """
    texts = {"help": help, "choices": choices, "titles": titles or {}, "label": label}
    return field(default=default, metadata={"low": low, "high": high, "manual": manual, **texts})


def title(name: str) -> str:
    """ "group_size" as the panel writes it: "Group Size"."""
    return name.replace("_", " ").title()


def label_of(item: Field) -> str:
    """The name of a setting as the panel shows it."""
    return item.metadata["label"] or title(item.name)


def value_label(item: Field, value: object) -> str:
    """The value of a setting as the panel shows it."""
    if item.metadata["choices"] is not None:
        return item.metadata["titles"].get(value, title(str(value)))
    if item.metadata["manual"] is not None and not value:
        return "Auto"
    return "empty" if value == "" else str(value)


def check_value(item: Field, value: object) -> None:
    """Raises RefMeshError, naming the option, for a value that the setting does not take."""
    choices, low, high = item.metadata["choices"], item.metadata["low"], item.metadata["high"]
    flag = "--" + item.name.replace("_", "-")
    if choices is not None:
        if value not in choices:
            raise RefMeshError(f"{flag} is '{value}': choose one of {', '.join(choices)}")
    elif isinstance(item.default, str):
        if not isinstance(value, str) or "\0" in value:
            raise RefMeshError(f"{flag} is {value!r}: give text")
    else:
        integer = isinstance(item.default, int)
        number = isinstance(value, int if integer else (int, float)) and not isinstance(value, bool)
        if not number or not low <= value <= high:
            raise RefMeshError(f"{flag} is {value}: give a {'whole number' if integer else 'number'} from {low} to {high}")


class StageSettings:
    """Base of the settings of a stage: refuses unknown choices as soon as they are built, not only in `Settings.from_flat`."""

    def __post_init__(self):
        for item in fields(self):  # type: ignore[arg-type]  # only dataclasses derive from this
            if item.metadata["choices"] is not None:
                check_value(item, getattr(self, item.name))
