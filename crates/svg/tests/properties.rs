//! Properties on random input: transforms compose, arcs are exact, clips and hatches conserve
//! length and area.

use drawing::{Affine, Point, Segment};
use proptest::prelude::*;
use svg::{Document, Options};

fn read(content: &str) -> Document {
    let text = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='200mm' height='200mm' viewBox='0 0 200 200' \
         stroke='black' fill='none'>{content}</svg>"
    );
    svg::read(text.as_bytes(), &Options::default())
}

fn points(document: &Document) -> Vec<Point> {
    let segments = document.drawing.strokes.iter().flat_map(|s| s.segments().collect::<Vec<_>>());
    segments.flat_map(|piece| (0..=8).map(move |k| piece.eval(f64::from(k) / 8.0))).collect()
}

const SHAPES: &[&str] = &[
    "<circle cx='20' cy='30' r='15'/>",
    "<ellipse cx='20' cy='30' rx='15' ry='4'/>",
    "<path d='M10 10C20 40 40 -20 50 10S60 50 30 30Q10 50 5 20A20 8 30 1 1 30 60z'/>",
    "<rect x='5' y='6' width='30' height='20' rx='4' ry='7'/>",
];

proptest! {
    #[test]
    fn nested_transforms_equal_their_product(
        shape in 0..SHAPES.len(),
        a in prop::array::uniform6(-2.0..2.0_f64),
        b in prop::array::uniform6(-2.0..2.0_f64),
    ) {
        let list = |m: [f64; 6]| m.map(|number| number.to_string()).join(" ");
        let product = (Affine::new(a) * Affine::new(b)).as_coeffs();
        let nested = read(&format!("<g transform='matrix({})'><g transform='matrix({})'>{}</g></g>", list(a), list(b), SHAPES[shape]));
        let once = read(&format!("<g transform='matrix({})'>{}</g>", list(product), SHAPES[shape]));
        let (one, other) = (points(&nested), points(&once));
        prop_assert_eq!(one.len(), other.len());
        for (p, q) in one.iter().zip(&other) {
            prop_assert!((*p - *q).hypot2().sqrt() < 1e-9);
        }
    }

    #[test]
    fn arcs_lie_on_their_ellipse(
        [x0, y0, x1, y1] in prop::array::uniform4(10.0..190.0_f64),
        rx in 1.0..150.0_f64, ry in 1.0..150.0_f64, degrees in -400.0..400.0_f64,
        large in 0..2, positive in 0..2,
    ) {
        prop_assume!((x0 - x1).abs() + (y0 - y1).abs() > 0.1);
        let document = read(&format!("<path d='M{x0} {y0}A{rx} {ry} {degrees} {large} {positive} {x1} {y1}'/>"));
        let Some(Segment::Arc(arc)) = document.drawing.strokes.to_vec()[0].segments().next() else { panic!("no arc") };
        prop_assert!((arc.eval(0.0) - Point::new(x0, 200.0 - y0)).hypot2().sqrt() < 1e-9);
        prop_assert!((arc.eval(1.0) - Point::new(x1, 200.0 - y1)).hypot2().sqrt() < 1e-9);
        // In the file's frame: turned back by the rotation, the point satisfies the equation of the
        // ellipse.
        let (sin, cos) = libm::sincos(degrees.to_radians());
        let scale = arc.semi_axes().0 / rx.max(ry);
        prop_assert!(scale > 1.0 - 1e-9);
        for k in 0..=16 {
            let v = arc.eval(f64::from(k) / 16.0) - arc.center;
            let v = Point::new(v.x, -v.y);
            let (u, w) = (cos * v.x + sin * v.y, cos * v.y - sin * v.x);
            let radius = libm::hypot(u / rx, w / ry);
            prop_assert!((radius - scale).abs() * rx.max(ry) < 1e-9, "{radius} {scale}");
        }
    }

    #[test]
    fn a_clip_and_its_complement_conserve_length(
        shape in 0..SHAPES.len(),
        [cx, cy] in prop::array::uniform2(5.0..50.0_f64),
        r in 5.0..30.0_f64, squash in 0.3..1.0_f64,
    ) {
        let hole = format!("M{} {cy}a{r} {ry} 0 1 0 {} 0a{r} {ry} 0 1 0 {} 0z", cx - r, 2.0 * r, -2.0 * r, ry = r * squash);
        let clip = |path: &str| read(&format!(
            "<clipPath id='c'><path clip-rule='evenodd' d='{path}'/></clipPath><g clip-path='url(#c)'>{}</g>", SHAPES[shape]
        ));
        let (inside, outside) = (clip(&hole), clip(&format!("M-500-500H900V900H-500z{hole}")));
        let whole = read(SHAPES[shape]).drawing.length();
        let sum = inside.drawing.length() + outside.drawing.length();
        prop_assert!((sum - whole).abs() < 1e-4, "{sum} {whole}");
        for p in points(&inside) {
            let d = libm::hypot((p.x - cx) / r, (200.0 - p.y - cy) / (r * squash));
            prop_assert!(d < 1.0 + 1e-7, "{d}");
        }
    }

    #[test]
    fn dashes_and_gaps_conserve_length(
        shape in 0..SHAPES.len(), dash in 0.5..9.0_f64, gap in 0.5..9.0_f64, offset in -20.0..20.0_f64,
    ) {
        let with = |pattern: String, offset: f64| read(&format!(
            "<g stroke-dasharray='{pattern}' stroke-dashoffset='{offset}'>{}</g>", SHAPES[shape]
        )).drawing.length();
        let dashes = with(format!("{dash} {gap}"), offset);
        let gaps = with(format!("{gap} {dash}"), offset - dash);
        let whole = read(SHAPES[shape]).drawing.length();
        prop_assert!((dashes + gaps - whole).abs() < 1e-4, "{dashes} {gaps} {whole}");
    }

    #[test]
    fn any_text_is_read_without_panic(text in "\\PC{0,60}", d in "[MLHVCSQTAZmlhvcsqtaz0-9eE., -]{0,60}", n in "[a-z0-9(),.% -]{0,30}") {
        read(&text);
        read(&format!("<path d='{d}' stroke-dasharray='{}' transform='rotate({})'/>", n.replace('\'', ""), n.replace('\'', "")));
        read(&format!("<style>{n}{{stroke:red}}</style><rect width='{n}' height='5' rx='{n}' style='{n}:{n}'/>"));
        svg::read(text.as_bytes(), &Options::default());
    }
}
