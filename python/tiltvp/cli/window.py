"""A window of the desktop that shows one picture after another, by the toolkit that comes with Python."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tiltvp.errors import InvalidInputError, MissingExtraError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["Window"]


class Window:
    """Shows pictures of one size until it is closed, by its frame or by q or Escape.

    OpenCV's own windows are not in `opencv-python-headless`, which this package installs.
    """

    def __init__(self, title: str) -> None:
        """Opens it. Raises `MissingExtraError` without Tk, `InvalidInputError` where there is no screen."""
        try:
            import tkinter
        except ImportError:
            what = "--show: Python's own tkinter is not installed, expected the system's package python3-tk"
            raise MissingExtraError(f"{what}, or --rerun") from None
        self._tk = tkinter
        try:
            self._root = tkinter.Tk()
        except tkinter.TclError as error:
            raise InvalidInputError(f"--show: no window ({error}), expected a screen, or --rerun FILE.rrd") from None
        self._root.title(title)
        self._root.resizable(False, False)
        self._label: Any = tkinter.Label(self._root, borderwidth=0)
        self._label.pack()
        self._photo: Any = None
        self.is_open = True
        self._root.protocol("WM_DELETE_WINDOW", self.close)
        for key in ("q", "<Escape>"):
            self._root.bind(key, lambda _: self.close())

    def show(self, picture: NDArray[np.uint8]) -> None:
        """The next picture, (H, W, 3) BGR uint8; nothing once the window is closed."""
        if not self.is_open:
            return
        height, width = picture.shape[:2]
        content = b"P6 %d %d 255\n" % (width, height) + picture[:, :, ::-1].tobytes()
        try:
            if self._photo is None:
                self._photo = self._tk.PhotoImage(master=self._root, data=content, format="PPM")
                self._label.configure(image=self._photo)
            else:
                self._photo.configure(data=content, format="PPM")
        except self._tk.TclError:
            # The desktop has taken it away.
            self.is_open = False
        self.attend()

    def attend(self) -> bool:
        """Lets it answer its user, also while there is no new picture; whether it is open after that."""
        try:
            if self.is_open:
                self._root.update()
        except self._tk.TclError:
            self.is_open = False
        return self.is_open

    def close(self) -> None:
        """Takes it away."""
        if self.is_open:
            self.is_open = False
            self._root.destroy()
