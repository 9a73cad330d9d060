"""A picture that says where sites are dense."""

import hashlib
import io
import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np
from attrs import field, frozen
from numpy.typing import NDArray

from mpad_core import Array
from mpad_surfaces.pattern.along import FINEST, positive

_MOST_BYTES = 100_000_000
_SIXTEEN_BITS = ("I", "I;16", "I;16B", "I;16L", "I;16N")


@frozen(kw_only=True)
class Mask:
    """The grey value of a picture's pixel, from 0 for black to 1 for white, columns along x, its lowest row first in y.

    Colours count by their luminance; transparency is ignored.
    """

    image: str  # path
    pixel: float = field(validator=positive)  # µm
    origin: tuple[float, float] = (0.0, 0.0)  # µm, the picture's lower left corner
    outside: Literal["low", "repeat"] = "low"
    sha256: str | None = None
    grey: NDArray[Any] = field(init=False, repr=False, eq=False)  # (rows, columns), the lowest row first

    @grey.default
    def _read(self) -> NDArray[Any]:
        """Read the picture, once; its bytes are checked and decoded from one reading, so they cannot differ."""
        try:
            if not Path(self.image).is_file():  # a device or a pipe may never end
                raise ValueError("there is no such file")
            with Path(self.image).open("rb") as file:
                raw = file.read(_MOST_BYTES + 1)
        except (OSError, ValueError) as error:
            raise ValueError(f"image {self.image!r} cannot be read: {getattr(error, 'strerror', error)}") from error
        if len(raw) > _MOST_BYTES:
            raise ValueError(f"image {self.image!r} is larger than {_MOST_BYTES // 1_000_000} MB; make it coarser")
        found = hashlib.sha256(raw).hexdigest()
        if self.sha256 not in (None, found):
            raise ValueError(
                f"image {self.image!r} is not the one that this scene was made with (SHA-256 {found[:12]}…); "
                "put that one back, or leave out sha256"
            )
        return _pixels(self.image, raw)

    def share(self, x: Array, y: Array) -> Array:
        """Give the grey value of the pixel at each place."""
        rows, columns = self.grey.shape
        column = np.floor((x - self.origin[0]) / self.pixel)
        row = np.floor((y - self.origin[1]) / self.pixel)
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        found = self.grey[(row % rows).astype(np.int64), (column % columns).astype(np.int64)]
        share = found / np.iinfo(self.grey.dtype).max
        return share if self.outside == "repeat" else np.where(inside, share, 0.0)

    def resolution(self) -> float:
        """Give half a pixel, or less (µm)."""
        return min(FINEST, 0.5 * self.pixel)


def _pixels(name: str, raw: bytes) -> NDArray[Any]:
    """Decode a picture to grey values of 8 or 16 bits (rows, columns), the lowest row first."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # Pillow warns of pictures that fill the memory
            picture = Image.open(io.BytesIO(raw))
            if picture.mode in _SIXTEEN_BITS:
                grey: NDArray[Any] = np.clip(np.asarray(picture.convert("I")), 0, 65535).astype(np.uint16)
            else:
                grey = np.asarray(picture.convert("L"), np.uint8)
            return grey[::-1]
    except Exception as error:  # a damaged file makes Pillow raise whatever its decoders do
        what = " ".join(str(error).split())[:120]
        raise ValueError(f"image {name!r} is no picture that can be read: {what}") from error
