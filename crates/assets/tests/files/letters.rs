//! Letters cut out of a plate: closed, in place, as close to their outlines as promised, in both directions.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use harfrust::GlyphId;
use harfrust::font::glyph::outline::{DrawMemory, DrawOptions, PathElement};
use rayfold_assets::{Align, Closure, LetterError, Lettering, Library, MemoryFiles, Model};

fn words(text: &str) -> Lettering {
    Lettering { text: text.into(), size: 1.0, depth: 0.2, align: Align::Left, font: None }
}

fn library() -> Library {
    let other = dejavu::sans::bold().to_vec();
    Library::new(MemoryFiles::from([("other.ttf", other), ("none.ttf", b"solid".to_vec())]))
}

fn cut(lettering: &Lettering) -> Arc<Model> {
    library().letters(lettering).unwrap().unwrap()
}

fn error(lettering: &Lettering) -> String {
    library().letters(lettering).unwrap_err().to_string()
}

/// Returns the lowest and the highest corner.
fn bounds(model: &Model) -> [DVec3; 2] {
    let all = model.positions();
    [all.iter().copied().reduce(DVec3::min).unwrap(), all.iter().copied().reduce(DVec3::max).unwrap()]
}

fn built_in() -> harfrust::Font {
    harfrust::Font::new(notosans::BOLD_TTF, 0).unwrap()
}

/// Returns the letters of the font that have outlines.
fn letters() -> Vec<char> {
    let font = built_in();
    let mut letters: Vec<_> =
        font.charmap().unicodes().filter_map(|(code, _)| char::from_u32(code)).collect();
    letters.retain(|c| !c.is_control());
    letters
}

/// Returns the area of a model's front.
fn front_area(model: &Model) -> f64 {
    let corners = (0..model.triangle_count()).map(|k| model.corners(k));
    corners.map(|[a, b, c]| 0.5 * (b - a).cross(c - a).z.max(0.0)).sum()
}

#[test]
fn every_letter_is_a_closed_body_at_any_size() {
    let library = library();
    let mut drawn = 0;
    for letter in letters() {
        let sizes = [(1.0, 0.2), (1e-3, 5.0), (7e20, 1e18)];
        // Every twentieth letter at all sizes.
        let count = if drawn % 20 == 0 { sizes.len() } else { 1 };
        for (size, depth) in sizes.into_iter().take(count) {
            let lettering = Lettering { size, depth, ..words(&letter.to_string()) };
            let Some(model) = library.letters(&lettering).unwrap() else { continue };
            assert_eq!(*model.closure(), Closure::Closed, "{letter} {size}");
            drawn += 1;
        }
    }
    assert!(drawn > 500, "{drawn}");
}

#[test]
fn every_glyph_of_another_font_is_closed_among_others() {
    let library = library();
    let text: String = ('!'..='~').chain('\u{a1}'..='\u{17f}').collect();
    for (k, letters) in text.chars().collect::<Vec<_>>().chunks(20).enumerate() {
        let text: String = letters.iter().collect();
        let lettering = Lettering { font: Some("other.ttf".into()), ..words(&text) };
        let model = library.letters(&lettering).unwrap().unwrap();
        assert_eq!(*model.closure(), Closure::Closed, "{k}");
    }
}

/// Returns points on the curves of a letter, in ems.
fn samples(letter: char) -> Vec<DVec2> {
    let font = built_in();
    let glyph = font.charmap().map_unicode(letter).unwrap();
    let mut path: Vec<PathElement> = Vec::new();
    let outlines = font.outline_glyphs();
    let Some(outline) = outlines.get(GlyphId::new(glyph.to_u32())) else { return Vec::new() };
    outline.draw(&DrawOptions::new(), DrawMemory::default(), &mut path).unwrap();
    let point = |x: f32, y: f32| DVec2::new(f64::from(x), f64::from(y)) / f64::from(font.units_per_em());
    let (mut points, mut here) = (Vec::new(), DVec2::ZERO);
    for element in path {
        match element {
            PathElement::MoveTo { x, y } => here = point(x, y),
            PathElement::LineTo { x, y } => here = point(x, y),
            PathElement::QuadTo { cx0, cy0, x, y } => {
                let (from, by, to) = (here, point(cx0, cy0), point(x, y));
                points.extend((0..=32).map(|k| {
                    let t = f64::from(k) / 32.0;
                    from.lerp(by, t).lerp(by.lerp(to, t), t)
                }));
                here = to;
            }
            PathElement::CurveTo { .. } => panic!("a TrueType font"),
            PathElement::Close => {}
        }
    }
    points
}

#[test]
fn outlines_err_at_most_by_a_two_thousandth() {
    let mut worst: f64 = 0.0;
    for letter in "aegsQRO@&%8ßЖΩ§6?".chars() {
        let model = cut(&Lettering { depth: 0.0, ..words(&letter.to_string()) });
        let shift = library().letters(&words(&letter.to_string())).unwrap().unwrap();
        assert!(bounds(&shift)[0].x.abs() < 0.2);
        let edges: Vec<[DVec2; 2]> = (0..model.triangle_count())
            .flat_map(|k| {
                let [a, b, c] = model.corners(k).map(DVec3::truncate);
                [[a, b], [b, c], [c, a]]
            })
            .collect();
        // An edge of one triangle alone is one of the outline.
        let outline: Vec<_> =
            edges.iter().filter(|[a, b]| !edges.iter().any(|[c, d]| a == d && b == c)).collect();
        for point in samples(letter) {
            let distance = |[a, b]: &&[DVec2; 2]| {
                let along = *b - *a;
                let t = ((point - *a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                point.distance(*a + t * along)
            };
            worst = worst.max(outline.iter().map(distance).fold(f64::INFINITY, f64::min));
        }
    }
    assert!(worst <= 1.0 / 2000.0, "{worst}");
    assert!(worst > 1.0 / 20_000.0, "{worst}: curves have corners");
}

#[test]
fn fronts_are_at_0_and_backs_behind() {
    let solid = cut(&words("I"));
    let [low, high] = bounds(&solid);
    assert_eq!((low.z, high.z), (-0.2, 0.0));
    assert!(low.y.abs() < 0.01 && (0.6..0.8).contains(&high.y), "{low} {high}: stands on the baseline");
    let flat = cut(&Lettering { depth: 0.0, ..words("I") });
    assert!(bounds(&flat).iter().all(|corner| corner.z == 0.0));
    assert!(matches!(flat.closure(), Closure::Open(_)));
    assert!((0..flat.triangle_count()).all(|k| flat.normals(k).is_none()), "flat");
    assert!((front_area(&solid) - front_area(&flat)).abs() < 1e-12);
    let [low, high] = bounds(&cut(&Lettering { size: 10.0, ..words("I") })).map(|corner| corner.y);
    assert!(low.abs() < 0.1 && (6.0..8.0).contains(&high));
}

#[test]
fn sides_are_smooth_where_the_outline_is() {
    let model = cut(&words("O"));
    let mut sides = 0;
    for k in 0..model.triangle_count() {
        let Some(normals) = model.normals(k) else { continue };
        let [a, b, c] = model.corners(k);
        let face = (b - a).cross(c - a).normalize();
        assert!(normals.iter().all(|n| n.dot(face) > 0.97 && n.z == 0.0), "near its face");
        // On the ellipse of an `O` normals at one point are one.
        for (n, p) in normals.iter().zip([a, b, c]) {
            let others =
                (0..model.triangle_count()).filter_map(|j| Some((model.normals(j)?, model.corners(j))));
            let others = others.flat_map(|(normals, corners)| normals.into_iter().zip(corners));
            assert!(others.filter(|(_, q)| *q == p).all(|(m, _)| m.dot(*n) > 0.999_999));
        }
        sides += 1;
    }
    assert!(sides > 40);
    let model = cut(&words("L"));
    let normals: Vec<_> = (0..model.triangle_count()).filter_map(|k| model.normals(k)).collect();
    assert_eq!(normals.len(), 12, "six sides");
    assert!(normals.iter().flatten().all(|n| n.abs().max_element() > 0.999), "along the axes");
}

#[test]
fn lines_begin_end_or_have_their_middles_at_0() {
    let at = |text: &str, align| bounds(&cut(&Lettering { align, ..words(text) })).map(|corner| corner.x);
    let [left, right] = at("HH", Align::Left);
    assert!(left > 0.0 && left < 0.15);
    let [low, high] = at("HH", Align::Center);
    assert!((low + high).abs() < 1e-3, "{low} {high}: an H is alike at both ends");
    let [low, high] = at("HH", Align::Right);
    assert!((high + left).abs() < 1e-3 && (low + right).abs() < 1e-3);
    let [blank, _] = at(" HH", Align::Left);
    assert!(blank > left + 0.2, "blanks at the ends count");
    let [low, high] = bounds(&cut(&words("H\n\nH"))).map(|corner| corner.y);
    assert!((low + 2.4).abs() < 1e-4 && high > 0.6, "{low}: 1.2 em a line");
}

#[test]
fn letters_are_shaped_with_kerns_and_ligatures() {
    let width = |text: &str, font: Option<&str>| {
        let [low, high] = bounds(&cut(&Lettering { font: font.map(Into::into), ..words(text) }));
        high.x - low.x
    };
    assert!(width("AV", None) < width("AI", None) + width("IV", None) - width("I", None), "kerned");
    let area = |text: &str| front_area(&cut(&Lettering { font: Some("other.ttf".into()), ..words(text) }));
    assert!((area("fi") - area("f") - area("i")).abs() > 1e-3, "a ligature");
    assert!((area("fl") - area("f\u{200c}l")).abs() > 1e-3, "what keeps letters apart is obeyed");
}

#[test]
fn words_go_in_both_directions() {
    let other = |text: &str| cut(&Lettering { font: Some("other.ttf".into()), ..words(text) });
    // Hebrew: the first letter stands at the right.
    let (one, two) = (front_area(&other("ש")), front_area(&other("י")));
    assert!(one > 2.0 * two);
    let model = other("שי");
    let [low, high] = bounds(&model).map(|corner| corner.x);
    let left: f64 = (0..model.triangle_count())
        .map(|k| model.corners(k))
        .filter(|corners| corners[0].x < low + 0.3 * (high - low))
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).z.max(0.0))
        .sum();
    assert!((left - two).abs() < 1e-9, "{left} {two}");
    // Arabic letters join, and have other shapes within a word.
    let joined = other("سلام");
    assert_eq!(*joined.closure(), Closure::Closed);
    let apart: f64 = "سلام".chars().map(|c| front_area(&other(&c.to_string()))).sum();
    assert!((front_area(&joined) - apart).abs() > 0.01);
    // A line of Hebrew with digits: these go to the right.
    let digits = bounds(&other("12"))[1].x - bounds(&other("12"))[0].x;
    let mixed = bounds(&other("ש 12"))[1].x - bounds(&other("ש 12"))[0].x;
    assert!(mixed > digits);
}

#[test]
fn overlapping_letters_join() {
    // A combining ring below touches nothing; a stroke through a letter overlaps it.
    let model = cut(&Lettering { font: Some("other.ttf".into()), ..words("o\u{336}") });
    assert_eq!(*model.closure(), Closure::Closed);
    let apart = cut(&Lettering { font: Some("other.ttf".into()), ..words("o") });
    assert!(front_area(&model) > front_area(&apart));
    let volume = |model: &Model| -> f64 {
        (0..model.triangle_count()).map(|k| model.corners(k)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    };
    assert!((volume(&model) - 0.2 * front_area(&model)).abs() < 1e-9, "no part counts twice");
}

#[test]
fn what_cannot_be_drawn_is_named() {
    assert_eq!(error(&words("日本")), "the font that comes with rayfold has no letter `日` (U+65E5)");
    assert_eq!(error(&words("a\tb")), "the control character U+0009 cannot be drawn");
    assert_eq!(error(&words("a\r\nb")), "the control character U+000D cannot be drawn");
    assert_eq!(error(&words("ab\u{85}")), "the control character U+0085 cannot be drawn");
    assert_eq!(error(&words(&"a".repeat(10_001))), "the text has 10001 code points, more than 10000");
    let named = |font: &str| Lettering { font: Some(font.into()), ..words("a\u{10ffff}") };
    assert_eq!(error(&named("other.ttf")), "the font `other.ttf` has no letter U+10FFFF");
    assert_eq!(error(&named("none.ttf")), "`none.ttf`: it is no font: a font is TrueType or OpenType");
    assert_eq!(error(&named("absent.ttf")), "there is no file `absent.ttf` in the script's folder");
    let missing = library().letters(&words("x日")).unwrap_err();
    assert!(matches!(missing, LetterError::Missing { letter: '日', font: None }));
    assert!(missing.help().is_some());
    // What Unicode ignores is never missing.
    assert_eq!(bounds(&cut(&words("a\u{200b}\u{fe0f}\u{ad}b"))), bounds(&cut(&words("ab"))));
    assert!(library().letters(&words(" \n\u{200b} ")).unwrap().is_none());
    assert!(library().letters(&words("")).unwrap().is_none());
}

#[test]
fn ten_thousand_letters_are_drawn() {
    let text: String = "Ab g&\n".chars().cycle().take(10_000).collect();
    let model = cut(&words(&text));
    assert!(model.triangle_count() > 500_000);
}

#[test]
fn letters_are_cut_once_until_their_font_changes() {
    let library = library();
    let lettering = words("once");
    let [first, second] = [0, 1].map(|_| library.letters(&lettering).unwrap().unwrap());
    assert!(Arc::ptr_eq(&first, &second));
    let other = library.letters(&Lettering { size: 2.0, ..lettering }).unwrap().unwrap();
    assert!(!Arc::ptr_eq(&first, &other));
}
