"""Files by their content: a blob is known by the SHA-256 of its bytes.

In the store it has a name of digest and generation, which the register knows
(:mod:`worker.storage.register`). What is read is compared with its digest.
"""

from __future__ import annotations

import hashlib
import io
import logging
import threading
from collections import OrderedDict
from collections.abc import Collection, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import IO, TYPE_CHECKING, Self

from worker.storage.errors import DamagedFileError, StoreError
from worker.storage.places import Place, open_place

if TYPE_CHECKING:
    from worker.settings import WorkerSettings
    from worker.storage.register import BlobRegister
    from worker.storage.versions import Version

logger = logging.getLogger(__name__)

_CHUNK = 1024 * 1024  # bytes
_WRITERS = 4  # at a time, of files that are stored together
_REMEMBERED = 10_000  # versions of blobs known to be sound


class BlobStore:
    """Bytes by digest. Equal contents are stored once.

    Every method raises :class:`StoreError` where the store cannot be used.

    Args:
        place: where the bytes are.
        register: under which names.
    """

    def __init__(self, place: Place, register: BlobRegister) -> None:
        self._place = place
        self._register = register
        self._sound = _Remembered(_REMEMBERED)

    @classmethod
    def open(cls, settings: WorkerSettings, register: BlobRegister) -> Self:
        """The store an installation is configured with."""
        return cls(open_place(settings), register)

    def put(self, data: bytes, holder: str) -> str:
        """Lease a blob for somebody, store its bytes, and return their digest."""
        (digest,) = self.put_all([data], holder)
        return digest

    def put_all(self, contents: Iterable[bytes], holder: str) -> list[str]:
        """Lease blobs for somebody, store their bytes, and return their digests, in order."""
        contents = list(contents)
        digests = [hashlib.sha256(data).hexdigest() for data in contents]
        self._register.lease(digests, holder)
        self.put_files({d: io.BytesIO(data) for d, data in zip(digests, contents, strict=True)})
        return digests

    def put_files(
        self, files: Mapping[str, IO[bytes]], *, anew: Collection[str] = frozenset()
    ) -> None:
        """Store open files by their digests, several at a time, as :meth:`put_file` does one.

        Most of the time a disk or a bucket lets its writer wait, and it lets several wait together.
        """
        if len(files) < 2:
            for digest, file in files.items():
                self.put_file(file, digest, anew=digest in anew)
            return
        with ThreadPoolExecutor(min(_WRITERS, len(files))) as writers:
            for written in [
                writers.submit(self.put_file, file, digest, anew=digest in anew)
                for digest, file in files.items()
            ]:
                written.result()

    def put_file(self, file: IO[bytes], digest: str, *, anew: bool = False) -> bool:
        """Store an open file's whole content, without holding it in memory.

        It survives a loss of power when this returns.

        Args:
            file: the file.
            digest: of its content; leased.
            anew: write it whatever is there: the time it takes then tells nobody whether
                somebody else has sent it before.

        Returns:
            Whether it was written: it was not there, or what was there was damaged.

        Raises:
            FileNotFoundError: nobody needs it, so it would never be removed.
        """
        while True:
            name = self._name(digest)
            try:
                if not anew and self._is_sound(name, digest):
                    self._place.settle(name)
                    return False
            except FileNotFoundError:
                anew = True
            if anew:
                self._place.write(name, file)
                self._sound.add(name, self._place.version(name))
                return True
            self._set_aside(digest, name)

    def get(self, digest: str) -> bytes:
        """The bytes of a digest.

        Raises:
            FileNotFoundError: there is no such blob.
            DamagedFileError: there should be one.
        """
        name = self._name(digest)
        data = b"".join(self._stream(digest, name, None))
        if hashlib.sha256(data).hexdigest() != digest:
            self._set_aside(digest, name)
            raise DamagedFileError(digest, lost=False)
        return data

    def chunks(self, digest: str, part: range | None = None) -> Iterator[bytes]:
        """The bytes of a digest, or those at the positions of ``part``, in pieces.

        All of them are read and compared first, unless this process has done so before and
        nothing was written there since.

        Raises:
            FileNotFoundError: there is no such blob; said at once, not by the iterator.
            DamagedFileError: there should be one; said at once too.
        """
        name = self._name(digest)
        self._require_sound(digest, name)
        return self._stream(digest, name, part)

    def size(self, digest: str) -> int:
        """How many bytes a blob has; they are read and compared as for :meth:`chunks`.

        Raises:
            FileNotFoundError: there is no such blob.
            DamagedFileError: it is not what it should be.
        """
        name = self._name(digest)
        if not self._is_sound(name, digest):
            self._set_aside(digest, name)
            raise DamagedFileError(digest, lost=False)
        return self._place.version(name).size

    def exists(self, digest: str) -> bool:
        """Whether there is such a blob, and it is what it should be."""
        try:
            self.size(digest)
        except (FileNotFoundError, DamagedFileError):
            return False
        return True

    def sweep(self) -> int:
        """Remove the blobs nobody needs, and return how many they were. Repeatable.

        It can be interrupted anywhere, and two can be under way at once: no name is used
        again once it is to be removed, so that it does no harm if its removal comes late.
        """
        self._register.end_leases()
        removed = 0
        while taken := self._register.take_doomed():
            removed += self.remove(taken)
        return removed

    def remove(self, names: Iterable[str]) -> int:
        """Remove names that the register has doomed, and return how many that was.

        What the store refuses to remove stays doomed: :meth:`sweep` tries it again.
        """
        removed = 0
        for name in names:
            try:
                self._place.delete(_path(name))
            except StoreError as error:
                logger.warning("the file %s is not removed yet: %s", name, error)
            else:
                self._register.forget(name)
                removed += 1
        return removed

    def require_writable(self) -> None:
        """Try at once whether something can be written.

        Raises:
            StoreError: it cannot, with the reason.
        """
        self._place.require_writable()

    def clear_unfinished(self) -> int:
        """Remove what writers that died have left, and return how many files that was."""
        return self._place.clear_unfinished()

    def _name(self, digest: str) -> str:
        name = self._register.name_of(digest)
        if name is None:
            raise FileNotFoundError(digest)
        return _path(name)

    def _stream(self, digest: str, name: str, part: range | None) -> Iterator[bytes]:
        try:
            return self._place.stream(name, part)
        except FileNotFoundError:
            self._raise_missing(digest, name)
            raise

    def _require_sound(self, digest: str, name: str) -> None:
        try:
            if self._is_sound(name, digest):
                return
        except FileNotFoundError:
            self._raise_missing(digest, name)
            raise
        self._set_aside(digest, name)
        raise DamagedFileError(digest, lost=False)

    def _raise_missing(self, digest: str, name: str) -> None:
        if self._name(digest) == name:  # else it has been let go of in this moment
            raise DamagedFileError(digest, lost=True)

    def _is_sound(self, name: str, digest: str) -> bool:
        version = self._place.version(name)
        if self._sound.has(name, version):
            return True
        if _digest_of(self._place.stream(name)) != digest:
            return False
        self._sound.add(name, version)
        return True

    def _set_aside(self, digest: str, name: str) -> None:
        if self._register.set_aside(digest, name.rpartition("/")[2]):
            logger.error("the file %s is damaged; it is set aside", name)


class _Remembered:
    """Versions of blobs that were compared with their digests, the last ones only."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._versions: OrderedDict[str, Version] = OrderedDict()
        self._lock = threading.Lock()

    def add(self, name: str, version: Version) -> None:
        with self._lock:
            self._versions[name] = version
            self._versions.move_to_end(name)
            while len(self._versions) > self._capacity:
                self._versions.popitem(last=False)

    def has(self, name: str, version: Version) -> bool:
        with self._lock:
            return self._versions.get(name) == version


def digest_of(file: IO[bytes]) -> str:
    """SHA-256 of an open file's whole content, in hexadecimal digits."""
    file.seek(0)
    return _digest_of(iter(lambda: file.read(_CHUNK), b""))


def _digest_of(pieces: Iterable[bytes]) -> str:
    found = hashlib.sha256()
    for piece in pieces:
        found.update(piece)
    return found.hexdigest()


def _path(name: str) -> str:
    # Two digits spread the blobs over 256 directories; a single huge one is slow to list.
    return f"{name[:2]}/{name}"
