"""Arguments of the package's own functions, checked at the call: an error says the function, the parameter and what is right."""

import math
import operator
import os
import reprlib
import sys
from collections.abc import Mapping

from . import _rayfold

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 60


def shown(value):
    """A value as a message shows it, cut if it is long."""
    return _SHORT.repr(value)


def text(call, name, value, example):
    if isinstance(value, str):
        try:
            value.encode()
        except UnicodeEncodeError:
            raise ValueError(f"{call}(): {name} holds half of a surrogate pair, which is no character") from None
        return value
    raise TypeError(f"{call}(): {name} is a text such as {example}, not {shown(value)}")


def path(call, name, value):
    """The path as text."""
    try:
        place = os.fsdecode(value)
        os.fsencode(place)
    except UnicodeError:
        raise ValueError(f"{call}(): {name} is a path, not {shown(value)}") from None
    except (TypeError, ValueError):
        raise TypeError(f"{call}(): {name} is a path, not {shown(value)}") from None
    if not place or "\0" in place:
        raise ValueError(f"{call}(): {name} is a path, not {shown(value)}")
    return place


def is_bool(value):
    """Whether a value is True or False, of Python or NumPy."""
    # Who has one of NumPy has imported it.
    numpy = sys.modules.get("numpy")
    return isinstance(value, bool) or numpy is not None and isinstance(value, numpy.bool_)


def flag(call, name, value):
    if is_bool(value):
        return bool(value)
    raise TypeError(f"{call}(): {name} is True or False, not {shown(value)}")


def whole(call, name, value, low, high=2**63 - 1):
    """A whole number, also one of NumPy."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{call}(): {name} is a whole number from {low}, not {shown(value)}") from None
    if is_bool(value):
        raise TypeError(f"{call}(): {name} is a whole number from {low}, not {value}")
    if not low <= number <= high:
        bounds = f"from {low}" if high == 2**63 - 1 else f"from {low} to {high}"
        raise ValueError(f"{call}(): {name} is a whole number {bounds}, not {shown(value)}")
    return number


def number(call, name, value):
    """A finite number, of Python or NumPy."""
    if isinstance(value, (str, bytes, bytearray)):
        raise TypeError(f"{call}(): {name} is a number, not {shown(value)}")
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{call}(): {name} is a number, not {shown(value)}") from None
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise ValueError(f"{call}(): {name} is a finite number, not {shown(value)}")
    return found


def playback(call, fps, loop, bounce, seconds):
    """The bounds of an animation are the language's: said at the call, and not when it is saved."""
    try:
        _rayfold.settings_text(None, fps, max(loop, 0), bounce, seconds, "gif")
    except ValueError as error:
        raise ValueError(f"{call}(): {error}") from None


def iterable(call, name, value, what):
    """An iterator of what a caller hands over in order."""
    if not isinstance(value, (str, bytes, bytearray, memoryview, Mapping)):
        try:
            return iter(value)
        except TypeError:
            pass
    raise TypeError(f"{call}(): {name} is {what}, not {shown(value)}")


def durations(call, name, value):
    """Seconds by the numbers of frames."""
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise TypeError(f"{call}(): {name} is a dict of seconds by the numbers of frames, not {shown(value)}")
    return {
        whole(call, f"a frame of {name}", frame, 1): number(call, f"{name}[{shown(frame)}]", seconds)
        for frame, seconds in value.items()
    }
