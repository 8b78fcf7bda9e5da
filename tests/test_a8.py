"""The A8 over the link: scales about 200, a base laid off both ways, common phi, parts it lacks (P 3.1, 3.2)."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from serial import serial_for_url

import a7sim
from a7sim.geometry import GON, image_of, rotation
from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.plotters import A7, A8
from a7sim.reduction.modelling import a8_model_coordinates
from tests.support.engine_client import EngineClient
from tests.test_instrument import photograph

GROUND = np.array(
    [[-70.0, 10.0, 80.0, -60.0, 60.0], [60.0, 5.0, -75.0, -40.0, 90.0], [-290.0, -310.0, -300.0, -305.0, -295.0]]
)
"""Places of model points, mm from the middle of the base."""

BASE, C = 184.0, 152.0


def an_a8(**photographs) -> EngineClient:
    return EngineClient(SharedInstrument(Autograph(A8, photographs=photographs)))


def test_the_identification_query_names_an_a8():
    assert an_a8().query("*IDN?") == f"WILD HEERBRUGG,A8,0,{a7sim.__version__}"


@pytest.mark.parametrize(
    "line",
    [
        "PROJ1:BY 1",
        "PROJ2:BY?",
        "PROJ1:BZ 0",
        "PROJ1:BZ? MAX",
        "BASE:MODE OUT",
        "FITT:DOVE IN",
        "FITT:DOVE?",
        "FITT:TRI FRON",
        "COUN:X:PRES 5000",
        "COUN:Y:PRES 5000",
        'REC "1",BY1',
    ],
)
def test_a_part_that_an_a8_lacks_is_a_settings_conflict(line):
    client = an_a8()
    assert client.query(line) == ""
    assert client.errors() == [-221]


def test_a_part_is_lacking_if_the_data_of_the_plotter_do_not_list_it():
    """An A7 without by in its table refuses by, an A8 with by in its table sets it: the table decides, not the name."""
    with_by = replace(A8, elements={**A8.elements, "by1": A7.elements["by1"]}, fittings=A7.fittings)
    client = EngineClient(SharedInstrument(Autograph(with_by)))
    assert client.query("PROJ1:BY 1.5;:PROJ1:BY?;:FITT:DOVE?") == "1.50;OUT"
    without = replace(A7, elements={name: each for name, each in A7.elements.items() if name != "by1"})
    client = EngineClient(SharedInstrument(Autograph(without)))
    client.query("PROJ1:BY 1;:PROJ2:BY 1;:COMM:PHI 101")
    assert client.errors() == [-221, -221]


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("COUN?", "200.00,200.00,-300.00"),
        ("COUN:X? ;Y?", "200.00;200.00"),
        ("DRIV:X 154.00;:WHE:Y 1.5;:COUN?", "154.00,201.50,-300.00"),
        ("COUN:Z:PRES 12.5;:WHE:Z 1;:COUN:Z?", "13.50"),
        ('GEAR:HEIG "1:10000";:COUN:Z:PRES 0;:DRIV:Z 5;:COUN:Z?;:GEAR:HEIG?', '5.00;"1:10000"'),
        ('COUN:Z:PRES 0;:GEAR:HEIG "1:5000";:WHE:Z 5;:COUN:Z?;*RST;:COUN:Z?', "5.00;-1495.00"),
        ("COMM:PHI 101.5;:COMM:PHI?;:COMM:PHI? MIN;:COMM:PHI? DEF", "101.50;90.00;100.00"),
        ("BASE:MODE IN;:BASE:MODE?", "IN"),
        ('COMM:PHI 99;:BASE:BX 80;:REC "7",CPHI,BX;:REC:LAST?', '1,"7",200.00,200.00,-300.00,CPHI,99.00,BX,80.00'),
        ("DRIV:X 180;:COUN:X:PRES 1;:SYST:ERR:COUN?;:*RST;:COUN:X?", "1;180.00"),
    ],
)
def test_scales_and_elements_answer_over_the_link(line, reply):
    assert an_a8().query(line) == reply


def test_a_scale_reading_accepts_no_unit_of_length():
    client = an_a8()
    client.query("DRIV:X 180 MM")
    assert client.errors() == [-138]
    assert EngineClient().query("DRIV:X 180 MM;:COUN:X?") == "180.00"


@given(st.sampled_from("XY"), st.floats(-50.0, 50.0))
def test_a_unit_of_the_scales_is_2_mm_of_the_model(axis, amount):
    a8 = Autograph(A8)
    a8.turn_handwheel(axis, amount)
    moved = a8.mark_in_model()["XY".index(axis)]
    assert moved == pytest.approx(2.0 * amount)
    assert a8.counter(axis) == pytest.approx(200.0 + moved / 2.0, abs=0.005 + 1e-9)


@given(st.sampled_from(sorted(A8.elements)), st.floats(0.0, 1.0))
def test_every_element_of_an_a8_reads_back_the_value_that_was_set(name, share):
    element, a8 = A8.elements[name], Autograph(A8)
    value = round(element.low + share * (element.high - element.low), 2)
    a8.set_element(name, value)
    assert a8.element(name) in (value, value % 400.0)


@given(st.floats(10.0, 280.0))
def test_the_base_line_reads_200_and_the_left_centre_is_at_200_less_a_quarter_of_the_base(base):
    a8 = Autograph(A8)
    a8.set_element("bx", base)
    shown = a8.element("bx")
    left, right = (a8.readings_at(a8.pose(n)[0]) for n in (1, 2))
    assert left == pytest.approx({"X": 200.0 - shown / 4.0, "Y": 200.0, "Z": 0.0})
    assert right == pytest.approx({"X": 200.0 + shown / 4.0, "Y": 200.0, "Z": 0.0})


def test_the_left_centre_of_a_documented_setting_agrees_with_the_rule():
    """G:1048639142/410 gives X 180.1, Y 200.1 for bx 80: the left centre, by P's rule 200 - 80/4."""
    a8 = Autograph(A8)
    a8.set_element("bx", 80.0)
    left = a8.readings_at(a8.pose(1)[0])
    assert (left["X"], left["Y"]) == pytest.approx((180.1, 200.1), abs=0.1 + 1e-9)


@given(st.floats(91.0, 109.0), st.floats(92.0, 108.0), st.floats(92.0, 108.0), st.floats(0.0, 400.0))
def test_common_phi_turns_both_projectors_and_the_base_about_the_y_axis(common, phi, omega, kappa):
    level, turned = Autograph(A8), Autograph(A8)
    for a8 in (level, turned):
        for name, value in (("bx", 180.0), ("phi1", phi), ("omega2", omega), ("kappa2", kappa)):
            a8.set_element(name, value)
    turned.set_element("common_phi", common)
    frame = rotation(0.0, (turned.element("common_phi") - 100.0) * GON, 0.0)
    for n in (1, 2):
        (centre, camera), (turned_centre, turned_camera) = level.pose(n), turned.pose(n)
        np.testing.assert_allclose(turned_centre, frame @ centre, atol=1e-9)
        np.testing.assert_allclose(turned_camera, frame @ camera, atol=1e-12)


def test_common_phi_changes_no_parallax_and_levels_a_model():
    """If the mark follows the turn of the frame, both eyepieces show the same view: the model turns as a body."""
    points = {str(i): place for i, place in enumerate(GROUND.T)}
    pictures = _pictures_of(points, (0.6, -0.4, 1.0), (-0.5, 0.7, -2.0))
    a8 = _set_up(pictures, (0.6, -0.4, 1.0), (-0.5, 0.7, -2.0))
    a8.set_element("common_phi", 101.2)
    frame = rotation(0.0, 1.2 * GON, 0.0)
    for name, place in points.items():
        x, y, z = frame @ place
        a8.drive("X", 200.0 + x / 2.0)
        a8.drive("Y", 200.0 + y / 2.0)
        a8.drive("Z", z)
        assert np.abs(a8.eyepiece(1, name)).max() < 10.0
        assert abs(a8.stereo(name)[1]) < 0.2


def _pictures_of(points, *tilts):
    """Return two photographs of model points, for projectors tilted by omega, phi, kappa in gon."""
    return {
        name: photograph(name, {point: image_of(place, centre, _turn(tilt), C) for point, place in points.items()})
        for name, centre, tilt in zip(
            "LR", (np.array([-BASE / 2.0, 0.0, 0.0]), np.array([BASE / 2.0, 0.0, 0.0])), tilts, strict=True
        )
    }


def _turn(tilt):
    return rotation(*(np.array(tilt) * GON))


def _set_up(pictures, *tilts) -> Autograph:
    a8 = Autograph(A8, photographs=pictures)
    a8.set_element("bx", BASE)
    for n, name, (omega, phi, kappa) in zip((1, 2), "LR", tilts, strict=True):
        a8.load(n, name)
        for element, value in ((f"c{n}", C), (f"omega{n}", 100.0 + omega), (f"phi{n}", 100.0 + phi)):
            a8.set_element(element, value)
        a8.set_element(f"kappa{n}", kappa % 400.0)
    return a8


def test_readings_of_a_model_become_its_coordinates_by_the_rules_of_p():
    """P 3.1 and 3.2 over the link: set the mark on every point, read the scales, put the left centre at the origin."""
    points = {str(i): place for i, place in enumerate(GROUND.T)}
    tilts = (0.6, -0.4, 1.0), (-0.5, 0.7, -2.0)
    client = EngineClient(SharedInstrument(_set_up(_pictures_of(points, *tilts), *tilts)))
    client.query('GEAR:HEIG "1:10000"')
    client.query("DRIV:Z -300;:COUN:Z:PRES 400")
    readings = []
    for name, (x, y, z) in points.items():
        client.query(f"DRIV:X {200 + x / 2:.2f};Y {200 + y / 2:.2f};Z {z + 700:.2f}")
        px, py = client.numbers(f'EYEP:STER? "{name}"')
        dx, dy = client.numbers(f'EYEP1? "{name}"')
        assert abs(py) < 0.01
        assert abs(px) < 10.0
        assert np.hypot(dx, dy) < 10.0
        readings.append(client.numbers("COUN?"))
    found = a8_model_coordinates(np.array(readings).T, BASE, 300.0, 400.0)
    np.testing.assert_allclose(found, GROUND + np.array([[BASE / 2.0], [0.0], [0.0]]), atol=0.011)
    assert client.errors() == []


def test_a_negative_is_seen_unmirrored_with_the_fittings_of_an_a8():
    """An A8 has no Dove index and no triangulation lever, so neither mirrors the view."""
    a8 = Autograph(A8, photographs={"L": photograph("L", {"P": (1.0, 2.0)}, polarity="negative")})
    a8.load(1, "L")
    a8.set_fitting("diapositive", "right")
    a8.set_fitting("ycollar", "in")
    assert a8.eyepiece(1, "P") == pytest.approx((1000.0, 2000.0))
    a8.turn_handwheel("Y", 0.5)
    assert a8.counter("Y") == 200.5
    assert a8.eyepiece(1, "P")[1] == pytest.approx(1500.0)


def test_an_a8_opens_as_a_serial_port_with_its_pictures():
    with serial_for_url("a7sim://a8-strip?seed=3", timeout=1) as port:
        port.write(b'*IDN?;:PHOT:CAT?;:COUN?\nPHOT1:LOAD "201";:PHOT1?;:SYST:ERR?\n')
        identity, pictures, counters = port.readline().decode("ascii").strip().split(";")
        assert identity.split(",")[1:3] == ["A8", "A8"]
        assert pictures.split(",")[0] == '"201"'
        assert counters == "200.00,200.00,-300.00"
        assert port.readline() == b'"201";0,"No error"\n'


def test_the_rods_of_an_a8_have_a_limited_reach():
    client = an_a8()
    client.query("BASE:BX 200;:DRIV:Z -175;:DRIV:X 320")
    assert client.errors() == [-222]
    assert client.query("COUN:X?") == "200.00"
