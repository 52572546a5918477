"""API keys: made here, kept as SHA-256 hashes only, and compared in constant time. No FastAPI."""

import hashlib
import hmac
import re
import secrets
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Self

_LINE = re.compile(r"([A-Za-z0-9._-]{1,64})\s+([0-9a-fA-F]{64})")

#: What a key's owner may be called.
NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")


def new_key(name: str) -> tuple[str, str]:
    """Return a new random key and the line that admits it.

    Raises
    ------
    ValueError
        The name has other characters than letters, digits, ``.``, ``_`` and ``-``, or too many.
    """
    if not NAME.fullmatch(name):
        raise ValueError(f"a key's name has 1 to 64 letters, digits, dots, dashes or underscores, not {name[:80]!r}")
    key = secrets.token_urlsafe(32)
    return key, f"{name} {_hash(key.encode())}"


def _hash(key: bytes) -> str:
    # A fast hash is enough: a key has 256 random bits, nobody can try them all.
    return hashlib.sha256(key).hexdigest()


class Keys:
    """The keys that are admitted.

    Parameters
    ----------
    entries
        Names and hashes.
    """

    def __init__(self, entries: Iterable[tuple[str, str]]) -> None:
        self._entries = tuple((name, digest.lower()) for name, digest in entries)

    def __len__(self) -> int:
        return len(self._entries)

    @classmethod
    def read(cls, file: str, hashed: str) -> Self | None:
        """Return the keys of a file and of a list; None where neither is given.

        Parameters
        ----------
        file : str
            A file of lines ``NAME SHA256-HEX``, blank lines, and comments from ``#`` on. Empty: none.
        hashed : str
            The same lines, separated by commas. Empty: none.

        Raises
        ------
        ValueError
            The file cannot be read, a line is something else, a name or a key is there twice, or there is no key.
        """
        entries: list[tuple[str, str]] = []
        if file:
            try:
                lines = Path(file).read_text(encoding="utf-8").splitlines()
            except (OSError, UnicodeDecodeError) as error:
                raise ValueError(f"the keys file {file}: {getattr(error, 'strerror', None) or error}") from None
            _collect(entries, lines, f"the keys file {file}, line")
            if not entries:  # and so nobody would be admitted, or worse, everybody
                raise ValueError(f"the keys file {file} has no key in it; waywright key NAME makes one")
        if hashed.strip():
            before = len(entries)
            _collect(entries, hashed.split(","), "WAYWRIGHT_API_KEYS_HASHED, entry")
            if len(entries) == before:
                raise ValueError("WAYWRIGHT_API_KEYS_HASHED has no key in it; waywright key NAME makes one")
        return cls(entries) if file or hashed.strip() else None

    def owner(self, key: bytes) -> str | None:
        """Return whose key this is; None for nobody's. Takes the same time for any key of the same length."""
        digest, found = _hash(key), None
        for name, known in self._entries:
            if hmac.compare_digest(known, digest):
                found = name  # and on: an early exit would tell how far down the list it was
        return found


def _collect(entries: list[tuple[str, str]], lines: Sequence[str], where: str) -> None:
    for number, line in enumerate(lines, 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        match = _LINE.fullmatch(text)
        if match is None:  # the line is not repeated: it may hold a key in clear
            raise ValueError(f"{where} {number}: expected NAME and the SHA-256 of a key as 64 hexadecimal digits")
        name, digest = match[1], match[2].lower()
        if any(name == other for other, _ in entries):
            raise ValueError(f"{where} {number}: there is a key of {name} already")
        if any(digest == other for _, other in entries):
            raise ValueError(f"{where} {number}: the key of {name} is another's already")
        entries.append((name, digest))
