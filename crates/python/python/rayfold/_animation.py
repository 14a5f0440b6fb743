"""Animations: scenes in order, drawn ahead and encoded one by one."""

import math
import os
from collections.abc import Sequence

from . import _arguments, _rayfold
from ._scene import Scene, parse, put_files

FORMATS = ("gif", "apng", "webp")


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
        _arguments.playback("animation", fps, loop, bounce, self.durations)

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
        progress = _arguments.flag("frames", "progress", progress)
        linear = _arguments.flag("frames", "linear", linear)
        from ._picture import picture_of

        return (picture_of(image, linear) for image in self._drawn(progress, linear))

    def gif(self, *, progress=True, exact=False):
        """Returns the animation as a GIF file."""
        return self._encode("gif", None, "gif", progress, exact)

    def save(self, path, *, progress=True, exact=False):
        """Writes the animation.

        The ending of `path` decides: `.gif`, `.apng` or `.webp`; `.png` with a number such as `%04d` for a file for each
        frame; a folder (`film/`, or one that is there) for scripts, which `rayfold render` draws.
        """
        path = _arguments.path("save", "path", path)
        progress = _arguments.flag("save", "progress", progress)
        ending = path.rpartition(".")[2].lower()
        if os.path.isdir(path) or path.endswith(("/", os.sep)):
            self._save_scripts(path)
        elif ending in FORMATS:
            self._encode("save", path, ending, progress, exact)
        elif ending == "png" and len(_numbers_in(os.path.basename(path))) == 1:
            self._save_pictures(path, progress)
        elif ending == "png":
            raise ValueError(f"save(): path {_arguments.shown(path)} is one file: expected a number in its name, such as frames/%04d.png")
        else:
            raise ValueError(
                f"save(): path {_arguments.shown(path)} does not say what it is: expected .gif, .apng or .webp, frames/%04d.png, or a folder such"
                " as film/"
            )

    def submit(self, address, path=None, *, delete=False, wait=True, progress=True):
        """Renders the animation in a bucket, as `rayfold submit` does.

        Checks the scripts, uploads those that the bucket does not have, waits, and returns the GIF as bytes, or writes it to
        `path`. Region, credentials and endpoint come from the standard AWS environment. Ctrl-C loses nothing: the same call
        goes on.

        Parameters
        ----------
        address : str
            the bucket and the animation's name in it: `"s3://films/wave"`.
        path : str or path, optional
            the file to write: `.gif`, `.webp`, `.apng` or `.y4m`. The bucket then holds that file of the animation.
        delete : bool
            whether scripts of that name in the bucket that the animation does not have are deleted. Otherwise they are an
            error, and nothing is uploaded.
        wait : bool
            whether to wait for the GIF. Otherwise nothing is returned.
        progress : bool
            whether a bar of `tqdm` is shown, if it is installed.
        """
        address = _arguments.text("submit", "address", address, "'s3://films/wave'")
        delete = _arguments.flag("submit", "delete", delete)
        wait = _arguments.flag("submit", "wait", wait)
        progress = _arguments.flag("submit", "progress", progress)
        output = "gif"
        if path is not None:
            path = _arguments.path("submit", "path", path)
            output = os.path.splitext(path)[1].lower().removeprefix(".")
            if output not in ("gif", "webp", "apng", "y4m"):
                raise ValueError(
                    f"submit(): path is that of an animation, which ends in .gif, .webp, .apng or .y4m, not {_arguments.shown(path)}"
                )
            if not wait:
                raise ValueError("submit(): there is no file without waiting: expected either path or wait=False")
        scripts, settings = self._folder(has_one_size=True, output=output)
        texts = [(name, text) for name, text, _ in scripts]
        files, given = {}, {}
        for folder, names, in_memory in (named for _, _, named in scripts):
            given.update({file.name: file for file in in_memory})
            for name in names:
                file = os.path.join(folder, name)
                # What a model refers to may be absent.
                if os.path.exists(file) and not os.path.samefile(file, files.setdefault(name, file)):
                    raise ValueError(f"submit(): {files[name]} and {file} would be one file of the animation: rename one")
        with _Progress(progress) as bar:
            report = bar.at if progress else None
            files = [(name, path) for name, path in files.items() if name not in given]
            return _rayfold.submit(
                address, texts, files, list(given.values()), settings, output, path, delete, wait, report
            )

    def _repr_mimebundle_(self, include=None, exclude=None):
        if self._shown is None:
            self._shown = self._encode("gif", None, "gif", True, False)
        import base64

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

    def _encode(self, call, path, format, progress, exact):
        progress = _arguments.flag(call, "progress", progress)
        exact = _arguments.flag(call, "exact", exact)
        times = self._times()
        if self._shown_length() is None and format == "apng":
            raise ValueError("an .apng begins with the number of its frames, which an iterator does not say: give frames=")
        # Frames of a GIF have alpha or not, one by one. The other formats say before the first whether any has.
        alpha = format == "gif" or (
            isinstance(self._scenes, Sequence) and any(scene._has_clear_frames() for scene in self._scenes)
        )
        encoder = None
        number = 0
        for image in self._drawn(progress):
            if encoder is None:
                alpha = alpha or image.channels == 4
                encoder = _rayfold.Encoder(
                    path, format, image.size, self._shown_length(), self.fps, self.loop, None, exact, alpha
                )
                size = image.size
            if image.channels == 4 and not alpha:
                raise ValueError(
                    f"frame {number + 1} has no background, but frame 1 has one: an .{format} says before its first frame"
                    " whether any is transparent; give the scenes as a list"
                )
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
        [digits] = _numbers_in(name)
        # Frames are written once, also if the animation shows them again on its way back.
        once = Animation(self._scenes, self._count, self.fps, self.loop, False, None)
        once._used, self._used = self._used, True
        for number, image in enumerate(once._drawn(progress), 1):
            shown = f"{number:0{digits[1] or 0}d}" if digits[1] else str(number)
            file = name[: digits.start()] + shown + name[digits.end() :]
            _rayfold.write_file(os.path.join(folder, file), image.png())

    def _folder(self, has_one_size=False, output="gif"):
        """The name of each script, without `.txt`, its text and the files that it names; and the text of `animation.json`."""
        if self.loop == -1:
            raise ValueError("animation.json cannot say that an animation is shown once: expected a loop from 0")
        scripts, frames, size = [], 0, None
        for scene in self._ordered():
            if self._count is not None and frames >= self._count:
                break
            for own in scene._sizes() if has_one_size else ():
                size = size or own
                if own != size:
                    raise ValueError(
                        f"an animation has one size, but frame 1 is {size[0]} x {size[1]} and the scene of frame {frames + 1}"
                        f" has {own[0]} x {own[1]}"
                    )
            scripts.append((f"{len(scripts) + 1:04d}", str(scene), scene._files()))
            frames += scene.frame_count
        if not scripts:
            raise ValueError("an animation needs at least one frame")
        length = self._length()
        if length is not None and frames != length:
            raise ValueError(
                f"the scripts have {frames} frames, not {length}: a script is saved whole, so that `frames` cannot cut it"
            )
        return scripts, _rayfold.settings_text(frames, self.fps, self.loop, self.bounce, self.durations, output)

    def _save_scripts(self, folder):
        scripts, settings = self._folder()
        os.makedirs(folder, exist_ok=True)
        names = {f"{name}.txt" for name, *_ in scripts}
        others = [file for file in os.listdir(folder) if file.endswith(".txt") and file not in names]
        if others:
            raise FileExistsError(
                f"{folder} holds other scripts, which would be frames too: {', '.join(sorted(others)[:5])}"
            )
        put_files((files for _, _, files in scripts), folder)
        for name, text, *_ in scripts:
            _rayfold.write_file(os.path.join(folder, f"{name}.txt"), text.encode())
        _rayfold.write_file(os.path.join(folder, "animation.json"), settings.encode())


def _numbers_in(name):
    """The places for numbers in the name of a file, such as `%04d`."""
    import re

    return list(re.finditer(r"%(\d*)d", name))


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
    frames = None if frames is None else _arguments.whole("animation", "frames", frames, 1)
    fps = _arguments.number("animation", "fps", fps)
    loop = _arguments.whole("animation", "loop", loop, -1, 65535)
    bounce = _arguments.flag("animation", "bounce", bounce)
    durations = _arguments.durations("animation", "durations", durations)
    if isinstance(scenes, Scene):
        scenes = [scenes]
    elif callable(scenes):
        if frames is None:
            raise TypeError("animation() of a function needs frames, the number of times that it is called")
    else:
        items = _arguments.iterable("animation", "scenes", scenes, "a function, scenes in order or a Scene")
        scenes = [_checked(scene) for scene in items] if isinstance(scenes, Sequence) else items
    return Animation(scenes, frames, fps, loop, bounce, durations)


def gif(images, fps=10, path=None, *, loop=0, exact=False):
    """Encodes arrays of height x width x 3 (`uint8`) as a GIF. Returns its bytes, or writes them to `path`.

    Arrays of height x width x 4 have alpha, of which a GIF shows a pixel or does not: of pixels that are covered in part, a
    pattern is shown. Arrays of height x width are greys. Frames are taken one by one: memory does not grow with their number.
    """
    from ._picture import image_of

    images = _arguments.iterable("gif", "images", images, "a list or an iterator of arrays")
    fps = _arguments.number("gif", "fps", fps)
    path = None if path is None else _arguments.path("gif", "path", path)
    loop = _arguments.whole("gif", "loop", loop, -1, 65535)
    exact = _arguments.flag("gif", "exact", exact)
    _arguments.playback("gif", fps, loop, False, {})
    encoder = None
    for number, array in enumerate(images, 1):
        image = image_of(array, f"gif(): images: frame {number}")
        if encoder is None:
            encoder = _rayfold.Encoder(path, "gif", image.size, None, fps, loop, None, exact, True)
        encoder.push(image, None)
    if encoder is None:
        raise ValueError("gif(): images is empty: a GIF needs at least one frame")
    return encoder.finish()[0]


def load(path):
    """Reads a folder of scripts with its `animation.json`, or one script, as an animation."""
    path = _arguments.path("load", "path", path)
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


def _checked(scene, what="scenes holds"):
    if not isinstance(scene, Scene):
        raise TypeError(f"animation(): expected a Scene, but {what} {_arguments.shown(scene)}")
    return scene
