"""Parameter files of QGroundControl and MAVProxy, written and read."""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavparm

from mavlink_vehicle.events import Parameter
from navigation_bridge.storage.parameter_files import (
    MAVPROXY,
    QGROUNDCONTROL,
    ParameterFileError,
    VehicleParameterFile,
    format_of,
    read_parameters,
    text_of,
    write_parameters,
)


def parse_parameters(text: str) -> VehicleParameterFile:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "a.parm").write_text(text, "utf-8")
        return read_parameters(Path(folder) / "a.parm")


INT32, REAL32 = 6, 9
SOME = [Parameter("GF_ACTION", -2.0, INT32), Parameter("MPC_XY_CRUISE", 3.2000000476837, REAL32)]


def test_the_two_formats() -> None:
    assert text_of(SOME, QGROUNDCONTROL, 7, "Ours").splitlines() == [
        "# Ours",
        "#",
        "# Vehicle-Id Component-Id Name Value Type",
        "7\t1\tGF_ACTION\t-2\t6",
        "7\t1\tMPC_XY_CRUISE\t3.20000005\t9",
    ]
    assert text_of(SOME, MAVPROXY, 7, "Ours").splitlines()[2:] == [
        "GF_ACTION        -2",
        "MPC_XY_CRUISE    3.20000005",
    ]


def test_a_file_of_mavproxy_is_what_its_own_reader_reads(tmp_path: Path) -> None:
    path = tmp_path / "a.parm"
    path.write_text(text_of(SOME, MAVPROXY, 1, "Ours"))
    read = mavparm.MAVParmDict()
    assert read.load(str(path), mav=None)
    assert dict(read) == {"GF_ACTION": -2.0, "MPC_XY_CRUISE": 3.20000005}


def test_what_is_not_a_number_does_not_spoil_the_file() -> None:
    text = text_of([Parameter("BAD", float("nan"), REAL32), *SOME], MAVPROXY, 1, "Ours")
    assert "# BAD is nan" in text
    assert list(parse_parameters(text).values) == [parameter.name for parameter in SOME]


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_float_comes_back_as_it_was(value: float) -> None:
    for kind in (QGROUNDCONTROL, MAVPROXY):
        text = text_of([Parameter("A", value, REAL32)], kind, 1, "")
        (again,) = parse_parameters(text).values.values()
        assert struct.pack("<f", again) == struct.pack("<f", value)


@given(st.integers(-(2**31), 2**31 - 1))
def test_an_integer_comes_back_as_it_was(value: int) -> None:
    for kind in (QGROUNDCONTROL, MAVPROXY):
        text = text_of([Parameter("A", float(value), INT32)], kind, 1, "")
        assert str(value) in text.split()
        assert parse_parameters(text).values == {"A": value}


def test_what_others_write_is_read() -> None:
    read = parse_parameters(
        "# Onboard parameters for Vehicle 1\n"
        "1\t1\tA\t1.5\t9\n"
        "1\t154\tGIMBAL\t1\t6\n"
        "\n"
        "B,2\n"  # Mission Planner
        "C        3.0 # and why\n"
    )
    assert read.values == {"A": 1.5, "B": 2.0, "C": 3.0}
    assert read.notes == ("1 parameters of other components are left out.",)


def test_hexadecimal_values_and_equals_signs_are_read() -> None:
    read = parse_parameters("A 0x0F\nB,0XfF\nC = 3\nD=-1.5\n1\t1\tE\t0x10\t6\nF -0x1\nG 1.\nH .5\n")
    assert read.values == {
        "A": 15.0, "B": 255.0, "C": 3.0, "D": -1.5, "E": 16.0, "F": -1.0, "G": 1.0, "H": 0.5,
    }  # fmt: skip
    assert read.notes == ()


def test_values_of_a_boards_defaults_are_read_with_a_note() -> None:
    read = parse_parameters("A 1 @READONLY\nB 2\nC 0x3 @READONLY # ours\n")
    assert read.values == {"A": 1.0, "B": 2.0, "C": 3.0}
    assert read.notes == ("2 parameters are marked @READONLY; the autopilot may deny them.",)


def write(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        (folder / f"{name}.parm").write_text(text)
    return folder / "top.parm"


def test_files_are_included_and_later_values_count(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    write(tmp_path / "below", base="A 1\nB 2\n@include more.parm\n", more="C 3\n")
    top = write(
        tmp_path, top="@include below/base.parm\nB 5 # instead\n@include twice.parm\n"
        "@include twice.parm\n", twice="D 4\n",
    )  # fmt: skip
    assert read_parameters(top).values == {"A": 1.0, "B": 5.0, "C": 3.0, "D": 4.0}


def test_an_include_that_is_not_followed_names_the_line(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    secret = write(tmp_path, top="A 1\n")
    (folder / "link.parm").symlink_to(secret)
    for text, sentence in (
        ("B 1\n@include ../top.parm\n", "line 2: '../top.parm' is outside of the folder"),
        (f"@include {secret}\n", "is outside of the folder"),
        ("@include link.parm\n", "line 1: 'link.parm' is outside of the folder"),
        ("@include top.parm\n", "line 1: 'top.parm' includes itself"),
        ("@include other.parm\n", "other.parm: line 1: 'top.parm' includes itself"),
        ("@include none.parm\n", "none.parm: No such file"),
        ("@include\n", "line 1: @include needs the name of one file"),
        ("@include bad.parm\n", "bad.parm: line 2: 1 columns"),
        ("@include double.parm\n", "more than 50 files are included"),
        ("@include empty.parm\n", "top.parm: it contains no parameters of the autopilot"),
    ):
        top = write(
            folder, top=text, other="@include top.parm\n", bad="C 1\nD\n", empty="",
            double="@include a.parm\n" * 8, a="@include b.parm\n" * 8, b="E 1\n",
        )  # fmt: skip
        with pytest.raises(ParameterFileError, match=r"^[^\n]*$") as caught:
            read_parameters(top)
        assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("A 0x\n", "line 1: the value of A, '0x', is not a finite number"),
        ("A 1_000\n", "line 1: the value of A, '1_000', is not a finite number"),
        ("A 0xFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFF\n", "is not a finite number"),
        ("A 1 READONLY\n", "line 1: 3 columns"),
        ("A,1,5\n", "line 1: 3 columns"),
        ("", "no parameters"),
        ("# only a comment\n", "no parameters"),
        ("1\t154\tGIMBAL\t1\t6\n", "no parameters of the autopilot"),
        ("A 1\nB\n", "line 2: 1 columns"),
        ("A x\n", "line 1: the value of A, 'x'"),
        ("A nan\n", "line 1: the value of A, 'nan'"),
        ("A 1e999\n", "is not a finite number"),
        ("A 1\nA 2\n", "line 2: A has two values"),
        ("SEVENTEEN_LETTERS 2\n", "is not a parameter's name"),
        ("A;B 2\n", "is not a parameter's name"),
    ],
)
def test_a_file_that_is_not_used(text: str, part: str) -> None:
    with pytest.raises(ParameterFileError) as caught:
        parse_parameters(text)
    assert part in str(caught.value)


def test_the_format_is_that_of_the_name() -> None:
    assert format_of(Path("a.params")) == QGROUNDCONTROL
    assert format_of(Path("a.PARM")) == format_of(Path("a.param")) == MAVPROXY
    with pytest.raises(ParameterFileError, match="ends in"):
        format_of(Path("a.txt"))


def test_a_file_is_written_as_a_whole_or_not(tmp_path: Path) -> None:
    path = tmp_path / "a.parm"
    write_parameters(path, "A 1\n")
    assert read_parameters(path).values == {"A": 1.0}
    with pytest.raises(ParameterFileError, match="none"):
        write_parameters(tmp_path / "none" / "a.parm", "A 2\n")
    path.write_bytes(b"\xff\xff")
    with pytest.raises(ParameterFileError, match=r"a\.parm: "):
        read_parameters(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.parm"]
