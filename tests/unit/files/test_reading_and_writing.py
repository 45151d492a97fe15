"""Opening what a user hands over, and writing files whole or not at all."""

import os
import socket

import pytest

from creepkit.errors import ExportError, FitError
from creepkit.files.reading import FileKind, check_readable, read_bytes, read_text
from creepkit.files.writing import RECORD, remove_temporary_files, replace_on_success, temporary_name, write_text

NOTE = FileKind("a note", FitError, "give a note", maximum_bytes=100)


def refused(path):
    with pytest.raises(FitError) as caught:
        read_text(path, NOTE)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(FitError):
        read_bytes(path, NOTE)
    return str(caught.value)


def test_text_is_read_with_and_without_a_byte_order_mark(tmp_path):
    path = tmp_path / "note"
    for content in (b"\xc3\xa4\r\n", b"\xef\xbb\xbf\xc3\xa4\r\n"):
        path.write_bytes(content)
        assert read_text(path, NOTE) == "ä\r\n"


def test_what_is_no_regular_file_is_refused_without_waiting(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe")
    assert "is no regular file" in refused(tmp_path / "pipe")
    assert "is a folder; give a note" in refused(tmp_path)
    with socket.socket(socket.AF_UNIX) as listener:
        monkeypatch.chdir(tmp_path)
        listener.bind("socket")  # a path of its own may be too long for a socket
        assert "cannot be read" in refused(tmp_path / "socket")
    assert "there is no such file" in refused(tmp_path / "none")
    with pytest.raises(FitError, match="is no regular file"):
        check_readable(tmp_path / "pipe", NOTE)


def test_a_large_file_is_refused_but_for_its_beginning(tmp_path):
    path = tmp_path / "note"
    path.write_bytes(b"x" * 101)
    assert "larger than 0.0001 MB, which a note never is" in refused(path)
    assert read_bytes(path, NOTE, first=3) == b"xxx"
    path.write_bytes(b"x" * 100)
    assert len(read_text(path, NOTE)) == 100


def test_bytes_that_are_no_text_are_named_with_their_line(tmp_path):
    path = tmp_path / "note"
    path.write_bytes(b"one\ntwo \xff\n")
    with pytest.raises(FitError, match="note:2: byte 0xff is not text in UTF-8; give a note"):
        read_text(path, NOTE)


def test_a_failed_writing_leaves_what_was_there(tmp_path):
    path = write_text("old", tmp_path / "note", ExportError)

    def fail():
        with replace_on_success(path, ExportError) as temporary:
            temporary.write_bytes(b"half")
            raise OSError(28, "full")

    with pytest.raises(ExportError, match="No space left on device; free some space and start again"):
        fail()
    assert path.read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == [RECORD, "note"]


def test_what_a_killed_process_left_is_removed(tmp_path):
    temporary_name(tmp_path / "note").touch()
    kept = temporary_name(tmp_path / "other")
    kept.touch()
    remove_temporary_files(tmp_path / "note")
    assert os.listdir(tmp_path) == [kept.name]
