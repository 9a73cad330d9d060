"""The one decorator behind every compiled kernel, and the disk cache it uses.

numba finds a stale kernel in its cache when a function that the kernel calls, in another file, was edited. The cache
directory is therefore named by a hash of every source that can take part: the core's lower rooms, every installed
plugin, numba, numpy and Python. It belongs to the user alone, since the cached files are pickles.
"""

import contextlib
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib.metadata import entry_points, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, TypeVar, cast

import numba
from numba.extending import overload

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


_CANNOT_TAKE_PART = {"scene", "records", "studies", "testing", "plugins"}  # no kernel imports from these rooms


def _packages() -> Iterator[Path]:
    values = (entry.value.replace(":", ".") for entry in entry_points(group="mpad"))  # some may be malformed
    names = {"mpad_core"} | {value.partition(".")[0].strip() for value in values}
    for name in sorted(names - {""}):
        spec = find_spec(name)
        if spec is not None and spec.submodule_search_locations:
            yield Path(next(iter(spec.submodule_search_locations)))


def _fingerprint() -> str:
    digest = hashlib.sha256(f"{sys.version} {version('numba')} {version('numpy')}".encode())
    for package in _packages():
        for source in sorted(package.rglob("*.py")):
            if package.name == "mpad_core" and source.relative_to(package).parts[0] in _CANNOT_TAKE_PART:
                continue
            digest.update(str(source).encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:20]


def _cache_homes() -> Iterator[Path]:
    """Yield where the cache may lie: as the environment says, in the user's home, in the temporary directory."""
    yield from (Path(os.environ[name]) for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME") if os.environ.get(name))
    with contextlib.suppress(RuntimeError):  # a user may have no home
        yield Path.home() / ".cache"
    yield Path(tempfile.gettempdir()) / f"mpad-{os.getuid()}"


def _cache_directory() -> Path:
    """Give a directory that can be written and is the user's own."""
    for home in _cache_homes():
        wanted = home / "mpad" / _fingerprint()
        with contextlib.suppress(OSError):
            wanted.mkdir(parents=True, exist_ok=True, mode=0o700)
            wanted.chmod(0o700)  # refused where it is somebody else's
            if os.access(wanted, os.W_OK):
                return wanted
    return Path(tempfile.mkdtemp(prefix="mpad-numba-"))


# not through the environment, which child processes would inherit
numba.config.CACHE_DIR = str(_cache_directory())  # type: ignore[attr-defined]  # set by numba at run time


def _forgiving(dispatcher: Any) -> Any:
    """Make a damaged cache file a cache miss: numba itself ends in an unpickling error."""
    load = dispatcher._cache.load_overload

    def load_or_recompile(signature: Any, target_context: Any) -> Any:
        try:
            return load(signature, target_context)
        except Exception:  # whatever a damaged pickle raises, the remedy is the same
            with contextlib.suppress(OSError):
                dispatcher._cache.flush()
            return None

    dispatcher._cache.load_overload = load_or_recompile
    return dispatcher


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a kernel with numba: cached on disk, IEEE arithmetic (no fastmath), numpy's rules for division."""
    kernel: Callable[P, R] = _forgiving(numba.njit(cache=True, error_model="numpy", nogil=True)(function))
    return kernel


_REGROUPED = {"contract", "reassoc", "nsz"}


def compiled_sums(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `compiled` does, but let products and sums be fused and regrouped, which vectorises inner products.

    For kernels of linear algebra, where the order of a sum means nothing; NaN and infinity keep their meaning, and
    the same machine gives the same bits.
    """
    sums = numba.njit(cache=True, error_model="numpy", nogil=True, fastmath=_REGROUPED)
    kernel: Callable[P, R] = _forgiving(sums(function))
    return kernel


_LEAN: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "_nrt": False}


def compiled_lean(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `compiled` does, without reference counts: for functions that make no array and keep none.

    To take an array out of a named tuple otherwise costs two atomic sums for each array of that tuple, which in small
    functions is most of the time.
    """
    kernel: Callable[P, R] = _forgiving(numba.njit(**_LEAN)(function))
    return kernel


def compiled_inline(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `compiled_lean` does, and put the code wherever it is called: for what inner loops call."""
    kernel: Callable[P, R] = _forgiving(numba.njit(**_LEAN, forceinline=True)(function))
    return kernel


_PART: Any = _LEAN | {"cache": False}  # kept with the kernels that call it


class Absent(NamedTuple):
    """What stands where data of an effect would, if the scene leaves the effect out."""


def absent(kind: type[T]) -> T:
    """Give what stands for data of a kind that are not there; what acts on them is `compiled_where_present`."""
    return cast(T, Absent())


def _is_absent(effect: Any) -> bool:
    return getattr(effect, "instance_class", None) is Absent


def compiled_where_present(otherwise: Any = None) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile as `compiled_lean` does what acts on an effect, its first argument; with an absent one, do nothing.

    Which of both is settled by type, when what calls the function is compiled: nothing is asked when it runs, what
    belongs to an absent effect is not compiled, and no data of it are handed on. Called from Python the function is
    what it was.

    Parameters
    ----------
    otherwise
        What to give where the effect is absent.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        def nothing(*given: Any) -> Any:
            return otherwise

        @overload(function, strict=False, jit_options=_PART)
        def where_present(effect: Any, *others: Any) -> Any:
            return None if _is_absent(effect) else function

        @overload(function, strict=False, jit_options=_PART | {"forceinline": True})
        def where_absent(effect: Any, *others: Any) -> Any:
            return nothing if _is_absent(effect) else None

        return function

    return decorate


@compiled_where_present(otherwise=False)
def is_present(effect: Any) -> bool:
    """Tell whether an effect is there; known when code is compiled."""
    return True


def compiled_within(function: Callable[P, R]) -> Callable[P, R]:
    """Make a function part of the kernels that call it, by whose rules it is compiled.

    A kernel is optimised again, with all it calls, in each kernel above it: so the upper storeys of a tall building are
    better not kernels of their own.
    """
    part: Callable[P, R] = numba.njit(inline="always", error_model="numpy")(function)
    return part


def compiled_parallel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as `compiled` does, with `numba.prange` over all threads: fill arrays, never reduce (bits stay equal)."""
    parallel = numba.njit(cache=True, error_model="numpy", nogil=True, parallel=True)
    kernel: Callable[P, R] = _forgiving(parallel(function))
    return kernel
