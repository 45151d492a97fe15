"""`creepkit read` of a folder with a file that cannot be read: the others are shown, then its error."""

from helpers.command_line import creepkit

GOOD = "# stress_MPa: 150\n# temperature_C: 600\nTime (h),Creep strain (%)\n" + "".join(
    f"{h},{0.01 * h**0.6:.5f}\n" for h in range(1, 20)
)


def test_the_good_files_are_shown_and_the_errors_come_last(tmp_path):
    (tmp_path / "good.csv").write_text(GOOD)
    (tmp_path / "other.csv").write_text(GOOD.replace("150", "170"))
    (tmp_path / "spoilt.csv").write_text("# Ofenplatz: 3\n" + GOOD)
    result = creepkit("read", str(tmp_path))
    assert result.exit_code == 1
    assert "good: uniaxial, 150 MPa" in result.output
    assert "other: uniaxial, 170 MPa" in result.output
    assert "unknown key 'Ofenplatz'" in result.output
