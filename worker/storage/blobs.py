"""Files by their content: a blob is known by the SHA-256 of its bytes.

In the store it has a name of digest and generation, which the register knows
(:mod:`worker.storage.register`). What is read is compared with its digest.
"""

from __future__ import annotations

import hashlib
import io
import logging
from collections.abc import Collection, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Self

from worker.storage.errors import DamagedFileError, StoreError
from worker.storage.places import Place, open_place
from worker.storage.versions import RememberedVersions, Version

if TYPE_CHECKING:
    from worker.settings import WorkerSettings
    from worker.storage.register import BlobRegister

logger = logging.getLogger(__name__)

_CHUNK = 1024 * 1024  # bytes
_WRITERS = 4  # at a time, of files that are stored together
_REMEMBERED = 10_000  # versions of blobs known to be sound, or to survive a loss of power


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
        self._sound = RememberedVersions(_REMEMBERED)
        self._settled = RememberedVersions(_REMEMBERED)

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
        asked = [
            (digest, name, file, digest in anew)
            for (digest, file), name in zip(files.items(), self._names(files), strict=True)
        ]
        if len(asked) < 2:
            self._settle([self._write(*each) for each in asked])
            return
        with ThreadPoolExecutor(min(_WRITERS, len(asked))) as writers:
            writing = [writers.submit(self._write, *each) for each in asked]
            self._settle([each.result() for each in writing])

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
        kept = self._write(digest, self._name(digest), file, anew)
        self._settle([kept])
        return kept.is_new

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
        version = self._sound_version(name, digest)
        if version is None:
            self._set_aside(digest, name)
            raise DamagedFileError(digest, lost=False)
        return version.size

    def exists(self, digest: str) -> bool:
        """Whether there is such a blob, and it is what it should be."""
        try:
            self.size(digest)
        except (FileNotFoundError, DamagedFileError):
            return False
        return True

    def sweep(self) -> int:
        """Remove the blobs that nothing needs, and return how many there were. Repeatable.

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

    def _write(self, digest: str, name: str, file: IO[bytes], anew: bool) -> _Kept:
        """Write a file that is not there, or is damaged; it is still to be settled."""
        while True:
            if not anew:
                try:
                    version = self._sound_version(name, digest)
                except FileNotFoundError:
                    anew = True
                else:
                    if version is not None:
                        return _Kept(name, version, is_new=False)
                    self._set_aside(digest, name)
                    name = self._name(digest)
            if anew:
                self._place.write(name, file)
                version = self._place.version(name)
                self._sound.add(name, version)
                return _Kept(name, version, is_new=True)

    def _settle(self, kept: Iterable[_Kept]) -> None:
        unsettled = [each for each in kept if not self._settled.has(each.name, each.version)]
        if unsettled:
            self._place.settle([each.name for each in unsettled])
        for each in unsettled:
            self._settled.add(each.name, each.version)

    def _name(self, digest: str) -> str:
        [name] = self._names([digest])
        return name

    def _names(self, digests: Iterable[str]) -> list[str]:
        digests = list(digests)
        names = self._register.names_of(digests)
        for digest, name in zip(digests, names, strict=True):
            if name is None:
                raise FileNotFoundError(digest)
        return [_path(name) for name in names if name is not None]

    def _stream(self, digest: str, name: str, part: range | None) -> Iterator[bytes]:
        try:
            return self._place.stream(name, part)
        except FileNotFoundError:
            self._raise_missing(digest, name)
            raise

    def _require_sound(self, digest: str, name: str) -> None:
        try:
            if self._sound_version(name, digest) is not None:
                return
        except FileNotFoundError:
            self._raise_missing(digest, name)
            raise
        self._set_aside(digest, name)
        raise DamagedFileError(digest, lost=False)

    def _raise_missing(self, digest: str, name: str) -> None:
        if self._name(digest) == name:  # else it has been let go of in this moment
            raise DamagedFileError(digest, lost=True)

    def _sound_version(self, name: str, digest: str) -> Version | None:
        """The version there is, if it is what it should be; None if it is not."""
        version = self._place.version(name)
        if not self._sound.has(name, version):
            if _digest_of(self._place.stream(name)) != digest:
                return None
            self._sound.add(name, version)
        return version

    def _set_aside(self, digest: str, name: str) -> None:
        if self._register.set_aside(digest, name.rpartition("/")[2]):
            logger.error("the file %s is damaged; it is set aside", name)


@dataclass(frozen=True)
class _Kept:
    """What is in the store under a name.

    Attributes:
        is_new: whether it was written just now.
    """

    name: str
    version: Version
    is_new: bool


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
