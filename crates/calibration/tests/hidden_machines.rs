//! Hidden machines, touched with pointing errors and whole ticks, and calibrated: where the pen of the
//! hidden machine is when the calibrated one sends it to places all over the page.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use calibration::{
    Alternative, CalibrationError, Distance, Fit, Measurements, Options, Parameter, Setup, Touch, Unknown,
    alternatives, fit,
};
use drawing::{Point, Vec2};
use test_support::Random;

const LETTER: [f64; 2] = [215.9, 279.4];

fn corners([width, height]: [f64; 2]) -> [Point; 4] {
    [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)].map(Point::from)
}

/// The coaxial arm of report 1, by its machine file.
fn arm() -> Setup {
    Setup {
        kind: Setup::kind_of("two-link").expect("a kind of machine"),
        geometry: BTreeMap::from([
            ("l1".into(), Parameter::Length(206.0)),
            ("l2".into(), Parameter::Length(256.0)),
            ("elbow".into(), Parameter::Choice("left".into())),
        ]),
        coupling: [[1.0, 0.0], [0.0, -1.0]],
        ticks_per_unit: [3200.0 / TAU; 2],
        offset_ticks: [0.0, 800.0],
        backlash_ticks: [0.0; 2],
        corner: Point::new(12.7, 76.2),
        sheet_mm: LETTER,
    }
}

fn five_bar() -> Setup {
    let length = |key: &str, mm| (key.to_owned(), Parameter::Length(mm));
    let choice = |key: &str, side: &str| (key.to_owned(), Parameter::Choice(side.into()));
    Setup {
        kind: Setup::kind_of("five-bar").expect("a kind of machine"),
        geometry: BTreeMap::from([
            ("base1".into(), Parameter::Point(Point::new(-40.0, 0.0))),
            ("base2".into(), Parameter::Point(Point::new(40.0, 0.0))),
            length("proximal1", 100.0),
            length("proximal2", 100.0),
            length("distal1", 140.0),
            length("distal2", 140.0),
            choice("elbow1", "left"),
            choice("elbow2", "right"),
            choice("pen", "left"),
        ]),
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        ticks_per_unit: [3200.0 / TAU; 2],
        offset_ticks: [0.0; 2],
        backlash_ticks: [0.0; 2],
        corner: Point::new(-74.0, 90.0),
        sheet_mm: [148.0, 105.0],
    }
}

fn polargraph() -> Setup {
    Setup {
        kind: Setup::kind_of("polargraph").expect("a kind of machine"),
        geometry: BTreeMap::from([
            ("left".into(), Parameter::Point(Point::ZERO)),
            ("right".into(), Parameter::Point(Point::new(650.0, 0.0))),
        ]),
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        ticks_per_unit: [400.0 / 95.0; 2],
        offset_ticks: [0.0; 2],
        backlash_ticks: [0.0; 2],
        corner: Point::new(176.5, -400.0),
        sheet_mm: [297.0, 210.0],
    }
}

fn corexy() -> Setup {
    Setup {
        kind: Setup::kind_of("cartesian").expect("a kind of machine"),
        geometry: BTreeMap::new(),
        coupling: [[1.0, 1.0], [1.0, -1.0]],
        ticks_per_unit: [92.03; 2],
        offset_ticks: [0.0; 2],
        backlash_ticks: [0.0; 2],
        corner: Point::ZERO,
        sheet_mm: [200.0, 200.0],
    }
}

fn polar() -> Setup {
    Setup {
        kind: Setup::kind_of("polar").expect("a kind of machine"),
        geometry: BTreeMap::new(),
        coupling: [[-1.0, 0.0], [0.0, 1.0]],
        ticks_per_unit: [1856.0 / TAU * 2.0, 360.0 / 44.0],
        offset_ticks: [2400.0, -1129.0],
        backlash_ticks: [0.0; 2],
        corner: Point::new(-60.0, 60.0),
        sheet_mm: [120.0, 60.0],
    }
}

/// Small seeds begin alike: they are spread over all 64 bits.
fn seeded(seed: u64) -> Random {
    Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

fn normal(random: &mut Random) -> f64 {
    // Twelve uniform numbers: their sum has variance 1.
    (0..12).map(|_| random.between(0.0, 1.0)).sum::<f64>() - 6.0
}

fn lengthen(setup: &mut Setup, key: &str, by: f64) {
    let Some(Parameter::Length(mm)) = setup.geometry.get_mut(key) else { panic!("{key}") };
    *mm += by;
}

/// The arm as it was built and started: links 2 mm off, the belt 0.5 %, offsets up to 20 degrees, the sheet
/// up to 15 mm and 5 degrees. Its own sheet is not parallel to the axes: the arm is turned instead.
fn hidden(random: &mut Random) -> Setup {
    let mut hidden = arm();
    let mut off = |size: f64| random.between(-size, size);
    lengthen(&mut hidden, "l1", off(2.0));
    lengthen(&mut hidden, "l2", off(2.0));
    let belt = 1.0 + off(0.005);
    hidden.coupling[1] = [-1.0 + 1.0 / belt, -1.0 / belt];
    hidden.offset_ticks[0] += off(180.0);
    hidden.offset_ticks[1] += off(180.0);
    hidden.corner += Vec2::new(off(15.0), off(15.0));
    hidden
}

/// Touches of places, with 0.25 mm of pointing error along x and y, and whole ticks.
fn touches(hidden: &Setup, places: &[Point], random: &mut Random) -> Vec<Touch> {
    let near = hidden.ticks(Point::new(100.0, 100.0), hidden.offset_ticks).expect("a place within reach");
    let touch = |place: &Point| {
        let pointed = *place + 0.25 * Vec2::new(normal(random), normal(random));
        let ticks = hidden.ticks(pointed, near)?.map(f64::round);
        Some(Touch { place: *place, ticks, approach: [0.0; 2], elbow_left: None })
    };
    places.iter().map(touch).collect::<Option<_>>().expect("places within reach")
}

fn with_elbow(setup: &Setup, side: &str) -> Setup {
    let mut other = setup.clone();
    other.geometry.insert("elbow".into(), Parameter::Choice(side.into()));
    other
}

/// Where the hidden machine draws what the calibrated one plans, against where it should: mean square, mm².
fn page_error(calibrated: &Setup, hidden: &Setup) -> f64 {
    let near = hidden.ticks(Point::new(100.0, 60.0), hidden.offset_ticks).expect("a place within reach");
    let mut squares = Vec::new();
    for k in 0..81 {
        let share = |k: i32| f64::from(k) / 8.0;
        let [width, height] = hidden.sheet_mm;
        let place = Point::new(share(k % 9) * width, share(k / 9) * height);
        let Some(ticks) = calibrated.ticks(place, near) else { continue };
        squares.push((hidden.pen(ticks).expect("a pose") - place).hypot2());
    }
    assert!(squares.len() > 60, "most of the page is within reach");
    squares.iter().sum::<f64>() / squares.len() as f64
}

/// RMS page errors of 100 arms, and those that the fits expected.
fn of_hundred(mut fitted: impl FnMut(&Setup, &mut Random) -> Fit) -> (f64, f64) {
    let mut random = seeded(18);
    let (mut real, mut expected) = (0.0, 0.0);
    for _ in 0..100 {
        let hidden = hidden(&mut random);
        let fit = fitted(&hidden, &mut random);
        real += page_error(&fit.setup, &hidden) / 100.0;
        expected += fit.page.rms_mm * fit.page.rms_mm / 100.0;
    }
    (real.sqrt(), expected.sqrt())
}

#[test]
fn four_corners_of_hidden_arms() {
    let (real, expected) = of_hundred(|hidden, random| {
        let touches = touches(hidden, &corners(LETTER), random);
        let data = Measurements { touches, distances: Vec::new() };
        fit(&arm(), &data, &Options::default()).expect("a fit")
    });
    assert!(real <= 0.45, "{real} mm RMS over the page, expected {expected}");
    assert!((0.5..2.0).contains(&(real / expected)), "{real} against {expected}");
}

#[test]
fn four_corners_with_both_elbows() {
    let (real, expected) = of_hundred(|hidden, random| {
        let mut all = touches(hidden, &corners(LETTER), random);
        all.extend(touches(&with_elbow(hidden, "right"), &corners(LETTER), random));
        let data = Measurements { touches: all, distances: Vec::new() };
        fit(&arm(), &data, &Options::default()).expect("a fit")
    });
    assert!(real <= 0.3, "{real} mm RMS over the page, expected {expected}");
    assert!((0.5..2.0).contains(&(real / expected)), "{real} against {expected}");
}

#[test]
fn pose_alone_from_a_start_that_is_far_off() {
    let mut random = seeded(4);
    let mut hidden = arm();
    hidden.offset_ticks = [700.0, -900.0];
    hidden.corner = Point::new(60.0, 110.0);
    let touches = touches(&hidden, &corners([150.0, 150.0]), &mut random);
    let data = Measurements { touches, distances: Vec::new() };
    let options = Options { groups: 1, ..Options::default() };
    let fit = fit(&arm(), &data, &options).expect("a fit");
    assert_eq!(fit.values.len(), 4);
    assert!(fit.rms_mm < 1.0, "{}", fit.rms_mm);
    assert!(!fit.is_bad);
}

/// The other mechanisms, with exact touches: what is found is what was hidden.
#[test]
fn exact_touches_find_hidden_parameters_of_every_mechanism() {
    let mut cases: Vec<(Setup, Setup, usize)> = Vec::new();
    let mut hidden = corexy();
    (hidden.offset_ticks, hidden.ticks_per_unit) = ([300.0, -200.0], [91.7, 92.4]);
    cases.push((corexy(), hidden, 9));
    let mut hidden = polar();
    (hidden.offset_ticks, hidden.ticks_per_unit[1]) = ([2350.0, -1120.0], 8.25);
    hidden.geometry.insert("rack_offset".into(), Parameter::Length(3.0));
    hidden.corner = Point::new(-55.0, 62.0);
    cases.push((polar(), hidden, 9));
    let mut hidden = five_bar();
    (hidden.offset_ticks, hidden.corner) = ([30.0, -25.0], Point::new(-71.0, 93.0));
    hidden.geometry.insert("base2".into(), Parameter::Point(Point::new(41.0, 1.0)));
    lengthen(&mut hidden, "distal1", 1.0);
    cases.push((five_bar(), hidden, 9));
    let mut hidden = polargraph();
    (hidden.offset_ticks, hidden.corner) = ([20.0, -15.0], Point::new(180.0, -390.0));
    hidden.geometry.insert("right".into(), Parameter::Point(Point::new(656.0, 0.0)));
    cases.push((polargraph(), hidden, 9));
    for (nominal, hidden, each) in cases {
        let near = hidden.offset_ticks;
        let [width, height] = hidden.sheet_mm;
        let places = (0..each).map(|k| {
            Point::new(f64::from(k as u32 % 3) * width / 2.0, f64::from(k as u32 / 3) * height / 2.0)
        });
        let touches = places.map(|place| Touch {
            place,
            ticks: hidden.ticks(place, near).unwrap(),
            approach: [0.0; 2],
            elbow_left: None,
        });
        let data = Measurements { touches: touches.collect(), distances: Vec::new() };
        let name = nominal.kind.name;
        let found =
            fit(&nominal, &data, &Options::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(found.rms_mm < 1e-3, "{name}: {} mm", found.rms_mm);
        assert!(page_error(&found.setup, &hidden) < 1e-4, "{name}: {}", page_error(&found.setup, &hidden));
    }
}

#[test]
fn two_touches_do_not_determine_the_pose() {
    let touches = touches(&arm(), &corners(LETTER)[..2], &mut seeded(1));
    let data = Measurements { touches, distances: Vec::new() };
    let error = fit(&arm(), &data, &Options::default()).unwrap_err();
    let CalibrationError::Undetermined { equations: 4, unknowns: 4, helpful: Some(helpful) } = error else {
        panic!("{error:?}")
    };
    assert!(helpful.place.y > 100.0, "a touch far from the other two helps: {helpful:?}");
}

/// Three corners give six equations: the pose, but not the links.
#[test]
fn unknowns_beyond_the_touches_are_kept_and_named() {
    let touches = touches(&arm(), &corners(LETTER)[..3], &mut seeded(1));
    let data = Measurements { touches, distances: Vec::new() };
    let fit = fit(&arm(), &data, &Options::default()).unwrap();
    assert_eq!(fit.values.len(), 4);
    assert_eq!(fit.kept[0].0, [Unknown::Length("l1"), Unknown::Length("l2")]);
    assert!(fit.kept[0].1.is_some());
}

#[test]
fn wrong_sign_is_named() {
    let mut random = seeded(7);
    for motor in 0..2 {
        let mut hidden = hidden(&mut random);
        hidden.ticks_per_unit[motor] *= -1.0;
        let touches = touches(&hidden, &corners(LETTER), &mut random);
        let data = Measurements { touches, distances: Vec::new() };
        let options = Options::default();
        assert!(fit(&arm(), &data, &options).map_or(true, |fit| fit.is_bad));
        let found = alternatives(&arm(), &data, &options, false);
        let expected = Alternative::Reversed([motor == 0, motor == 1]);
        assert_eq!(found.first().map(|(what, _)| what), Some(&expected), "{found:?}");
    }
}

#[test]
fn swapped_corners_are_named() {
    let mut random = seeded(8);
    let hidden = hidden(&mut random);
    for order in [[1, 0, 2, 3], [0, 1, 3, 2], [1, 2, 3, 0]] {
        let places = order.map(|corner| corners(LETTER)[corner]);
        let mut touches = touches(&hidden, &places, &mut random);
        for (touch, place) in touches.iter_mut().zip(corners(LETTER)) {
            touch.place = place;
        }
        let data = Measurements { touches, distances: Vec::new() };
        let options = Options::default();
        assert!(fit(&arm(), &data, &options).map_or(true, |fit| fit.is_bad), "{order:?}");
        let found = alternatives(&arm(), &data, &options, true);
        assert!(found.iter().any(|(what, _)| *what == Alternative::Order(order)), "{order:?}: {found:?}");
    }
}

#[test]
fn touch_that_is_off_is_named() {
    let mut random = seeded(9);
    let hidden = hidden(&mut random);
    let mut all = touches(&hidden, &corners(LETTER), &mut random);
    all.extend(touches(&with_elbow(&hidden, "right"), &corners(LETTER), &mut random));
    all[5].place.x += 8.0;
    let data = Measurements { touches: all, distances: Vec::new() };
    let fit = fit(&arm(), &data, &Options::default()).unwrap();
    assert!(fit.is_bad);
    let worst = fit.worst.expect("enough touches");
    assert_eq!(worst.touch, 5);
    assert!(worst.rms_mm < 0.6 && (worst.off_mm - 8.0).abs() < 1.5, "{worst:?}");
}

/// Corners and middle, each from both sides.
fn touches_from_both_sides(hidden: &Setup, random: &mut Random) -> Vec<Touch> {
    let [width, height] = LETTER;
    let places = [corners(LETTER).to_vec(), vec![Point::new(0.5 * width, 0.5 * height)]].concat();
    let sides = [[1.0, 1.0], [-1.0, -1.0]];
    let each = sides.iter().flat_map(|approach| {
        let mut all = touches(hidden, &places, random);
        for touch in &mut all {
            touch.approach = *approach;
            for (motor, side) in approach.iter().enumerate() {
                touch.ticks[motor] += (0.5 * side * hidden.backlash_ticks[motor]).round();
            }
        }
        all
    });
    each.collect()
}

/// 20 arms with up to 40 ticks of backlash, of which the machine file knows nothing.
#[test]
fn backlash_is_found_from_touches_from_both_sides() {
    let mut random = seeded(12);
    let (mut real, mut off) = (0.0, 0.0);
    for _ in 0..20 {
        let mut hidden = hidden(&mut random);
        hidden.backlash_ticks = [0, 1].map(|_| 2.0 * random.between(5.0, 20.0).round());
        let data =
            Measurements { touches: touches_from_both_sides(&hidden, &mut random), distances: Vec::new() };
        let fit = fit(&arm(), &data, &Options::default()).expect("a fit");
        for motor in 0..2 {
            let value = fit.values.iter().find(|value| value.unknown == Unknown::Backlash(motor));
            let deviation = value.expect("a value").deviation * arm().ticks_per_unit[motor];
            let error = fit.setup.backlash_ticks[motor] - hidden.backlash_ticks[motor];
            off += error * error / deviation / deviation / 40.0;
        }
        real += page_error(&fit.setup, &hidden) / 20.0;
    }
    assert!((0.5..2.0).contains(&off.sqrt()), "{} standard deviations RMS", off.sqrt());
    assert!(real.sqrt() <= 0.45, "{} mm RMS over the page", real.sqrt());
}

#[test]
fn backlash_of_the_file_corrects_touches_or_counts_as_an_error() {
    let mut random = seeded(13);
    let mut hidden = hidden(&mut random);
    hidden.backlash_ticks = [40.0, 40.0];
    let nominal = Setup { backlash_ticks: [40.0, 40.0], ..arm() };
    let mut touches = touches_from_both_sides(&hidden, &mut random);
    // Too few from either side for an unknown.
    touches.drain(2..8);
    let data = Measurements { touches: touches.clone(), distances: Vec::new() };
    let known = fit(&nominal, &data, &Options::default()).expect("a fit");
    assert!(!known.is_bad && known.sigma_mm < 0.6, "{known:?}");
    assert_eq!(known.setup.backlash_ticks, [40.0, 40.0]);
    for touch in &mut touches {
        touch.approach = [0.0; 2];
    }
    let data = Measurements { touches, distances: Vec::new() };
    let unknown = fit(&nominal, &data, &Options::default()).expect("a fit");
    assert!(unknown.sigma_mm > 2.0 * known.sigma_mm, "{} and {}", unknown.sigma_mm, known.sigma_mm);
}

/// Distances between marks alone give the fold of the elbow and the links, not the place of the sheet.
#[test]
fn distances_find_the_links() {
    let mut hidden = arm();
    lengthen(&mut hidden, "l1", 1.5);
    lengthen(&mut hidden, "l2", -1.0);
    hidden.offset_ticks[1] += 12.0;
    let marks: Vec<[f64; 2]> = (0..9)
        .map(|k| {
            arm().ticks(Point::new(f64::from(k % 3) * 100.0, f64::from(k / 3) * 130.0), [800.0, 0.0]).unwrap()
        })
        .collect();
    let pairs = (0..9).flat_map(|a| (a + 1..9).map(move |b| (a, b)));
    let distances = pairs.map(|(a, b)| {
        let ticks = [marks[a], marks[b]];
        let mm = (hidden.pen(ticks[0]).unwrap() - hidden.pen(ticks[1]).unwrap()).hypot2().sqrt();
        Distance { ticks, mm }
    });
    let data = Measurements { touches: Vec::new(), distances: distances.collect() };
    let fit = fit(&arm(), &data, &Options::default()).unwrap();
    let Some(Parameter::Length(l1)) = fit.setup.geometry.get("l1") else { panic!() };
    assert!((l1 - 207.5).abs() < 0.01, "{l1}");
    assert!(fit.rms_mm < 1e-3);
}
