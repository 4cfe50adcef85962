"""Files are read within a bound, and take the memory that they need."""

import tracemalloc
from pathlib import Path

import pytest

from verify.data import BadInput
from verify.data.storage.safe_reading import read_bytes


@pytest.mark.parametrize("size", [0, 1, 65535, 65536, 200_000])
def test_a_file_is_read_whole(tmp_path: Path, size: int) -> None:
    data = bytes(number % 251 for number in range(size))
    (tmp_path / "file").write_bytes(data)
    assert read_bytes(tmp_path / "file", most=max(size, 1), what="file") == data
    if size:
        with pytest.raises(BadInput, match="larger than"):
            read_bytes(tmp_path / "file", most=size - 1, what="file")


def test_one_whose_size_nobody_knows_beforehand_is_read_to_its_end() -> None:
    said = Path("/proc/self/limits")
    if not said.exists():
        pytest.skip("this system has no /proc")
    assert read_bytes(said, most=1_000_000, what="file") == said.read_bytes()


def test_a_small_file_takes_little_memory_however_much_it_might_have(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"x" * 1000)
    tracemalloc.start()
    try:
        read_bytes(tmp_path / "file", most=2_000_000_000, what="file")
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()
