"""Opening what a user hands over, and writing files whole or not at all."""

import os
import socket
from pathlib import Path

import pytest

from creepkit.errors import ExportError, FitError
from creepkit.files.reading import FileKind, check_readable, read_bytes, read_text
from creepkit.files.temporary_names import temporary_name
from creepkit.files.writing import remove_temporary_files, replace_on_success, write_if_absent, write_text
from creepkit.files.written_lists import RECORD

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


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="there is no /dev/zero here")
def test_a_device_without_end_is_refused():
    with pytest.raises(FitError, match="is no regular file"):
        read_bytes(Path("/dev/zero"), NOTE)


def test_a_large_file_is_refused_but_for_its_beginning(tmp_path):
    path = tmp_path / "note"
    path.write_bytes(b"x" * 101)
    assert "larger than 0.0001 MB, which a note never is" in refused(path)
    assert read_bytes(path, NOTE, first=3) == b"xxx"
    path.write_bytes(b"x" * 100)
    assert len(read_text(path, NOTE)) == 100


@pytest.mark.skipif(not hasattr(os, "SEEK_HOLE"), reason="the system does not say where the holes are")
def test_a_file_of_holes_is_refused_and_one_with_data_is_read(tmp_path, monkeypatch):
    """Few blocks alone say nothing: a file system may compress, or not count them."""
    kind = FileKind("a note", FitError, "give a note", maximum_bytes=20_000_000)
    path = tmp_path / "note"
    for parts, is_refused in (
        ([], True),
        ([(0, 5_000)], True),
        ([(5_000_000, 5_000), (9_000_000, 5_000)], True),
        ([(5_000_000, 2_000_000)], False),
        ([(k * 100_000, 4_096) for k in range(100)], False),
    ):
        with path.open("wb") as file:
            file.truncate(10_000_000)
            for start, count in parts:
                file.seek(start)
                file.write(b"x" * count)
        if is_refused and os.stat(path).st_blocks * 512 > 100_000:
            pytest.skip("this file system stores holes")
        if is_refused:
            with pytest.raises(FitError, match="nearly all of its 10 MB are holes, which are not stored; give a note"):
                read_bytes(path, kind)
            with pytest.raises(FitError, match="are holes"):
                check_readable(path, kind)
        else:
            assert read_bytes(path, kind).count(b"x") == sum(count for _, count in parts)
    path.write_bytes(b"")
    os.truncate(path, 1_000_000)
    assert read_bytes(path, kind) == bytes(1_000_000)

    os.truncate(path, 10_000_000)
    monkeypatch.setattr(os, "lseek", lambda file, place, how: 10_000_000 if how == os.SEEK_HOLE else place)
    assert read_bytes(path, kind, first=1) == b"\0"  # of a file system that counts no blocks and knows of no holes


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


def test_special_files_are_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ExportError, match="it is a device, a pipe or the like"):
        write_text("new", tmp_path / "pipe", ExportError)
    with pytest.raises(ExportError, match="it is a folder"):
        write_text("new", tmp_path, ExportError)
    with pytest.raises(ExportError, match="there is no folder .*; choose a file in a folder that exists"):
        write_text("new", tmp_path / "none" / "note", ExportError)
    assert os.listdir(tmp_path) == ["pipe"]


def test_the_first_of_several_writers_decides(tmp_path):
    write_if_absent(tmp_path / "note", "first")
    write_if_absent(tmp_path / "note", "second")
    assert (tmp_path / "note").read_text() == "first"
    temporary_name(tmp_path / "note").touch()
    kept = [".note.0123abcd.part", temporary_name(tmp_path / "note.txt").name]  # a stranger's, and of another file
    for name in kept:
        (tmp_path / name).touch()
    folder = temporary_name(tmp_path / "note")
    folder.mkdir()
    remove_temporary_files(tmp_path / "note")
    assert sorted(os.listdir(tmp_path)) == sorted([*kept, folder.name, "note"])
