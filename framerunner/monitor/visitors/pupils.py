"""The pupils of a class: their names, the parts of the names of their files, and their own code words."""

from __future__ import annotations

import hmac
import json
import re
import secrets
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from framerunner.errors import UserError
from framerunner.files.text_file import read_in_folder, replace_file

MAX_PUPILS = 300
_MAX_FILE_BYTES = 1_000_000
_OWNED = re.compile(r"(?:lesson_[0-9]+_|[a-z][a-z0-9_]*-)(?P<key>[a-z0-9_]+)\.yaml")
_CONSONANTS, _VOWELS = "bdfgklmnprstvz", "aeiou"


class PupilError(UserError):
    """Somebody cannot join the class; the message is one line for people."""


class Pupil(BaseModel):
    """A pupil.

    Attributes:
        name: as written at the first log-in.
        key: part of the names of the pupil's files; no other pupil has it.
        word: with which the pupil goes on in another browser.
    """

    model_config = ConfigDict(frozen=True, extra="allow")  # what a teacher adds is kept

    name: Annotated[str, Field(min_length=1, max_length=60)]
    key: Annotated[str, Field(pattern=r"^[a-z0-9_]{1,200}$")]
    word: Annotated[str, Field(min_length=1, max_length=60)]


class _FileContent(BaseModel):
    model_config = ConfigDict(extra="allow")

    pupils: list[Pupil] = []


class PupilBook:
    """The pupils of a class, kept in a file that only its owner can read.

    Args:
        path: of the file; it is made when the first pupil joins.
        code: the code word with which a class joins; None: nobody can.
    """

    def __init__(self, path: Path, code: str | None) -> None:
        self._path = path
        self._code = code

    def all(self) -> tuple[Pupil, ...]:
        """The pupils, in the order in which they joined. Raises `PupilError` if the file cannot be read."""
        return tuple(self._read().pupils)

    def _read(self) -> _FileContent:
        try:
            data = json.loads(read_in_folder(self._path, _MAX_FILE_BYTES))
            return _FileContent.model_validate(data)
        except FileNotFoundError:
            return _FileContent()
        except (OSError, ValueError, RecursionError, ValidationError):
            raise PupilError(
                f"{self._path.name} cannot be read, so nobody can join; the teacher mends or removes it"
            ) from None

    def find(self, name: str) -> Pupil | None:
        """The pupil with a name; capitals do not matter."""
        return next((each for each in self.all() if each.name.casefold() == name.casefold()), None)

    def log_in(self, name: str, word: str) -> Pupil | None:
        """The pupil who has given this name and code word; a new name joins with the code word of the class.

        Returns:
            None if the code word is wrong.

        Raises:
            PupilError: the name is another pupil's, the class is full, or its file cannot be used.
        """
        if self._code is None:
            return None
        name = " ".join(name.split())
        pupil, is_of_class = self.find(name), _is_same(word, self._code)
        if pupil is not None:
            if _is_same(word, pupil.word):
                return pupil
            if is_of_class:
                raise PupilError(
                    f"{pupil.name} has joined already. If that is you, give your own code word, which stands "
                    "on your page Course, and your teacher's; else use another name"
                )
            return None
        return self._join(name) if is_of_class else None

    def _join(self, name: str) -> Pupil:
        content = self._read()
        if len(content.pupils) >= MAX_PUPILS:
            raise PupilError(
                f"{MAX_PUPILS} pupils have joined; the teacher removes some from {self._path.name}"
            )
        taken = {each.key for each in content.pupils} | self._keys_of_files()
        key = first = file_key(name)
        number = 2
        while key in taken:
            key, number = f"{first}_{number}", number + 1
        pupil = Pupil(name=name, key=key, word=_new_word())
        content.pupils.append(pupil)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(self._path, content.model_dump_json(indent=1), new_mode=0o600)
        except OSError as error:
            raise PupilError(
                f"{self._path.name} cannot be written ({error.strerror}); tell the teacher"
            ) from None
        return pupil

    def _keys_of_files(self) -> set[str]:
        """Keys with which a new pupil would own a file that has been named; lessons are their learner's."""
        found = (_OWNED.fullmatch(path.name) for path in self._path.parent.glob("*-*.yaml"))
        return {match["key"] for match in found if match is not None}


def owns(key: str, file: str) -> bool:
    """Whether a mission's file is that of the pupil with a key: a lesson, or one that the pupil has named."""
    match = _OWNED.fullmatch(file)
    return match is not None and match["key"] == key


def file_key(name: str) -> str:
    """A name as part of a file's name; names that are much alike may have the same."""
    plain = re.sub(r"[^a-z0-9]+", "_", name.casefold()).strip("_")
    return plain or "".join(f"{ord(each):x}" for each in name)[:40]


def _is_same(word: str, other: str) -> bool:
    """Whether two code words are the same; capitals and blanks around them do not matter."""
    return hmac.compare_digest(word.strip().casefold().encode(), other.strip().casefold().encode())


def _new_word() -> str:
    """A code word that is easy to write down, one of some 10**9."""
    syllables = [secrets.choice(_CONSONANTS) + secrets.choice(_VOWELS) for _ in range(4)]
    return f"{syllables[0]}{syllables[1]}-{syllables[2]}{syllables[3]}-{secrets.randbelow(90) + 10}"
