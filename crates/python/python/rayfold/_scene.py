"""Scenes: a method for each command of the language, made from its table."""

import os

from . import _arguments, _rayfold

METHODS = _rayfold.methods()
SETTINGS = frozenset(_rayfold.settings())


class Scene(_rayfold.Script):
    """A scene: its commands in order, as a script has them.

    `Scene(640, 360)` sets the size of the picture. Each command of the scene language that sets something may be a keyword:
    `samples=64`, `samples=(64, 1)`, `background="#204080"`. A tuple holds the arguments of the command, a dict its keywords.
    """

    def __init__(self, width=None, height=None, **settings):
        if width is not None or height is not None:
            self.screen(width, height)
        for name, value in settings.items():
            if name not in SETTINGS:
                raise TypeError(f"Scene() has no parameter {name!r}; its keywords are {', '.join(sorted(SETTINGS))}")
            if value is None:
                continue
            method = getattr(self, name)
            if isinstance(value, dict):
                if not all(isinstance(key, str) for key in value):
                    raise TypeError(f"Scene(): {name} as a dict has the parameters of {name}() by name, not {value!r}")
                method(**value)
            elif isinstance(value, tuple) and not _is_first_argument(name, value):
                method(*value)
            else:
                method(value)

    def copy(self):
        """Returns a copy, to which other commands can be added."""
        other = Scene()
        other._assign(self)
        return other

    __copy__ = copy

    def __deepcopy__(self, _memo):
        return self.copy()

    def __reduce__(self):
        # Text, name and files in memory are all that there is.
        return _read, (str(self), self._name, self._given)

    def render(self, frame=1, *, linear=False):
        """Draws a frame, counted from 1.

        Returns an array of height x width x 3: levels from 0 to 255 as `uint8`, or with `linear` the light before `tone` and
        rounding, from 0 to 1, as `float32`. A scene with `background("none")` has a fourth channel, alpha; `linear` light is
        premultiplied by it.
        """
        from ._picture import picture_of

        linear = _arguments.flag("render", "linear", linear)
        return picture_of(self._draw("render", frame, linear), linear)

    def save(self, path, frame=1):
        """Draws a frame and writes it as PNG; or writes the script, for a path that ends in `.txt`."""
        path = _arguments.path("save", "path", path)
        if path.lower().endswith(".txt"):
            put_files([self._files()], os.path.dirname(path) or ".")
            _rayfold.write_file(path, str(self).encode())
        elif path.lower().endswith(".png"):
            _rayfold.write_file(path, self._draw("save", frame).png())
        else:
            raise ValueError(f"save(): path {_arguments.shown(path)} does not say what it is: expected .png, or .txt for the script")

    def _draw(self, call, frame, linear=False):
        frame = _arguments.whole(call, "frame", frame, 1)
        if frame > self.frame_count:
            raise IndexError(f"{call}(): frame is from 1 to {self.frame_count}, the last one, not {frame}")
        ahead = _rayfold.Ahead()
        ahead.start(self, frame - 1, linear)
        return ahead.take()

    def _repr_png_(self):
        return self._draw("render", 1).png()


class Group:
    """An open group: `with scene.group("leg"):` ends it after the block."""

    def __init__(self, scene):
        self._scene = scene

    def __enter__(self):
        return self._scene

    def __exit__(self, kind, _value, _traceback):
        if kind is None:
            self._scene.end()
        return False


def put_files(files_of_scenes, folder):
    """Copies and writes the files of scenes into a folder: for each scene its own folder, the names of the files in it, and
    the files in memory."""
    copied, written = {}, {}
    for own, names, given in files_of_scenes:
        copied.update(dict.fromkeys((own, name) for name in names))
        written.update({file.name: file for file in given})
    for own, name in copied:
        source, target = os.path.join(own, name), os.path.join(folder, name)
        if os.path.exists(source) and not (os.path.exists(target) and os.path.samefile(source, target)):
            import shutil

            shutil.copyfile(source, target)
    for file in written.values():
        file.write(folder)


def _read(text, name, given=()):
    # While the text is read, `given` holds the files that it names.
    scene = Scene()
    scene._read(text, name)
    return scene


def parse(text, name="scene"):
    """Makes a scene of a script's text. Commands that are added belong to its last frame."""
    text = _arguments.text("parse", "text", text, "that of a script")
    name = _arguments.text("parse", "name", name, "'scene'")
    return _read(text, name)


def _is_first_argument(name, value):
    """Whether a tuple is a vector, the first argument of a command, rather than all of its arguments."""
    _, parameters, _ = METHODS[INDEX[name]]
    return len(value) == parameters[0][2] > 1 and not any(
        isinstance(number, (str, tuple, list)) or hasattr(number, "__len__") for number in value
    )


def _signature(name, parameters, has_clauses):
    """A function with the parameters of a method, which `help` shows. The method itself hands over all at once."""
    listed = ["self", "/"]
    is_optional = False
    for parameter, is_required, _ in parameters:
        is_optional |= not is_required
        listed.append(f"{parameter}=None" if is_optional else parameter)
    if has_clauses:
        listed += ["*", *(f"{clause}=None" for clause, _ in _rayfold.clauses())]
    # To make a signature takes the module `inspect`, which is imported as long as all of this package.
    made = {}
    exec(f"def {name}({', '.join(listed)}): ...", made)
    return made[name]


def _method(index, name, parameters, has_clauses):
    add = _rayfold.Script._add

    if name == "group":

        def method(self, *args, **kwargs):
            add(self, index, args, kwargs)
            return Group(self)

    elif name == "mesh":

        def method(self, *args, **kwargs):
            from . import _arrays

            if _arrays.is_of_arrays(args, kwargs):
                file, kwargs = _arrays.mesh_of(args, kwargs)
                args = (file,)
            return add(self, index, args, kwargs)

    else:

        def method(self, *args, **kwargs):
            return add(self, index, args, kwargs)

    method.__name__ = name
    method.__qualname__ = f"Scene.{name}"
    method.__doc__ = _rayfold.method_doc(index)
    method.__module__ = "rayfold"
    method.__wrapped__ = _signature(name, parameters, has_clauses)
    return method


class _Unmade:
    """A method that is made when it is first asked for, so that the package is imported soon."""

    def __init__(self, index):
        self._index = index

    def __get__(self, scene, owner):
        name, *rest = METHODS[self._index]
        method = _method(self._index, name, *rest)
        setattr(Scene, name, method)
        return method.__get__(scene, owner)


INDEX = {}
for _index, (_name, *_rest) in enumerate(METHODS):
    INDEX[_name] = _index
    setattr(Scene, _name, _Unmade(_index))
Scene.__module__ = "rayfold"
