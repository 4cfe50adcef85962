"""Single files beside a user's: ours are replaced while they are as we left them, all others are kept."""

from pathlib import Path

import pytest

from flight.storage.folders import write_files
from flight.storage.ownership import MANIFEST, read_contents
from flight.storage.single_files import check_page, replace_listed, replace_page, write_single
from verify.data import BadInput


def test_a_file_is_added_to_a_folder_and_listed_there(tmp_path: Path) -> None:
    run = tmp_path / "run"
    write_files(run, {"mission.yaml": b"first"})
    (run / "notes.txt").write_text("mine")
    assert replace_listed(run, "certificate.json", "one") == run / "certificate.json"
    assert replace_listed(run, "certificate.json", "two") == run / "certificate.json"
    assert (run / "certificate.json").read_text() == "two"
    contents = read_contents(run)
    assert contents.ours == {"mission.yaml", "certificate.json", MANIFEST}
    assert contents.theirs == {"notes.txt"}


def test_a_listed_file_that_was_edited_is_the_users(tmp_path: Path) -> None:
    replace_listed(tmp_path, "certificate.json", "one")
    (tmp_path / "certificate.json").write_text("edited")
    with pytest.raises(BadInput, match=r"certificate\.json is yours, or was changed since ltlplan wrote it"):
        replace_listed(tmp_path, "certificate.json", "two")
    assert (tmp_path / "certificate.json").read_text() == "edited"
    listed = (tmp_path / MANIFEST).read_bytes()
    replace_listed(tmp_path, "certificate.json", "edited")  # what is there already needs no writing
    assert (tmp_path / MANIFEST).read_bytes() == listed


def test_a_page_is_known_by_its_stamp(tmp_path: Path) -> None:
    page = tmp_path / "show.html"
    replace_page(page, "<html>1</html>")
    replace_page(page, "<html>2</html>\n")
    assert page.read_text().startswith("<html>2</html>\n<!-- written by ltlplan")
    page.write_text(page.read_text().replace("2", "3", 1))
    with pytest.raises(BadInput, match="is yours, or was changed"):
        replace_page(page, "<html>4</html>")
    assert page.read_text().startswith("<html>3</html>")
    with pytest.raises(BadInput, match="is a folder; name a page"):
        check_page(tmp_path)


def test_a_file_that_is_there_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "flight.csv"
    write_single(path, b"one")
    write_single(path, b"one")
    with pytest.raises(BadInput, match="exists already"):
        write_single(path, b"two")
    assert path.read_bytes() == b"one"
    write_single(path, b"two", overwrite=True)
    assert path.read_bytes() == b"two"
    with pytest.raises(BadInput, match="cannot be written"):
        write_single(tmp_path / "gone" / "flight.csv", b"one")
    assert [entry.name for entry in tmp_path.iterdir()] == ["flight.csv"]
