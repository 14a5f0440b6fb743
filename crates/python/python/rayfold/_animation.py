"""Animations: scenes in order, drawn ahead and encoded one by one."""

import base64
import math
import os
import re
from collections.abc import Sequence

import numpy as np

from . import _rayfold
from ._picture import image_of, picture_of
from ._scene import Scene, parse

FORMATS = ("gif", "apng", "webp")
PATTERN = re.compile(r"%(\d*)d")


class Animation:
    """Frames in order, and how they are shown. `animation` and `load` make one."""

    def __init__(self, scenes, frames, fps, loop, bounce, durations):
        self._scenes = scenes
        self._count = frames
        self._used = False
        self._shown = None
        self.fps = fps
        self.loop = loop
        self.bounce = bounce
        self.durations = dict(durations or {})
        # The bounds are the language's: said now, and not when it is saved.
        _rayfold.settings_text(None, fps, max(loop, 0), bounce, self.durations)
        if loop < -1:
            raise ValueError(f"loop is the number of repetitions, 0 for endless or -1 for once, not {loop}")

    def __len__(self):
        if self._length() is None:
            raise TypeError("the animation is made of an iterator, whose length is not known: give frames=")
        return self._length()

    def __iter__(self):
        return (scene for scene, frame in self._jobs() if frame == 0)

    def __getitem__(self, index):
        scenes = self._listed()
        if callable(self._scenes):
            index = range(self._count)[index]
            return _called(self._scenes, index, self.fps)
        return scenes[index]

    def __repr__(self):
        length = self._length()
        return f"<rayfold.Animation: {'?' if length is None else length} frames, {self.fps:g} fps>"

    def frames(self, *, progress=True, linear=False):
        """Draws the frames, ahead within a bound on memory, and yields them in order."""
        for image in self._drawn(progress, linear):
            yield picture_of(image, linear)

    def gif(self, *, progress=True, exact=False):
        """Returns the animation as a GIF file."""
        return self._encode(None, "gif", progress, exact)

    def save(self, path, *, progress=True, exact=False):
        """Writes the animation.

        The ending of `path` decides: `.gif`, `.apng` or `.webp`; `.png` with a number such as `%04d` for a file for each
        frame; a folder (`film/`, or one that is there) for scripts, which `rayfold render` draws.
        """
        path = os.fspath(path)
        ending = path.rpartition(".")[2].lower()
        if os.path.isdir(path) or path.endswith(("/", os.sep)):
            self._save_scripts(path)
        elif ending in FORMATS:
            self._encode(path, ending, progress, exact)
        elif ending == "png" and len(PATTERN.findall(os.path.basename(path))) == 1:
            self._save_pictures(path, progress)
        elif ending == "png":
            raise ValueError(f"{path!r} is one file: expected a number in its name, such as frames/%04d.png")
        else:
            raise ValueError(
                f"cannot tell what {path!r} should be: expected .gif, .apng or .webp, frames/%04d.png, or a folder such as film/"
            )

    def _repr_mimebundle_(self, include=None, exclude=None):
        if self._shown is None:
            self._shown = self._encode(None, "gif", True, False)
        data = base64.b64encode(self._shown).decode()
        return {"text/html": f'<img src="data:image/gif;base64,{data}">', "text/plain": repr(self)}

    def _repr_html_(self):
        return self._repr_mimebundle_()["text/html"]

    def _listed(self):
        """The scenes, if they can be asked for again."""
        if not callable(self._scenes) and not isinstance(self._scenes, Sequence):
            raise TypeError("the animation is made of an iterator, whose scenes are seen once: give a list")
        return self._scenes

    def _length(self):
        if callable(self._scenes):
            return self._count
        if isinstance(self._scenes, Sequence):
            total = sum(scene.frame_count for scene in self._scenes)
            return total if self._count is None else min(total, self._count)
        return self._count

    def _shown_length(self):
        length = self._length()
        return length and length + (max(length - 2, 0) if self.bounce else 0)

    def _ordered(self):
        """The scenes in order, each checked to be one."""
        if callable(self._scenes):
            for index in range(self._count):
                yield _called(self._scenes, index, self.fps)
            return
        if not isinstance(self._scenes, Sequence):
            if self._used:
                raise ValueError("the iterator of scenes is used up: give a list or a function to use them again")
            self._used = True
        for scene in self._scenes:
            yield _checked(scene)

    def _jobs(self):
        """The scenes and the frames of each, counted from 0, as often as there are frames."""
        left = math.inf if self._count is None else self._count
        for scene in self._ordered():
            for frame in range(scene.frame_count):
                if left <= 0:
                    return
                left -= 1
                yield scene, frame

    def _shown_jobs(self):
        if not self.bounce:
            yield from self._jobs()
            return
        # Running back needs all scenes at once. Their scripts are small beside their pictures.
        jobs = list(self._jobs())
        yield from jobs
        yield from jobs[-2:0:-1]

    def _drawn(self, progress, linear=False):
        """Images in the order in which they are shown."""
        ahead = _rayfold.Ahead()
        with _Progress(progress) as bar:
            done, total = 0, self._shown_length()
            bar.at("frames", 0, total)
            try:
                for scene, frame in self._shown_jobs():
                    ahead.start(scene, frame, linear)
                    while ahead.is_full:
                        yield ahead.take()
                        done += 1
                        bar.at("frames", done, total)
                while not ahead.is_empty:
                    yield ahead.take()
                    done += 1
                    bar.at("frames", done, total)
            finally:
                ahead.stop()

    def _encode(self, path, format, progress, exact):
        times = self._times()
        if self._shown_length() is None and format == "apng":
            raise ValueError("an .apng begins with the number of its frames, which an iterator does not say: give frames=")
        encoder = None
        number = 0
        for image in self._drawn(progress):
            if encoder is None:
                encoder = _rayfold.Encoder(
                    path, format, image.size, self._shown_length(), self.fps, self.loop, None, exact
                )
                size = image.size
            if image.size != size:
                raise ValueError(
                    f"an animation has one size, but frame 1 is {size[0]} x {size[1]} and frame {number + 1} is"
                    f" {image.size[0]} x {image.size[1]}"
                )
            encoder.push(image, times.get(number))
            number += 1
        if encoder is None:
            raise ValueError("an animation needs at least one frame")
        return encoder.finish()[0]

    def _times(self):
        """The times of frames in seconds, by their place among those that are shown, from 0."""
        if not self.durations:
            return {}
        length = len(self)
        times = {}
        for frame, seconds in self.durations.items():
            if not 1 <= frame <= length:
                raise ValueError(f"frame {frame} has a duration, but there are {length} frames")
            times[frame - 1] = seconds
            if self.bounce and 1 < frame < length:
                times[2 * (length - 1) - (frame - 1)] = seconds
        return times

    def _save_pictures(self, path, progress):
        folder = os.path.dirname(path)
        if folder:
            os.makedirs(folder, exist_ok=True)
        name = os.path.basename(path)
        digits = PATTERN.search(name)
        # Frames are written once, also if the animation shows them again on its way back.
        once = Animation(self._scenes, self._count, self.fps, self.loop, False, None)
        once._used, self._used = self._used, True
        for number, image in enumerate(once._drawn(progress), 1):
            shown = f"{number:0{digits[1] or 0}d}" if digits[1] else str(number)
            file = name[: digits.start()] + shown + name[digits.end() :]
            _rayfold.write_file(os.path.join(folder, file), image.png())

    def _scripts(self):
        """The name of each script, without `.txt`, and its text."""
        last = None
        number = 0
        for scene, _ in self._jobs():
            if scene is not last:
                last = scene
                number += 1
                yield f"{number:04d}", str(scene)

    def _settings(self, scripts):
        frames = sum(parse(text).frame_count for _, text in scripts)
        length = self._length()
        if length is not None and frames != length:
            raise ValueError(
                f"the scripts have {frames} frames, not {length}: a script is saved whole, so that `frames` cannot cut it"
            )
        if self.loop == -1:
            raise ValueError("animation.json cannot say that an animation is shown once: expected a loop from 0")
        return _rayfold.settings_text(frames, self.fps, self.loop, self.bounce, self.durations)

    def _save_scripts(self, folder):
        scripts = list(self._scripts())
        settings = self._settings(scripts)
        os.makedirs(folder, exist_ok=True)
        names = {f"{name}.txt" for name, _ in scripts}
        others = [file for file in os.listdir(folder) if file.endswith(".txt") and file not in names]
        if others:
            raise FileExistsError(
                f"{folder} holds other scripts, which would be frames too: {', '.join(sorted(others)[:5])}"
            )
        for name, text in scripts:
            _rayfold.write_file(os.path.join(folder, f"{name}.txt"), text.encode())
        _rayfold.write_file(os.path.join(folder, "animation.json"), settings.encode())


class _Progress:
    """A bar of `tqdm.auto`, if it is installed and wanted."""

    def __init__(self, wanted):
        self._bar = None
        self._what = None
        self._make = None
        if wanted:
            try:
                from tqdm.auto import tqdm

                self._make = tqdm
            except ImportError:
                pass

    def at(self, what, done, total):
        """Shows that `done` of `total` is done of a kind of thing."""
        if self._make is None:
            return
        if what != self._what:
            self.close()
            self._what = what
            self._bar = self._make(total=total, unit=f" {what}", leave=False)
        if total is not None and self._bar.total != total:
            self._bar.total = total
        self._bar.update(done - self._bar.n)

    def close(self):
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def animation(scenes, frames=None, fps=10, *, loop=0, bounce=False, durations=None):
    """Makes an animation of scenes.

    Parameters
    ----------
    scenes : callable, iterable of Scene, or Scene
        a function of the time in seconds, which is called `frames` times, with 0, 1/fps, 2/fps and so on; or the scenes in
        order. A scene with several frames (`frames`, `trace`) gives all of them.
    frames : int, optional
        the number of frames; an iterable is cut there.
    fps : float
        frames per second.
    loop : int
        repetitions, 0 for endless; -1 shows the animation once.
    bounce : bool
        whether the animation runs back after its last frame.
    durations : dict, optional
        times of frames in seconds, by the number of the frame from 1.
    """
    if isinstance(scenes, Scene):
        scenes = [scenes]
    elif callable(scenes):
        if frames is None:
            raise TypeError("animation() of a function needs frames, the number of times that it is called")
    elif isinstance(scenes, (str, bytes)) or not hasattr(scenes, "__iter__"):
        raise TypeError(f"animation() takes a function, scenes or a Scene, not {scenes!r}")
    elif isinstance(scenes, Sequence):
        scenes = [_checked(scene) for scene in scenes]
    else:
        scenes = iter(scenes)
    if frames is not None and (not isinstance(frames, (int, np.integer)) or frames < 1):
        raise ValueError(f"frames is a whole number from 1, not {frames!r}")
    return Animation(scenes, frames, fps, loop, bounce, durations)


def gif(images, fps=10, path=None, *, loop=0, exact=False):
    """Encodes arrays of height x width x 3 (`uint8`) as a GIF. Returns its bytes, or writes them to `path`.

    Arrays of height x width are greys. Frames are taken one by one: memory does not grow with their number.
    """
    encoder = None
    for number, array in enumerate(images, 1):
        image = image_of(array, f"frame {number}")
        if encoder is None:
            path = None if path is None else os.fspath(path)
            encoder = _rayfold.Encoder(path, "gif", image.size, None, fps, loop, None, exact)
        encoder.push(image, None)
    if encoder is None:
        raise ValueError("a GIF needs at least one frame")
    return encoder.finish()[0]


def load(path):
    """Reads a folder of scripts with its `animation.json`, or one script, as an animation."""
    path = os.fspath(path)
    scripts, (_, fps, loop, bounce, durations), not_read = _rayfold.read_folder(path)
    if not_read:
        import warnings

        from ._errors import SceneWarning

        for file in not_read:
            warnings.warn(file, SceneWarning, stacklevel=2)
    scenes = [parse(text, name) for name, text in scripts]
    return Animation(scenes, None, fps, loop, bounce, durations)


def _called(function, index, fps):
    return _checked(function(index / fps), f"the function returned for frame {index + 1}")


def _checked(scene, what="an animation is made of"):
    if not isinstance(scene, Scene):
        raise TypeError(f"expected a Scene, but {what} {scene!r}")
    return scene
