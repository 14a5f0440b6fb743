"""Meshes and pictures from arrays: checked at the call, and handed over as files in memory."""

import os
from collections.abc import Mapping, Set

import numpy as np

from . import _rayfold
from ._arguments import shown

#: The bounds of the program, which refuses larger files.
TRIANGLES, PIXELS, FILE_BYTES = _rayfold.limits()
VERTICES = 3 * TRIANGLES

#: The parameters of `mesh` for arrays, in order.
ATTRIBUTES = ("vertices", "faces", "normals", "colors", "uv")
PARAMETERS = (*ATTRIBUTES, "material", "smooth", "flat")


def is_of_arrays(args, kwargs):
    """Whether a call of `mesh` has arrays, and not the name of a file."""
    if not kwargs.keys().isdisjoint(ATTRIBUTES):
        return True
    return bool(args) and args[0] is not None and not isinstance(args[0], (str, bytes, os.PathLike, _rayfold.Given))


def mesh_of(args, kwargs):
    """The file of the arrays of a call of `mesh`, and the other arguments."""
    if len(args) > len(PARAMETERS):
        raise TypeError(f"mesh() takes {len(PARAMETERS)} arguments at most, not {len(args)}: ({', '.join(PARAMETERS)})")
    given = dict(zip(PARAMETERS, args))
    for name, value in kwargs.items():
        if name in given:
            raise TypeError(f"mesh() got two values for {name}")
        given[name] = value
    if given.get("file") is not None or isinstance(given.get("vertices"), (str, os.PathLike)):
        raise TypeError("mesh() takes either file, or vertices and faces as arrays")
    given.pop("file", None)
    arrays = {name: given.pop(name, None) for name in ATTRIBUTES}
    for name in ATTRIBUTES[:2]:
        if arrays[name] is None:
            raise TypeError(f"mesh() lacks {name}: an array of {'(x, y, z)' if name == 'vertices' else 'three indices'} a row")
    return mesh_file(**arrays), given


def mesh_file(vertices, faces, normals=None, colors=None, uv=None):
    vertices = numbers("vertices", rows_of("vertices", vertices, "(x, y, z)", (3,), VERTICES), None)
    count = len(vertices)
    faces = indices_of(faces, count)
    normals = None if normals is None else numbers("normals", attribute("normals", normals, "(x, y, z)", (3,), count), "<f4")
    colors = None if colors is None else colors_of(colors, count)
    uv = None if uv is None else numbers("uv", attribute("uv", uv, "(u, v)", (2,), count), "<f4")
    columns = [array for array in (vertices, normals, colors, uv) if array is not None]
    size = sum(array.nbytes for array in columns) + faces.nbytes + len(faces)
    if size > FILE_BYTES - 4096:
        raise ValueError(
            f"mesh(): {count} vertices and {len(faces)} faces take {size >> 20} MiB: a mesh has at most {FILE_BYTES >> 20} MiB"
            + (", of which vertices of float32 take half as much" if vertices.dtype.itemsize == 8 else "")
        )
    check_area(vertices, faces)
    return _rayfold.mesh_file(packed(vertices), faces.tobytes(), faces.shape[1], packed(normals), packed(colors), packed(uv))


def packed(array):
    """The type and the bytes of an array."""
    return None if array is None else (array.dtype.str[1:], array.tobytes())


def array_of(place, value, what):
    """The value as an array of numbers, as it stands."""
    if isinstance(value, (str, bytes, bytearray, Mapping, Set)) or isinstance(value, (int, float, complex, np.generic, type(None))):
        raise TypeError(f"{place} is an array of {what}, not {shown(value)}")
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        row = int(np.argwhere(np.ma.getmaskarray(value))[0][0])
        raise ValueError(f"{place}[{row}] is masked: expected an array of {what} without gaps")
    if not is_array_like(value):
        check_sequence(place, value, what)
    try:
        array = np.asarray(value)
    except OverflowError:
        raise ValueError(f"{place} holds a number of more than 64 bits: expected an array of {what}") from None
    except (TypeError, ValueError) as error:
        raise TypeError(f"{place} is an array of {what}, not {shown(value)}: {error}") from None
    if array.ndim == 0:
        raise TypeError(f"{place} is an array of {what}, not {shown(value)}")
    return array


def is_array_like(value):
    """Whether an object is an array, or a buffer of one."""
    if hasattr(value, "__array__") or hasattr(value, "__array_interface__"):
        return True
    try:
        return memoryview(value).ndim > 0
    except TypeError:
        return False


def check_sequence(place, value, what):
    """Refuses what has no rows, before it is read as a whole: a range has as many numbers as it likes."""
    try:
        count = len(value)
        first = value[0] if count else ()
    except TypeError:
        raise TypeError(f"{place} is an array of {what}, not {shown(value)}") from None
    except (IndexError, KeyError):
        raise ValueError(f"{place} has no rows: expected an array of {what}") from None
    if count and not hasattr(first, "__len__") or isinstance(first, (str, bytes, Mapping, Set)):
        raise TypeError(f"{place}[0] is {shown(first)}: expected a row of {what}")
    width = len(first)
    for row, item in enumerate(value):
        if not hasattr(item, "__len__") or len(item) != width:
            raise ValueError(f"{place}[{row}] is {shown(item)}, but row 0 has {width} numbers: expected {what} in each row")


def rows_of(name, value, what, widths, most):
    """An array of two dimensions with rows of one of the widths. None of its numbers is looked at."""
    place = f"mesh(): {name}"
    array = array_of(place, value, what)
    shape = " or ".join(f"(n, {width})" for width in widths)
    if array.ndim == 1 and array.size == 0 or array.ndim == 2 and len(array) == 0:
        raise ValueError(f"{place} is empty: expected at least one row of {what}")
    if array.ndim != 2 or array.shape[1] not in widths:
        raise ValueError(f"{place} has the shape {array.shape}: expected {shape}, a row of {what} each")
    if len(array) > most:
        raise ValueError(f"{place} has {len(array)} rows: expected at most {most}")
    return array


def attribute(name, value, what, widths, count):
    """An array with a row for each vertex."""
    array = rows_of(name, value, what, widths, VERTICES)
    if len(array) != count:
        raise ValueError(f"mesh(): {name} has {len(array)} rows: expected {count}, one for each vertex")
    return array


def checked_type(place, array, kinds, expected):
    if array.dtype.kind in kinds:
        return
    if array.dtype.kind == "O":
        for index, item in np.ndenumerate(array):
            if isinstance(item, bool) or not hasattr(item, "__float__"):
                raise TypeError(f"{place}{list(index)} is {shown(item)}: expected {expected}")
        raise TypeError(f"{place} has the type object: expected {expected}")
    raise TypeError(f"{place} has the type {array.dtype}: expected {expected}")


def numbers(name, array, type):
    """The array as finite numbers, in the order of the file's bytes. Without a type it keeps its precision."""
    place = f"mesh(): {name}"
    checked_type(place, array, "fiu", "float32, float64 or integers")
    if type is None:
        type = "<f4" if array.dtype.kind == "f" and array.dtype.itemsize <= 4 else "<f8"
    with np.errstate(all="ignore"):
        found = array.astype(type, copy=False)
    finite = np.isfinite(found)
    if not finite.all():
        row = int(np.argmin(finite.all(axis=1)))
        fault = "expected finite numbers"
        if np.isfinite(array[row]).all():
            fault += f" of {8 * found.dtype.itemsize} bits, at most {np.finfo(type).max:.3g}"
        raise ValueError(f"{place}[{row}] is {shown_row(array[row])}: {fault}")
    return found


def indices_of(value, count):
    place = "mesh(): faces"
    array = rows_of("faces", value, "three indices of vertices", (3, 4), TRIANGLES)
    if len(array) * (array.shape[1] - 2) > TRIANGLES:
        raise ValueError(f"{place} has {len(array)} rows of 4, twice as many triangles: expected at most {TRIANGLES} triangles")
    checked_type(place, array, "iu", "integers, the indices of vertices from 0")
    if array.min() < 0 or array.max() >= count:
        row = int(np.argmax(((array < 0) | (array >= count)).any(axis=1)))
        raise ValueError(f"{place}[{row}] is {shown_row(array[row])}: expected indices from 0 to {count - 1}, for {count} vertices")
    return array.astype("<u4", copy=False)


def colors_of(value, count):
    place = "mesh(): colors"
    array = attribute("colors", value, "(red, green, blue)", (3, 4), count)
    expected = "uint8 from 0 to 255, uint16, or floats from 0 to 1"
    checked_type(place, array, "fiu", expected)
    if array.dtype.kind == "f":
        most = 1
    elif array.dtype in (np.uint8, np.uint16):
        most = np.iinfo(array.dtype).max
    elif array.min() >= 0 and array.max() <= 1:
        array, most = array.astype(np.float32), 1
    else:
        row = int(np.argmax(((array < 0) | (array > 1)).any(axis=1)))
        raise ValueError(f"{place}[{row}] is {shown_row(array[row])}, of the type {array.dtype}: expected {expected}")
    right = (array >= 0) & (array <= most)
    if not right.all():
        row = int(np.argmin(right.all(axis=1)))
        raise ValueError(f"{place}[{row}] is {shown_row(array[row])}: expected channels from 0 to {most}")
    if array.shape[1] == 4:
        clear = array[:, 3] < most
        if clear.any():
            row = int(np.argmax(clear))
            raise ValueError(f"{place}[{row}] has the alpha {array[row, 3]}: expected {most}, for the faces of a mesh are opaque")
        array = array[:, :3]
    return array.astype({"f": "<f4", "u": f"<u{array.dtype.itemsize}"}[array.dtype.kind], copy=False)


def check_area(vertices, faces):
    """Refuses a mesh whose faces are all points and lines. Mostly the first faces say that it is none."""
    for start in range(0, len(faces), 4096):
        corners = vertices[faces[start : start + 4096]].astype(np.float64)
        for last in range(2, faces.shape[1]):
            a, b, c = corners[:, 0], corners[:, last - 1], corners[:, last]
            # As the program decides it: free of the size of the mesh.
            largest = np.abs(np.stack([a, b, c])).max(axis=(0, 2), initial=0)[:, None]
            a, b, c = (np.divide(p, largest, out=np.zeros_like(p), where=largest > 0) for p in (a, b, c))
            p, q = unit(b - a), unit(c - a)
            if (np.abs(np.cross(p, q)).max(axis=1) > 4e-16).any():
                return
    raise ValueError(f"mesh(): none of the {len(faces)} faces has an area: the vertices of each are in one place or on one line")


def unit(vectors):
    largest = np.abs(vectors).max(axis=1)[:, None]
    return np.divide(vectors, largest, out=np.zeros_like(vectors), where=largest > 0)


def shown_row(row):
    return f"({', '.join(str(number) for number in row)})"


def picture(place, value):
    """The file of an array of levels, for the pattern `image`; None for what is no array."""
    array = pixels_of(place, value)
    if array is None:
        return None
    if array.dtype.kind == "f":
        check_pixels(place, array, (array >= 0) & (array <= 1), "expected floats from 0 to 1, or uint8 or uint16")
        array = np.round(array.astype(np.float64, copy=False) * 65535).astype(np.uint16)
    return levels_file(array)


def sky(place, value):
    """The file of an array for `sky_picture`: floats are light, integers levels; None for what is no array."""
    array = pixels_of(place, value)
    if array is None:
        return None
    if array.dtype.kind != "f":
        return levels_file(array)
    with np.errstate(all="ignore"):
        light = array.astype("<f4", copy=False)
    check_pixels(place, array, np.isfinite(light) & (array >= 0), "expected finite light from 0")
    # A sky has no alpha.
    light = np.repeat(light, 3, axis=2) if light.shape[2] == 1 else light[:, :, :3]
    height, width = light.shape[:2]
    if 12 * height * width > FILE_BYTES - 4096 - 16 * height:
        raise ValueError(f"{place} has {width} x {height} pixels of floats: a picture has at most {FILE_BYTES >> 20} MiB")
    return _rayfold.light_file(width, height, light.tobytes())


def pixels_of(place, value):
    """An array of height x width x 1, 3 or 4."""
    if isinstance(value, (str, bytes, bytearray, Mapping, Set)) or not is_array_like(value) and not isinstance(value, (list, tuple)):
        return None
    array = array_of(place, value, "pixels")
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or array.shape[2] not in (1, 3, 4) or array.size == 0:
        raise ValueError(
            f"{place} has the shape {np.shape(value)}: expected (height, width), (height, width, 1), (height, width, 3) or"
            " (height, width, 4)"
        )
    if array.shape[0] * array.shape[1] > PIXELS:
        raise ValueError(f"{place} has {array.shape[1]} x {array.shape[0]} pixels: expected at most {PIXELS}")
    if array.dtype.kind != "f" and array.dtype not in (np.uint8, np.uint16):
        checked_type(place, array, "", "uint8, uint16 or floats")
    return array


def check_pixels(place, array, right, expected):
    if right.all():
        return
    row, column = np.argwhere(~right.all(axis=2))[0]
    raise ValueError(f"{place}[{row}, {column}] is {shown_row(array[row, column])}: {expected}")


def levels_file(array):
    size = array.dtype.itemsize
    height, width, channels = array.shape
    levels = array.astype(f"<u{size}", copy=False).tobytes()
    return _rayfold.levels_file(width, height, channels, 8 * size, levels)
