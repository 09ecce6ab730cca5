"""XML point maps and tables of points."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import ReadError
from leafcut.options import ReadOptions
from leafcut.read import csvmap, read, xmlmap
from leafcut.read.format import Source


def holes(part):
    return [(h.x, h.y, h.diameter, h.handle) for h in part.holes]


def codes(part):
    return sorted(i.code for i in part.issues)


def refusal(path):
    with pytest.raises(ReadError) as caught:
        read(path)
    assert "\n" not in str(caught.value)
    return caught.value


def test_a_map_with_spanish_names(text_file):
    """The places of a map by their Spanish tags, fields and units; an inch is 25.4 mm."""
    text = '<mapa unidades="pulgadas"><ciudad nombre="A" x="1" y="2" diámetro="0.25"/>'
    text += "<punto><x>3</x><y>0</y><nombre>B</nombre></punto></mapa>"
    assert holes(read(text_file("a.xml", text))) == [(25.4, 50.8, 6.35, "A"), (76.2, 0.0, 0.0, "B")]


def test_a_height_out_of_range_skips_its_row_alone(text_file):
    part = read(text_file("a.csv", "x,y,d,z\n1,2,3,1e9\n4,5,6,-7\n"))
    assert [(h.x, h.z) for h in part.holes] == [(4, -7)]
    assert [str(issue) for issue in part.issues if issue.code == "L208"] == [
        "L208 row skipped: z 1e+09 mm is out of range (a.csv:2)"
    ]


def test_files_whose_points_are_all_left_out_are_refused_with_the_reason(text_file):
    for name, text in (("a.csv", "x,y,layer\n1,2,A\n"), ("a.xml", '<map><hole x="1" y="2" layer="A"/></map>')):
        with pytest.raises(ReadError, match=r"no holes: .*layer") as caught:
            read(text_file(name, text), ReadOptions(layers=("B",)))
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        '<map units="mm"><city name="A" x="1" y="2"/><city name="B" x="3" y="4.5"/></map>',
        '<?xml version="1.0"?><anything units="mm"><POINT id="A" X="1" Y="2"/>\n'
        '<g><hole name="B" x="3" y="4.5"/></g></anything>',
        '<m:map xmlns:m="u" units=" MM "><m:node m:name="A"><m:x> 1 </m:x><m:y>2</m:y></m:node>\n'
        '<m:node x="3"><m:y>4.5</m:y><m:name>B</m:name></m:node></m:map>',
        '<map units="cm"><city name="A" x="0.1" y="0.2"/><city name="B" x="0.3" y="0.45"/></map>',
    ],
)
def test_points_are_read_in_attribute_and_element_style_under_any_of_their_names(text_file, text):
    part = read(text_file("a.xml", text))
    assert holes(part) == [(1, 2, 0, "A"), (3, 4.5, 0, "B")]
    assert not part.issues


def test_units_and_diameters_of_a_map_are_mm_inside(text_file):
    part = read(
        text_file("a.xml", '<map units="inch"><hole x="1" y="2" diameter="0.25"/><hole x="3" y="0" d="1"/></map>')
    )
    assert holes(part) == [(25.4, 50.8, 6.35, ""), (76.2, 0, 25.4, "")]
    assert part.units == "inch"


def test_a_map_without_units_is_taken_as_mm_and_noted(text_file):
    path = text_file("a.xml", '<map><city x="1" y="2"/></map>')
    assert codes(read(path)) == ["L102"]
    assert read(path, ReadOptions(units="in", strict=True)).holes[0].x == 25.4


@pytest.mark.parametrize(
    "bad", ['x="" y="1"', 'y="1"', 'x="1" y="one"', 'x="nan" y="1"', 'x="1" y="2" d="-1"', 'x="1e9" y="0"']
)
def test_a_point_with_missing_or_impossible_numbers_is_skipped_with_its_line(text_file, bad):
    part = read(text_file("a.xml", f'<map units="mm">\n<city x="1" y="2"/>\n<city {bad}/>\n</map>'))
    assert len(part.holes) == 1
    (issue,) = part.issues
    assert (issue.code, issue.place) == ("L203", "a.xml:3")


@pytest.mark.parametrize(
    "text, line, words",
    [
        ('<map>\n<city x="1" y="2">\n</map>', 3, "not well-formed"),
        ('<map units="parsec"><city x="1" y="2"/></map>', 1, "unknown units 'parsec'"),
        ('<map units="milimeter"><city x="1" y="2"/></map>', 1, "unknown units"),
        ("<map><town x='1' y='2'/></map>", None, "expected <city>"),
        ('<map>\n<city x="a" y="2"/></map>', 2, "no usable points"),
        ("<map/>", None, "no points"),
    ],
)
def test_a_map_that_cannot_be_used_is_refused_with_its_line(text_file, text, line, words):
    problem = refusal(text_file("a.xml", text))
    assert problem.line == line
    assert words in str(problem)


def test_entity_bombs_and_external_entities_are_refused(text_file, tmp_path):
    secret = tmp_path / "secret.txt"
    secret.write_text("12345")
    bomb = '<!DOCTYPE map [<!ENTITY a "1"><!ENTITY b "&a;&a;">]><map><city x="&b;" y="1"/></map>'
    outside = f'<!DOCTYPE map [<!ENTITY a SYSTEM "file://{secret}">]><map><city x="&a;" y="1"/></map>'
    parameter = f'<!DOCTYPE map [<!ENTITY % a SYSTEM "file://{secret}"> %a;]><map><city x="1" y="1"/></map>'
    dtd = f'<!DOCTYPE map SYSTEM "file://{secret}"><map><city x="1" y="1"/></map>'
    for text in (bomb, outside, parameter, dtd):
        message = str(refusal(text_file("a.xml", text)))
        assert "refused" in message
        assert "12345" not in message


def test_a_deep_or_long_map_neither_recurses_nor_slows_down(text_file):
    deep = "<g>" * 20_000 + '<city x="1" y="2"/>' + "</g>" * 20_000
    assert len(read(text_file("a.xml", f"<map>{deep}</map>")).holes) == 1


@pytest.mark.parametrize(
    "text",
    [
        "1,2,6,A\n3,4.5,,B\n",
        "# map\n1;2;6;A\n\n3;4,5;;B\n",
        "1\t2\t6\tA\n3\t4,5\t\tB\n",
        "x,y,diameter,name\n1,2,6,A\n3,4.5,,B\n",
        "Name;D;Y;X\nA;6;2;1\nB;;4,5;3\n",
        '\ufeffx (mm),y [mm],d_mm,name\r\n1,2,6,A\r\n3,4.5,0,"B"\r\n',
        "1.0, 2, 6.0, A\n3e0, 45e-1, 0, B",
    ],
)
def test_tables_of_every_style_say_the_same(text_file, text):
    assert holes(read(text_file("a.csv", text))) == [(1, 2, 6, "A"), (3, 4.5, 0, "B")]


def test_blanks_part_fields_and_a_third_word_is_a_name(text_file):
    part = read(text_file("a.txt", "1 2\n 3   4.5  B\n-5 6 0.5\n"))
    assert holes(part) == [(1, 2, 0, ""), (3, 4.5, 0, "B"), (-5, 6, 0.5, "")]


def test_units_of_a_table_come_from_the_option_or_the_header(text_file):
    assert holes(read(text_file("a.csv", "1,2,0.25\n"), ReadOptions(units="in"))) == [(25.4, 50.8, 6.35, "")]
    assert holes(read(text_file("b.csv", "x_in,y_in\n1,2\n"))) == [(25.4, 50.8, 0, "")]


@pytest.mark.parametrize("row", ["one,2", "5", "nan,3", "1_0,3", "1e9,3", "5,6,-1", '"5,6'])
def test_a_bad_row_is_skipped_with_its_line(text_file, row):
    part = read(text_file("a.csv", f"x,y,d\n1,2,3\n{row}\n4,5,6\n"), ReadOptions(units="mm"))
    assert len(part.holes) == 2
    (issue,) = part.issues
    assert (issue.code, issue.place) == ("L208", "a.csv:3")


def test_many_bad_rows_are_counted(text_file):
    part = read(text_file("a.csv", "1,2\n" + "?,?\n" * 500), ReadOptions(units="mm"))
    assert len(part.issues) == csvmap.NAMED_ROWS + 1


@pytest.mark.parametrize(
    "text, line", [("a,b\nc,d\n", 1), ("x,z\n1,2\n", 1), ("x,y\n", None), ("# nothing\n", None), ("x,y\n\n?,?\n", 3)]
)
def test_a_table_without_points_is_refused(text_file, text, line):
    assert refusal(text_file("a.csv", text)).line == line


def test_doubled_holes_of_a_table_are_merged_and_near_bare_points_are_not(text_file):
    part = read(text_file("a.csv", "1,2,3\n1.001,2,3\n5,5\n5.001,5\n5,5\n"), ReadOptions(units="mm"))
    assert holes(part) == [(1, 2, 3, ""), (5, 5, 0, ""), (5.001, 5, 0, "")]
    assert codes(part) == ["L301"]


def test_layers_of_a_map_are_chosen_and_points_without_one_stay(text_file):
    path = text_file("a.csv", "x,y,layer\n1,2,A\n3,4,B\n5,6,\n")
    part = read(path, ReadOptions(layers=("a",), units="mm"))
    assert [h.x for h in part.holes] == [1, 5]
    assert codes(part) == ["L204"]


coordinates = st.floats(-1e6, 1e6, allow_subnormal=False)
points = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=20, unique=True)


@settings(max_examples=settings().max_examples * 5)
@given(points)
def test_points_written_as_a_table_or_a_map_come_back_exactly(xy):
    table = "\n".join(f"{x!r};{y!r}" for x, y in xy)
    cities = "".join(f'<city x="{x!r}" y="{y!r}"/>' for x, y in xy)
    options = ReadOptions(units="mm")
    for read_one, text in ((csvmap.read_csv, table), (xmlmap.read_xml, f"<map>{cities}</map>")):
        part = read_one(Source("a", text.encode()), options)
        assert [(h.x, h.y) for h in part.holes] == xy
