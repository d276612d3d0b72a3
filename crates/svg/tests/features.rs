//! One test per feature of SVG, on small files of our own.

use drawing::{Segment, Stroke};
use svg::{
    Document, FaceQuery, Options, OutlineFonts, OutlineGlyph, Pen, Pens, Point, Severity, StrokeFont,
    StrokeGlyph,
};

/// A page of 100 mm with user units of 1 mm; strokes are black, fills none.
fn page(content: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" width=\"100mm\" height=\"100mm\" \
         viewBox=\"0 0 100 100\" stroke=\"black\" fill=\"none\">{content}</svg>"
    )
}

fn read(content: &str) -> Document {
    svg::read(page(content).as_bytes(), &Options::default())
}

fn strokes(content: &str) -> Vec<Stroke> {
    let document = read(content);
    assert!(
        document.diagnostics.iter().all(|found| found.severity == Severity::Note),
        "{:?}",
        document.diagnostics
    );
    document.drawing.strokes.to_vec()
}

/// The ends of straight strokes, with y down as in the file.
fn lines(content: &str) -> Vec<[f64; 4]> {
    let ends = |stroke: &Stroke| {
        let (from, to) = (stroke.start(), stroke.end());
        [from.x, 100.0 - from.y, to.x, 100.0 - to.y].map(|mm| (mm * 1e9).round() / 1e9)
    };
    strokes(content).iter().map(ends).collect()
}

fn codes(document: &Document) -> Vec<(&'static str, u64)> {
    document.diagnostics.iter().map(|found| (found.code.name(), found.count)).collect()
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn page_is_in_mm_with_y_up() {
    let document = read("<path d='M10 20L30 40'/>");
    assert_eq!(document.page_mm, [100.0, 100.0]);
    let stroke = &document.drawing.strokes.to_vec()[0];
    assert_eq!((stroke.start(), stroke.end()), (Point::new(10.0, 80.0), Point::new(30.0, 60.0)));
    let text = page("<path d='M10 20L30 40'/>");
    assert_eq!(&text[stroke.source().start..stroke.source().end], "<path d='M10 20L30 40'/>");
}

#[test]
fn circle_stays_one_closed_arc() {
    let strokes = strokes("<circle cx='50' cy='50' r='100' transform='rotate(30) scale(.3)'/>");
    assert!(strokes[0].is_closed());
    let segments: Vec<Segment> = strokes[0].segments().collect();
    let [Segment::Arc(arc)] = segments[..] else { panic!("{segments:?}") };
    assert!(close(arc.circle_radius().unwrap(), 30.0));
    assert!(close(strokes[0].length(), 60.0 * std::f64::consts::PI));
}

#[test]
fn ellipse_stays_an_arc_under_shear() {
    let strokes = strokes("<ellipse cx='50' cy='50' rx='20' ry='10' transform='skewX(20)'/>");
    let Some(Segment::Arc(arc)) = strokes[0].segments().next() else { panic!() };
    assert!(arc.circle_radius().is_none());
    let (long, short) = arc.semi_axes();
    // A shear keeps area.
    assert!(close(long * short, 200.0));
}

#[test]
fn arc_command_stays_an_arc() {
    let strokes = strokes("<path d='M10 50A40 40 0 0 1 90 50'/>");
    let Some(Segment::Arc(arc)) = strokes[0].segments().next() else { panic!() };
    assert!(close(arc.circle_radius().unwrap(), 40.0));
    assert!(close(arc.eval(0.5).y, 90.0), "{:?}", arc.eval(0.5));
}

#[test]
fn rounded_rectangle_has_four_quarter_arcs() {
    let strokes = strokes("<rect x='10' y='10' width='40' height='20' rx='5'/>");
    let arcs = strokes[0].segments().filter(|segment| matches!(segment, Segment::Arc(_))).count();
    assert_eq!((arcs, strokes[0].segment_count(), strokes[0].is_closed()), (4, 8, true));
    assert!(close(strokes[0].length(), 2.0 * (30.0 + 10.0) + 10.0 * std::f64::consts::PI));
}

#[test]
fn polygon_is_closed_and_polyline_is_not() {
    let strokes = strokes("<polygon points='10,10 20,10 20,20'/><polyline points='10 10 20 10 20 20'/>");
    assert_eq!(strokes.iter().map(Stroke::is_closed).collect::<Vec<_>>(), [true, false]);
}

#[test]
fn quadratic_is_the_same_curve_as_a_cubic() {
    let strokes = strokes("<path d='M0 0Q30 60 60 0'/>");
    let middle = strokes[0].segments().next().unwrap().eval(0.5);
    assert!(close(middle.x, 30.0) && close(100.0 - middle.y, 30.0));
}

#[test]
fn transforms_compose_from_outside_in() {
    let content = "<g transform='translate(10 0)'><g transform='rotate(90)'><line x2='5' y2='0'/></g></g>";
    assert_eq!(lines(content), [[10.0, 0.0, 10.0, 5.0]]);
}

#[test]
fn lengths_have_units() {
    let found = lines("<line x1='1in' y1='1cm' x2='50%' y2='72pt'/>");
    assert_eq!(found, [[96.0, (960.0_f64 / 25.4 * 1e9).round() / 1e9, 50.0, 96.0]]);
}

fn length_and_page(head: &str) -> ([f64; 2], f64) {
    let text = format!("{head}<path d='M0 0H96' stroke='red'/></svg>");
    let document = svg::read(text.as_bytes(), &Options::default());
    (document.page_mm, document.drawing.length())
}

#[test]
fn pixels_are_96_per_inch() {
    let (page, length) = length_and_page("<svg xmlns='http://www.w3.org/2000/svg' width='960' height='2in'>");
    assert!(close(page[0], 254.0) && close(page[1], 50.8) && close(length, 25.4));
}

#[test]
fn view_box_alone_is_in_pixels() {
    let (page, length) = length_and_page("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 192 96'>");
    assert!(close(page[0], 50.8) && close(page[1], 25.4) && close(length, 25.4));
}

#[test]
fn old_illustrator_has_72_pixels_per_inch() {
    let head = "<!-- Generator: Adobe Illustrator 9.0 --><svg xmlns='http://www.w3.org/2000/svg' width='72' height='72'>";
    let (page, length) = length_and_page(head);
    assert!(close(page[0], 25.4) && close(length, 96.0 / 72.0 * 25.4));
}

#[test]
fn aspect_ratio_meets_slices_and_stretches() {
    let head = |ratio: &str| {
        format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='96mm' height='20mm' viewBox='0 0 96 40' \
             preserveAspectRatio='{ratio}'>"
        )
    };
    for (ratio, expected) in [("xMidYMid", 48.0), ("none", 96.0), ("xMinYMin slice", 96.0)] {
        assert!(close(length_and_page(&head(ratio)).1, expected), "{ratio}");
    }
}

#[test]
fn file_without_size_has_its_ink_above_zero() {
    let text = "<svg xmlns='http://www.w3.org/2000/svg'><path d='M10 20V96' stroke='red'/></svg>";
    let document = svg::read(text.as_bytes(), &Options::default());
    let bounds = document.drawing.bounding_box().unwrap();
    assert!(close(bounds.y0, 0.0) && close(bounds.y1, 76.0 * 25.4 / 96.0));
}

#[test]
fn style_sheets_attributes_and_inheritance() {
    let content = "<style>.gone{stroke:none} #b{stroke:red} g .c{display:none}</style>\
        <path d='M0 0H1'/><path class='gone' d='M0 1H2'/><path id='b' class='gone' d='M0 2H3'/>\
        <g><path class='c' d='M0 3H4'/></g><path style='stroke:none' stroke='red' d='M0 4H5'/>\
        <g stroke='none'><path d='M0 5H6'/><path d='M0 6H7' style='stroke:#00f'/></g>";
    let ends: Vec<f64> = lines(content).iter().map(|line| line[2]).collect();
    assert_eq!(ends, [1.0, 3.0, 7.0]);
}

#[test]
fn hidden_elements_are_skipped() {
    let content = "<g style='display:none'><path d='M0 0H1'/></g>\
        <g visibility='hidden'><path d='M0 0H2'/><path visibility='visible' d='M0 0H3'/></g>\
        <g opacity='0'><path d='M0 0H4'/></g><path stroke-opacity='0' d='M0 0H5'/>\
        <path stroke-width='0' d='M0 0H6'/>";
    let ends: Vec<f64> = lines(content).iter().map(|line| line[2]).collect();
    assert_eq!(ends, [3.0]);
    let document = read(content);
    assert_eq!(codes(&document), [("S0211", 3), ("S0221", 1), ("S0213", 1)]);
}

#[test]
fn use_draws_symbols_and_shapes_at_their_places() {
    let content = "<defs><line id='l' x2='10'/>\
        <symbol id='s' viewBox='0 0 10 10'><line x2='10'/></symbol></defs>\
        <use href='#l' x='5' y='6'/><use xlink:href='#l' transform='translate(1 2)'/>\
        <use href='#s' x='20' y='30' width='20' height='20'/>";
    assert_eq!(lines(content), [[5.0, 6.0, 15.0, 6.0], [1.0, 2.0, 11.0, 2.0], [20.0, 30.0, 40.0, 30.0]]);
}

#[test]
fn nested_svg_is_clipped_to_its_viewport() {
    let content = "<svg x='10' y='10' width='20' height='20' viewBox='0 0 10 10'><line x1='-5' y1='5' x2='50' y2='5'/></svg>";
    assert_eq!(lines(content), [[10.0, 20.0, 30.0, 20.0]]);
    let visible = content.replace("<svg x", "<svg overflow='visible' x");
    assert_eq!(lines(&visible), [[0.0, 20.0, 110.0, 20.0]]);
}

#[test]
fn switch_draws_the_first_that_applies() {
    let content = "<switch><g requiredExtensions='x'><path d='M0 0H1'/></g><path systemLanguage='de' d='M0 0H2'/>\
        <path systemLanguage='de, en' d='M0 0H3'/><path d='M0 0H4'/></switch>";
    assert_eq!(lines(content), [[0.0, 0.0, 3.0, 0.0]]);
}

#[test]
fn clip_path_cuts_lines_at_the_crossing() {
    let content = "<clipPath id='c'><circle cx='50' cy='50' r='10'/></clipPath>\
        <path clip-path='url(#c)' d='M0 50H100'/>";
    assert_eq!(lines(content), [[40.0, 50.0, 60.0, 50.0]]);
}

#[test]
fn clipped_circle_stays_arcs() {
    let content = "<clipPath id='c'><rect width='50' height='100'/></clipPath>\
        <circle clip-path='url(#c)' cx='50' cy='50' r='10'/>";
    let strokes = strokes(content);
    assert_eq!(strokes.len(), 1);
    assert!(strokes[0].segments().all(|segment| matches!(segment, Segment::Arc(_))));
    assert!(close(strokes[0].length(), 10.0 * std::f64::consts::PI));
}

#[test]
fn clip_rule_and_union_of_children() {
    let ring = "M10 10H40V40H10ZM20 20H30V30H20Z";
    let line = "<path clip-path='url(#c)' d='M0 25H100'/>";
    let even = format!("<clipPath id='c'><path clip-rule='evenodd' d='{ring}'/></clipPath>{line}");
    assert_eq!(lines(&even), [[10.0, 25.0, 20.0, 25.0], [30.0, 25.0, 40.0, 25.0]]);
    let union =
        format!("<clipPath id='c'><path d='{ring}'/><rect x='35' width='20' height='50'/></clipPath>{line}");
    assert_eq!(lines(&union), [[10.0, 25.0, 55.0, 25.0]]);
}

#[test]
fn clip_paths_nest_and_follow_bounding_boxes() {
    let nested = "<clipPath id='a'><rect width='50' height='100'/></clipPath>\
        <clipPath id='b' clip-path='url(#a)'><rect x='30' width='50' height='100'/></clipPath>\
        <g clip-path='url(#b)'><path d='M0 10H100'/></g>";
    assert_eq!(lines(nested), [[30.0, 10.0, 50.0, 10.0]]);
    let boxed = "<clipPath id='c' clipPathUnits='objectBoundingBox'><rect x='.25' width='.5' height='1'/></clipPath>\
        <path clip-path='url(#c)' d='M0 0V10H40'/>";
    assert_eq!(lines(boxed), [[10.0, 10.0, 30.0, 10.0]]);
}

#[test]
fn clip_paths_in_the_bounding_box_of_a_group() {
    let clip =
        "<clipPath id='c' clipPathUnits='objectBoundingBox'><rect x='.25' width='.5' height='1'/></clipPath>";
    // The group's box goes from 10, 0 to 50, 10; nested transforms count, its own transform does not.
    let content = format!(
        "{clip}<g clip-path='url(#c)' transform='translate(0 20)'><path d='M10 0H50'/>\
         <g transform='scale(2)'><path d='M5 5H25'/></g></g>"
    );
    assert_eq!(lines(&content), [[20.0, 20.0, 40.0, 20.0], [20.0, 30.0, 40.0, 30.0]]);
    // A group that is clipped so within another one, and by `use`.
    let content = format!(
        "{clip}<g clip-path='url(#c)'><path d='M0 40V60'/><g id='i' clip-path='url(#c)'><path d='M0 50H80V52'/></g></g>"
    );
    assert_eq!(lines(&content), [[20.0, 50.0, 60.0, 50.0]]);
    let content =
        format!("{clip}<defs><path id='p' d='M0 0H80V2'/></defs><use href='#p' y='7' clip-path='url(#c)'/>");
    assert_eq!(lines(&content), [[20.0, 7.0, 60.0, 7.0]]);
}

#[test]
fn ink_on_the_clip_outline_stays() {
    let content = "<clipPath id='c'><rect x='10' y='10' width='20' height='20'/></clipPath>\
        <rect clip-path='url(#c)' x='10' y='10' width='20' height='20'/>";
    assert!(close(strokes(content)[0].length(), 80.0));
}

#[test]
fn dashes_are_strokes() {
    let content = "<path stroke-dasharray='10 5' stroke-dashoffset='5' d='M0 0H40'/>";
    assert_eq!(lines(content), [[0.0, 0.0, 5.0, 0.0], [10.0, 0.0, 20.0, 0.0], [25.0, 0.0, 35.0, 0.0]]);
    let scaled = "<path stroke-dasharray='1' pathLength='4' d='M0 0H40'/>";
    assert_eq!(lines(scaled), [[0.0, 0.0, 10.0, 0.0], [20.0, 0.0, 30.0, 0.0]]);
}

#[test]
fn markers_turn_with_the_path() {
    let content = "<marker id='m' orient='auto' markerUnits='userSpaceOnUse' overflow='visible'>\
        <path d='M0 0H-2'/></marker><path marker-end='url(#m)' d='M10 10V30'/>";
    assert_eq!(lines(content), [[10.0, 10.0, 10.0, 30.0], [10.0, 30.0, 10.0, 28.0]]);
}

#[test]
fn markers_scale_with_the_stroke_and_their_view_box() {
    let content = "<marker id='m' viewBox='0 0 10 10' refX='5' refY='5' markerWidth='5' markerHeight='5'>\
        <path d='M0 5H10'/></marker><path stroke-width='2' marker-mid='url(#m)' d='M10 10H20H30'/>";
    assert_eq!(lines(content)[1], [15.0, 10.0, 25.0, 10.0]);
}

#[test]
fn dots_need_caps() {
    let strokes = strokes("<path stroke-linecap='round' d='M5 5h0'/><path d='M6 6h0'/><path d='M7 7'/>");
    assert_eq!(strokes.len(), 1);
    assert!(strokes[0].is_dot());
}

#[test]
fn fills_are_counted_or_hatched() {
    let content = "<rect stroke='none' fill='red' x='10' y='10' width='20' height='20'/>\
        <path stroke='none' fill='red' d='M50 50h20v20h-20zM55 55h10v10h-10z' fill-rule='evenodd'/>\
        <rect fill='blue' width='5' height='5'/>";
    assert_eq!(codes(&read(content)), [("S0201", 2), ("S0202", 1)]);
    let hatch = svg::Hatch { spacing_mm: 0.5, angle_rad: 0.3 };
    let options = Options { hatch: Some(hatch), ..Options::default() };
    let document = svg::read(page(content).as_bytes(), &options);
    assert!(document.diagnostics.is_empty());
    // Length times spacing is the area, but for the ends of lines; the third shape has its outline
    // too.
    let ink = document.drawing.length() - 20.0;
    assert!((ink * 0.5 - (400.0 + 300.0 + 25.0)).abs() < 10.0, "{ink}");
}

#[test]
fn what_pens_cannot_draw_is_named() {
    let content = "<image href='x.png' width='1' height='1'/><foreignObject/><rect mask='url(#m)' width='5' height='5'/>\
        <rect filter='url(#f)' width='5' height='5'/><linearGradient id='g'><stop stop-color='red'/></linearGradient>\
        <rect stroke='url(#g)' width='5' height='5'/><whatever/>";
    let document = read(content);
    let expected = ["S0203", "S0207", "S0204", "S0205", "S0206", "S0112"].map(|code| (code, 1));
    assert_eq!(codes(&document), expected);
    assert_eq!(document.pens[&Pen(2)].color, Some([255, 0, 0]));
}

#[test]
fn findings_have_line_column_and_element() {
    let text = page("\n\n  <g>\n    <image id='logo'/></g>");
    let document = svg::read(text.as_bytes(), &Options::default());
    let found = &document.diagnostics[0];
    assert_eq!((found.line, found.column, found.element.as_str()), (4, 5, "image#logo"));
    assert_eq!(&text[found.span.start..found.span.end], "<image id='logo'/>");
}

#[test]
fn layers_with_numbers_are_pens() {
    let layer = |label: &str, more: &str| {
        format!("<g inkscape:groupmode='layer' inkscape:label='{label}' {more}><path d='M0 0H1'/></g>")
    };
    let content = [
        layer("3 red", ""),
        layer("outline", ""),
        layer("%guides", ""),
        layer("hidden", "style='display:none'"),
        layer("Pen 7", ""),
        layer("1", ""),
        layer("last", ""),
    ]
    .concat();
    let document = read(&content);
    let pens: Vec<u16> = document.drawing.strokes.iter().map(|stroke| stroke.pen.0).collect();
    assert_eq!(pens, [3, 2, 7, 1, 4]);
    assert_eq!(document.pens[&Pen(3)].name.as_deref(), Some("3 red"));
    assert_eq!(codes(&document), [("S0220", 1), ("S0211", 1)]);
}

#[test]
fn groups_at_the_top_are_layers_of_other_programs() {
    let document =
        read("<g id='_x32__blue'><path d='M0 0H1'/></g><g id='a'><g id='b'><path d='M0 0H1'/></g></g>");
    let pens: Vec<u16> = document.drawing.strokes.iter().map(|stroke| stroke.pen.0).collect();
    assert_eq!(pens, [2, 1]);
    assert_eq!(document.pens[&Pen(2)].name.as_deref(), Some("2_blue"));
}

#[test]
fn colors_are_pens_in_order_of_appearance() {
    let content = "<g id='l'><path stroke='#0f0' d='M0 0H1'/><path stroke='rgb(255,0,0)' d='M0 0H1'/>\
        <path stroke='lime' d='M0 0H1'/></g><g id='m'><path d='M0 0H1'/></g>";
    let pens = |pens| {
        let document = svg::read(page(content).as_bytes(), &Options { pens, ..Options::default() });
        document.drawing.strokes.iter().map(|stroke| stroke.pen.0).collect::<Vec<_>>()
    };
    assert_eq!(pens(Pens::Colors), [1, 2, 1, 3]);
    assert_eq!(pens(Pens::Layers), [1, 1, 1, 2]);
    assert_eq!(pens(Pens::One), [1, 1, 1, 1]);
}

/// Letters 10 high and 10 wide: an upright stroke.
#[derive(Debug)]
struct Sticks;

impl StrokeFont for Sticks {
    fn cap_height(&self) -> f64 {
        10.0
    }

    fn glyph(&self, character: char) -> Option<StrokeGlyph> {
        let stick = vec![Point::new(0.0, 0.0), Point::new(0.0, 10.0)];
        let strokes = if character == ' ' { Vec::new() } else { vec![stick] };
        character.is_ascii().then_some(StrokeGlyph { advance: 10.0, strokes })
    }
}

fn text(content: &str) -> (Vec<[f64; 4]>, Document) {
    let document =
        svg::read(page(content).as_bytes(), &Options { font: Some(&Sticks), ..Options::default() });
    let ends = document.drawing.strokes.iter().map(|stroke| {
        let (from, to) = (stroke.start(), stroke.end());
        [from.x, 100.0 - from.y, to.x, 100.0 - to.y].map(|mm| (mm * 1e6).round() / 1e6)
    });
    (ends.collect(), document)
}

#[test]
fn text_has_its_place_size_and_anchor() {
    let (found, document) =
        text("<text x='20' y='50' font-size='10' font-family=\"'Comic Sans', serif\" fill='red'>ab</text>");
    assert_eq!(found, [[20.0, 50.0, 20.0, 43.0], [27.0, 50.0, 27.0, 43.0]]);
    assert_eq!(codes(&document), [("S0208", 1)]);
    assert!(document.diagnostics[0].message.contains("Comic Sans"));
    let (found, _) = text("<text x='20' y='50' font-size='10' text-anchor='end' fill='red'>ab</text>");
    assert_eq!(found[0][0], 6.0);
}

#[test]
fn tspans_place_and_blanks_collapse() {
    let (found, _) = text(
        "<text x='10' y='20' font-size='10' fill='red'>\n  a <tspan> b</tspan><tspan x='30' dy='5'>c</tspan>\n</text>",
    );
    let starts: Vec<[f64; 2]> = found.iter().map(|line| [line[0], line[1]]).collect();
    assert_eq!(starts, [[10.0, 20.0], [24.0, 20.0], [30.0, 25.0]]);
}

/// Every letter is a square of half the font size on the base line; only the family "Known" exists.
#[derive(Debug)]
struct Squares;

impl OutlineFonts for Squares {
    fn family(&self, _query: FaceQuery<'_>) -> Option<String> {
        Some("Known".into())
    }

    fn glyph(&self, query: FaceQuery<'_>, character: char) -> Option<OutlineGlyph> {
        let side = if query.weight >= 700 { 1.0 } else { 0.5 };
        let corners = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)].map(Point::from);
        let line = |pair: &[Point]| Segment::Line(drawing::Line::new(pair[0], pair[1]));
        let square = corners.windows(2).map(line).collect();
        (character != 'x').then(|| OutlineGlyph {
            advance: 1.0,
            contours: if character == ' ' { Vec::new() } else { vec![square] },
        })
    }

    fn kerning(&self, _query: FaceQuery<'_>, pair: [char; 2]) -> f64 {
        if pair == ['A', 'V'] { -0.25 } else { 0.0 }
    }
}

#[test]
fn kerning_moves_the_next_letter_of_the_same_style() {
    let starts = |content: &str| -> Vec<f64> {
        let options = Options { outlines: Some(&Squares), ..Options::default() };
        let document = svg::read(page(content).as_bytes(), &options);
        document.drawing.strokes.iter().map(|stroke| stroke.bounding_box().x0).collect()
    };
    let text = |inner: &str| {
        format!("<text x='10' y='50' font-size='20' fill='#00f' font-family='Known'>{inner}</text>")
    };
    assert_eq!(starts(&text("AVA")), [10.0, 25.0, 45.0]);
    assert_eq!(starts(&text("VAA")), [10.0, 30.0, 50.0]);
    // Not across styles, and not before a letter with a place of its own.
    assert_eq!(starts(&text("A<tspan font-weight='bold'>V</tspan>")), [10.0, 30.0]);
    assert_eq!(starts(&text("A<tspan x='40'>V</tspan>")), [10.0, 40.0]);
}

#[test]
fn text_as_outlines() {
    let read = |content: &str, hatch: Option<svg::Hatch>| {
        let options = Options { outlines: Some(&Squares), hatch, ..Options::default() };
        svg::read(page(content).as_bytes(), &options)
    };
    let text = "<text x='10' y='50' font-size='20' fill='#00f' font-family='Known'>ab<tspan font-weight='bold'>c</tspan></text>";
    let document = read(text, None);
    let boxes: Vec<[f64; 4]> = document
        .drawing
        .strokes
        .iter()
        .map(|stroke| {
            let bounds = stroke.bounding_box();
            [bounds.x0, 100.0 - bounds.y1, bounds.x1, 100.0 - bounds.y0].map(|mm| (mm * 1e9).round() / 1e9)
        })
        .collect();
    assert_eq!(boxes, [[10.0, 40.0, 20.0, 50.0], [30.0, 40.0, 40.0, 50.0], [50.0, 30.0, 70.0, 50.0]]);
    assert!(document.drawing.strokes.iter().all(|stroke| stroke.is_closed()));
    assert_eq!(document.diagnostics, []);
    // Fills are hatched, other families and missing characters reported.
    let hatched = read(text, Some(svg::Hatch { spacing_mm: 1.0, angle_rad: 0.0 }));
    assert!((hatched.drawing.length() - document.drawing.length() - 600.0).abs() < 31.0);
    assert_eq!(
        codes(&read("<text font-family='Other' fill='red'>ax</text>", None)),
        [("S0208", 1), ("S0209", 1)]
    );
    // As a clip path.
    let clip = "<clipPath id='c'><text x='10' y='50' font-size='20'>a b</text></clipPath><path clip-path='url(#c)' d='M0 45H100'/>";
    let clipped = read(clip, None);
    let ends: Vec<[f64; 2]> = clipped
        .drawing
        .strokes
        .iter()
        .map(|s| [s.start().x, s.end().x].map(|mm| (mm * 1e9).round() / 1e9))
        .collect();
    assert_eq!(ends, [[10.0, 20.0], [50.0, 60.0]]);
}

#[test]
fn text_follows_a_path() {
    let (found, _) = text(
        "<defs><path id='p' d='M50 90V10'/></defs>\
         <text font-size='10' fill='red'><textPath xlink:href='#p' startOffset='50%' text-anchor='middle'>ab</textPath></text>",
    );
    // Letters 7 wide go up from y = 57; their tops point to the left.
    assert_eq!(found, [[50.0, 57.0, 43.0, 57.0], [50.0, 50.0, 43.0, 50.0]]);
}

#[test]
fn characters_without_glyph_are_reported() {
    let (_, document) = text("<text fill='red' y='9'>日a日</text>");
    assert_eq!(codes(&document), [("S0208", 1), ("S0209", 2)]);
}

#[test]
fn compressed_and_utf_16_files_are_read() {
    use std::io::Write as _;
    let plain = page("<path d='M0 0H1'/>");
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(plain.as_bytes()).unwrap();
    let gzipped = encoder.finish().unwrap();
    let utf16: Vec<u8> =
        [0xfe, 0xff].into_iter().chain(plain.encode_utf16().flat_map(u16::to_be_bytes)).collect();
    for bytes in [&gzipped, &utf16] {
        assert!(svg::looks_like_svg(bytes));
        assert_eq!(svg::read(bytes, &Options::default()).drawing.length(), 1.0);
    }
    let cut = svg::read(&gzipped[..gzipped.len() / 2], &Options::default());
    assert_eq!(codes(&cut), [("S0106", 1)]);
}

#[test]
fn recognition_by_content() {
    for yes in [
        "<svg/>",
        "<?xml version='1.0'?>\n<!-- hi -->\n<svg xmlns='x'>",
        "\u{feff}<!DOCTYPE svg><svg:svg xmlns:svg='x'>",
    ] {
        assert!(svg::looks_like_svg(yes.as_bytes()), "{yes}");
    }
    for no in ["IN;SP1;", "<html><body>svg</body></html>", "<x a='svg'/>", "", "svg", "<svgx>"] {
        assert!(!svg::looks_like_svg(no.as_bytes()), "{no}");
    }
}

#[test]
fn undeclared_prefixes_are_repaired() {
    let text = "<svg xmlns='http://www.w3.org/2000/svg'><defs><path id='p' d='M0 0H96'/></defs>\n\
        <use xlink:href='#p' stroke='red'/><image/></svg>";
    let document = svg::read(text.as_bytes(), &Options::default());
    assert!(close(document.drawing.length(), 25.4));
    let image = document.diagnostics.iter().find(|found| found.code.name() == "S0203").unwrap();
    assert_eq!((image.line, image.column), (2, 36));
    assert_eq!(&text[image.span.start..image.span.end], "<image/>");
}

#[test]
fn undeclared_prefix_outside_ascii_has_a_column() {
    let document = svg::read("<svg ÿÿÿÿÿÿÿÿÿÿ:x='1'><a".as_bytes(), &Options::default());
    assert_eq!(document.diagnostics.len(), 2);
    assert!(document.diagnostics.iter().all(|found| found.line == 1 && found.column <= 26));
}

#[test]
fn malformed_xml_has_a_place() {
    let document = svg::read(b"<svg xmlns='http://www.w3.org/2000/svg'>\n <g></svg>", &Options::default());
    let found = &document.diagnostics[0];
    assert_eq!((found.code.name(), found.line), ("S0101", 2));
}

#[test]
fn clip_path_of_many_shapes() {
    // 400 squares of 3 mm, 5 mm apart. Lines through their middles keep 3 mm of every 5; those between
    // rows nothing.
    let squares =
        (0..400).map(|k| format!("<rect x='{}' y='{}' width='3' height='3'/>", k % 20 * 5, k / 20 * 5));
    let clip = format!("<clipPath id='c'>{}</clipPath>", squares.collect::<String>());
    let clipped = |d: &str| -> f64 {
        let content = format!("{clip}<path clip-path='url(#c)' d='{d}'/>");
        strokes(&content).iter().map(Stroke::length).sum()
    };
    for y in [1.5, 51.5, 96.5] {
        assert!((clipped(&format!("M0 {y}H100")) - 60.0).abs() < 1e-6, "{y}");
        assert!((clipped(&format!("M{y} 0V100")) - 60.0).abs() < 1e-6, "{y}");
        assert!(clipped(&format!("M0 {}H100", y + 2.5)).abs() < 1e-6, "{y}");
    }
    let diagonal = 2.0_f64.sqrt() * 60.0;
    assert!((clipped("M0 0L100 100") - diagonal).abs() < 1e-6);
    // A circle that no square holds whole: as from every square alone.
    let alone: f64 = (0..400)
        .map(|k| {
            let square = format!("<rect x='{}' y='{}' width='3' height='3'/>", k % 20 * 5, k / 20 * 5);
            let content = format!(
                "<clipPath id='c'>{square}</clipPath><circle clip-path='url(#c)' cx='50' cy='50' r='33'/>"
            );
            strokes(&content).iter().map(Stroke::length).sum::<f64>()
        })
        .sum();
    let content = format!("{clip}<circle clip-path='url(#c)' cx='50' cy='50' r='33'/>");
    let together: f64 = strokes(&content).iter().map(Stroke::length).sum();
    assert!((alone - together).abs() < 1e-6 && together > 50.0, "{alone} {together}");
}
