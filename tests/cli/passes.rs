//! `rayfold render --pass`: the files beside images, read again by other decoders, against the hits that the tracer
//! returns.

use std::io::Cursor;

use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use image::DynamicImage;
use rayfold_scene::{Scene, Script, parse};
use rayfold_tracer::{FirstHit, RenderOptions, first_hits};
use snapbox::str;

use crate::{BALL, Folder, ball_at};

/// The table of the objects of both frames.
const TABLE: &str = r#"{"script":"a.txt","objects":[
{"number":1,"lines":[10],"text":"Sphere (1:.5 2:.8)  0 0 0   .1 .1 .1  .5 .25 .125  .25 .25 .25"},
{"number":2,"lines":[11,6],"text":"Box -2 -1 -1  -1 0 0   .1 .1 .1  .2 .9 .4"},
{"number":3,"lines":[11,7],"text":"Box 1 -1 -1  2 0 0     .1 .1 .1  .9 .2 .4"}
]}
"#;

const ALL: &str = "depth,normal,object,albedo";

/// A ball, and a group of two boxes, in front of nothing; of two frames.
const SCRIPT: &str = "\
Screen 40 30
Look 0 1 6  0 0 0  40
Background none

Group pair
Box -2 -1 -1  -1 0 0   .1 .1 .1  .2 .9 .4
Box 1 -1 -1  2 0 0     .1 .1 .1  .9 .2 .4
End
# The ball.
Sphere (1:.5 2:.8)  0 0 0   .1 .1 .1  .5 .25 .125  .25 .25 .25
Use pair  0 0 0
Ilight 1 1 1  -1 -1 -2
Frames 2
Trace
";

fn script(text: &str) -> Script {
    parse("a.txt", text.as_bytes(), &Default::default()).script.unwrap()
}

fn hits(scene: &Scene) -> Vec<FirstHit> {
    first_hits(scene, &RenderOptions::default()).unwrap()
}

/// The numbers of a channel, with its name.
type Channel = (String, Vec<f32>);

/// Returns the size, the channels, and the comment of an `.exr`.
fn decoded(file: &[u8]) -> ((usize, usize), Vec<Channel>, String) {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(file))
        .unwrap();
    let layer = image.layer_data;
    let channels = layer.channel_data.list.into_iter().map(|channel| {
        let FlatSamples::F32(numbers) = channel.sample_data else { panic!("not 32 bits") };
        (channel.name.to_string(), numbers)
    });
    (layer.size.into(), channels.collect(), layer.attributes.comments.unwrap().to_string())
}

/// Returns the levels of a `.png` of 16 bits, and its texts.
fn levels(file: &[u8]) -> (Vec<u16>, Vec<(String, String)>) {
    let levels = match image::load_from_memory(file).unwrap() {
        DynamicImage::ImageLuma16(image) => image.into_raw(),
        DynamicImage::ImageRgb16(image) => image.into_raw(),
        other => panic!("{:?}", other.color()),
    };
    let reader = png::Decoder::new(Cursor::new(file)).read_info().unwrap();
    let texts = reader.info().uncompressed_latin1_text.iter();
    (levels, texts.map(|text| (text.keyword.clone(), text.text.clone())).collect())
}

/// Returns what the pixels of an `object` say.
fn numbers(script: &Script, k: usize, hits: &[FirstHit]) -> Vec<usize> {
    let origins = script.origins(k).unwrap();
    hits.iter().map(|hit| if hit.object == 0 { 0 } else { origins[hit.object as usize - 1].number }).collect()
}

#[test]
fn an_exr_has_the_numbers_of_each_pixel() {
    let folder = Folder::with("a.txt", SCRIPT);
    folder.rayfold(&format!("render a.txt -o f%03d.png --pass {ALL}")).assert().code(0).stdout_eq("").stderr_eq(
        str![[r#"
f001.png to f002.png: 2 frames, [..], in [..] s
f001.depth.exr to f002.depth.exr, f001.normal.exr to f002.normal.exr, f001.object.exr to f002.object.exr, f001.albedo.exr to f002.albedo.exr, f001.object.json to f002.object.json: [..]

"#]],
    );
    assert_eq!(folder.list(".").len(), 1 + 2 * 6);
    let script = script(SCRIPT);
    for k in 0..2 {
        let hits = hits(&script.frame(k).unwrap());
        let of = |pass: &str| {
            let (size, channels, comment) = decoded(&folder.read(&format!("f00{}.{pass}.exr", k + 1)));
            assert_eq!(size, (40, 30));
            assert!(comment.ends_with(" where nothing is"), "{comment}");
            channels
        };
        let three = |of: fn(&FirstHit) -> [f32; 3]| {
            let channel = |axis: usize| hits.iter().map(|hit| of(hit)[axis]).collect::<Vec<f32>>();
            // Channels are sorted by name.
            vec![("B".to_owned(), channel(2)), ("G".to_owned(), channel(1)), ("R".to_owned(), channel(0))]
        };
        let numbers = numbers(&script, k, &hits);
        assert_eq!(of("depth"), [("Y".to_owned(), hits.iter().map(|hit| hit.depth).collect())]);
        assert_eq!(of("normal"), three(|hit| hit.normal));
        assert_eq!(of("albedo"), three(|hit| hit.albedo));
        assert_eq!(of("object"), [("Y".to_owned(), numbers.iter().map(|number| *number as f32).collect())]);
        for number in 0..=3 {
            assert!(numbers.contains(&number), "{number}");
        }
        let ball = hits.iter().zip(&numbers).find(|(_, number)| **number == 1).unwrap().0;
        assert_eq!(ball.albedo, [0.75, 0.5, 0.375]);
        let table = String::from_utf8(folder.read(&format!("f00{}.object.json", k + 1))).unwrap();
        assert_eq!(table, TABLE);
    }
}

#[test]
fn a_png_has_the_levels_of_the_page() {
    let folder = Folder::with("a.txt", SCRIPT);
    let render = |flags: &str| {
        folder.rayfold(&format!("render a.txt -o a.png --frame 2 --pass-format png {flags}")).assert().code(0)
    };
    render(&format!("--pass {ALL}")).stderr_eq(str![[r#"
a.png: [..], in [..] s
a.depth.png: [..]
a.normal.png: [..]
a.object.png: [..]
a.albedo.png: [..]
a.object.json: [..]

"#]]);
    let script = script(SCRIPT);
    let hits = hits(&script.frame(1).unwrap());
    let of = |pass: &str| levels(&folder.read(&format!("a.{pass}.png")));
    let level = |share: f64| (65_535.0 * share).round() as u16;
    let depths = |near: f64, far: f64| -> Vec<u16> {
        let of = |depth: f64| (65_534.0 * ((depth - near) / (far - near)).clamp(0.0, 1.0)).round() as u16;
        hits.iter().map(|hit| if hit.object == 0 { 65_535 } else { of(hit.depth.into()) }).collect()
    };
    let far = hits.iter().map(|hit| hit.depth).filter(|depth| depth.is_finite()).fold(0.0, f32::max).into();
    let texts = |near: f64, far: f64| {
        [("Depth near", near), ("Depth far", far)].map(|(name, number)| (name.to_owned(), number.to_string()))
    };
    assert_eq!(of("depth"), (depths(0.0, far), texts(0.0, far).to_vec()));
    assert!(of("depth").0.contains(&65_534) && of("depth").0.contains(&65_535));
    let expected = hits.iter().flat_map(|hit| hit.normal.map(|n| level(0.5 * f64::from(n) + 0.5)));
    assert_eq!(of("normal"), (expected.collect(), vec![]));
    let expected: Vec<u16> =
        hits.iter().flat_map(|hit| hit.albedo.map(|share| level(share.into()))).collect();
    assert_eq!(of("albedo"), (expected.clone(), vec![]));
    let numbers = numbers(&script, 1, &hits).into_iter().map(|number| number as u16);
    assert_eq!(of("object"), (numbers.collect(), vec![]));
    assert_eq!(folder.read("a.object.json"), TABLE.as_bytes());

    render("--pass depth --depth-range 5.5..6.5");
    assert_eq!(of("depth"), (depths(5.5, 6.5), texts(5.5, 6.5).to_vec()));
    assert!(of("depth").0.contains(&0), "before the range");

    // Encoded as the picture: the level of 0.5 in sRGB is 188 of 255.
    folder.write("b.txt", SCRIPT.replace("Background", "Tone srgb\nBackground"));
    folder.rayfold("render b.txt -o b.png --frame 2 --pass-format png --pass albedo").assert().code(0);
    let encoded = levels(&folder.read("b.albedo.png")).0;
    let at = expected.iter().position(|level| *level == 32_768).unwrap();
    assert_eq!((f64::from(encoded[at]) / 257.0).round(), 188.0);
    // A file without a hit.
    folder.write("c.txt", "Screen 2 1\nTrace\n");
    folder.rayfold("render c.txt -o c.png --pass-format png --pass depth,object").assert().code(0);
    assert_eq!(levels(&folder.read("c.depth.png")), (vec![65_535; 2], texts(0.0, 1.0).to_vec()));
    assert_eq!(levels(&folder.read("c.object.png")).0, [0; 2]);
}

#[test]
fn passes_have_the_names_of_their_images() {
    let folder = Folder::new();
    for step in 1..=3 {
        folder.write(&format!("balls/f{step}.txt"), format!("{}{}", "#\n".repeat(step), ball_at(step)));
    }
    folder
        .rayfold("render balls -o out/a.%02d.tif --pass object --pass object,depth --frame 2..3")
        .assert()
        .code(0);
    let names = [2, 3].map(|frame| {
        ["depth.exr", "object.exr", "object.json", "tif"].map(|ending| format!("a.0{frame}.{ending}"))
    });
    assert_eq!(folder.list("out"), names.concat());
    for frame in [2, 3] {
        let table = String::from_utf8(folder.read(&format!("out/a.0{frame}.object.json"))).unwrap();
        let expected = format!(
            "\"script\":\"balls/f{frame}.txt\",\"objects\":[\n{{\"number\":1,\"lines\":[{}],",
            frame + 4
        );
        assert!(table.contains(&expected), "the lines of the frame's own script: {table}");
    }
    // The size of the image, whatever its Screen.
    folder.rayfold("render balls/f1.txt -o c.d.png --pass normal --size 12x8 --samples 4").assert().code(0);
    assert_eq!(decoded(&folder.read("c.d.normal.exr")).0, (12, 8));
}

#[test]
fn wrong_flags_say_what_is_right() {
    let folder = Folder::with("a.txt", SCRIPT);
    let refused = |flags: &str, expected: &str| {
        let output = folder.rayfold(&format!("render a.txt {flags}")).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{flags}: {said}");
        assert!(said.contains(expected), "{flags}: {said}");
        assert_eq!(folder.list("."), ["a.txt"], "{flags}");
    };
    refused("-o a.png --frame 1 --pass deph", "[possible values: depth, normal, object, albedo]");
    refused("-o a.png --frame 1 --pass depth --pass-format jpg", "[possible values: exr, png]");
    refused("-o - --pass depth", "--pass writes files beside images, and standard output (-) is none");
    for animation in ["a.gif", "a.webp", "a.apng", "a.y4m"] {
        refused(
            &format!("-o {animation} --pass depth"),
            "expected an output that ends in .png, .tif or .tiff",
        );
    }
    refused("-o a.png --frame 1 --pass-format png", "--pass <PASS,...>");
    refused("-o a.png --frame 1 --depth-range 1..2", "--pass <PASS,...>");
    refused(
        "-o a.png --frame 1 --pass object --pass-format png --depth-range 1..2",
        "--depth-range is for depth",
    );
    refused("-o a.png --frame 1 --pass depth --depth-range 1..2", "an .exr has the distances themselves");
    for (range, expected) in [
        ("2..1", "did you mean 1..2?"),
        ("1..1", "such as 0..20"),
        ("-1..2", "such as 0..20"),
        ("1", "such as 0..20"),
        ("0..inf", "such as 0..20"),
    ] {
        refused(
            &format!("-o a.png --frame 1 --pass depth --pass-format png --depth-range {range}"),
            expected,
        );
    }
}

#[test]
fn a_number_that_no_level_counts_is_an_error() {
    let behind = "Sphere .1  0 0 9  1 1 1  0 0 0\n".repeat(65_535);
    let folder = Folder::with("a.txt", BALL.replace("Sphere 1  0 0 0", &format!("{behind}Sphere 1  0 0 0")));
    folder.rayfold("render a.txt -o a.png --pass-format png --pass object").assert().code(1).stderr_eq(str![[r#"
error: cannot write a.object.png: frame 1 (a.txt): it shows object 65536, and its pixels count to 65535; expected --pass-format exr

"#]]);
    assert_eq!(folder.list("."), ["a.txt"]);
    folder.rayfold("render a.txt -o a.png --pass object").assert().code(0);
    assert!(decoded(&folder.read("a.object.exr")).1[0].1.contains(&65_536.0));
}

#[test]
fn passes_replace_no_script_and_no_file_that_is_to_be_kept() {
    let folder = Folder::with("a.depth.exr", BALL);
    folder.rayfold("render a.depth.exr -o a.png --pass depth").assert().code(2).stderr_eq(str![[r#"
error: a.depth.exr would replace its input: expected another output

"#]]);
    folder.write("1.depth.exr", BALL);
    folder.rayfold("render 1.depth.exr -o %d.png --pass depth").assert().code(2);
    folder.rayfold("render 1.depth.exr -o %d.png --pass normal").assert().code(0);
    assert_eq!(folder.list("."), ["1.depth.exr", "1.normal.exr", "1.png", "a.depth.exr"]);

    folder.write("b/a.txt", BALL);
    folder.write("b/x.depth.exr", "old");
    for out in ["b/x.png", "b/%c.png"] {
        let out = out.replace("%c", "x%d");
        folder.write("b/x1.depth.exr", "old");
        let command = format!("render b/a.txt -o {out} --pass depth --no-clobber");
        let output = folder.rayfold(&command).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains("depth.exr exists already, and --no-clobber keeps it"), "{said}");
    }
    assert_eq!(folder.list("b"), ["a.txt", "x.depth.exr", "x1.depth.exr"]);
    assert_eq!(folder.read("b/x.depth.exr"), b"old");
}

#[test]
fn only_what_is_missing_is_written_again() {
    let folder = Folder::with("a.txt", SCRIPT);
    for format in ["exr", "png"] {
        let command = format!(
            "render a.txt -o {format}/%d.png --pass depth,object --pass-format {format} --skip-existing"
        );
        folder.rayfold(&command).assert().code(0);
        let names = folder.list(format);
        assert_eq!(names.len(), 8);
        let whole: Vec<_> = names.iter().map(|name| folder.read(&format!("{format}/{name}"))).collect();
        for name in &names {
            folder.write(&format!("{format}/{name}"), &whole[0][..20]);
            let others: Vec<_> = names.iter().filter(|other| *other != name).collect();
            let times = || {
                let time = |name: &&String| {
                    folder.join(&format!("{format}/{name}")).metadata().unwrap().modified().unwrap()
                };
                others.iter().copied().map(|name| time(&name)).collect::<Vec<_>>()
            };
            let before = times();
            folder.rayfold(&command).assert().code(0);
            assert_eq!(times(), before, "{name}");
            let now: Vec<_> = names.iter().map(|name| folder.read(&format!("{format}/{name}"))).collect();
            assert!(now == whole, "{name}");
        }
        let output = folder.rayfold(&command).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains("(2 were there)"), "{said}");
    }
}

#[test]
fn the_same_bytes_come_from_any_number_of_threads_and_any_precision() {
    let folder = Folder::with("a.txt", SCRIPT);
    for format in ["exr", "png"] {
        let mut before = None;
        for flags in ["--threads 1", "--threads 4", "--precision f32", "--precision f64 --samples 9"] {
            let command = format!("render a.txt -o out/%d.png --pass {ALL} --pass-format {format} {flags}");
            folder.rayfold(&command).assert().code(0);
            let files = folder.list("out").into_iter().filter(|name| name.ends_with(&format!("o.{format}")));
            let files: Vec<_> = files.map(|name| folder.read(&format!("out/{name}"))).collect();
            let all = [folder.list("out").len(), files.len()];
            assert!(all[1] >= 2, "{all:?}");
            assert!(before.is_none_or(|before| before == files), "{format} {flags}");
            before = Some(files);
        }
    }
}
