//! The diagnostics of an `animation.json` with faults, word for word.
//!
//! After a deliberate change, `UPDATE_EXPECT=1 cargo test -p rayfold-scene` renews the expected texts.

use expect_test::{Expect, expect};
use rayfold_scene::parse_settings;

fn check(text: impl AsRef<[u8]>, expect: Expect) {
    let parsed = parse_settings("animation.json", text.as_ref());
    assert!(parsed.settings.is_none() && parsed.diagnostics.iter().all(|d| d.is_error()));
    let shown: Vec<_> = parsed.diagnostics.iter().map(|d| d.render(false)).collect();
    expect.assert_eq(&shown.join("\n\n"));
}

#[test]
fn all_faulty_fields_at_once() {
    check(
        "{\n  \"frames\": \"fifty\",\n  \"fps\": 0,\n  \"loop\": true,\n  \"frame\": 1,\n  \"shutter\": [\n1]\n}",
        expect![[r#"
            error: `frames` cannot be `"fifty"`
             --> animation.json:2:13
              |
            2 |   "frames": "fifty",
              |             ^^^^^^^ expected a whole number from 1

            error: `fps` cannot be `0`
             --> animation.json:3:10
              |
            3 |   "fps": 0,
              |          ^ expected a number from 0.01 to 1000, or a fraction such as "30000/1001"

            error: `loop` cannot be `true`
             --> animation.json:4:11
              |
            4 |   "loop": true,
              |           ^^^^ expected a whole number from 0 to 65535

            error: unknown field `frame`
             --> animation.json:5:3
              |
            5 |   "frame": 1,
              |   ^^^^^^^ expected a field's name
              |
              = help: did you mean `frames`?

            error: unknown field `shutter`
             --> animation.json:6:3
              |
            6 |   "shutter": [
              |   ^^^^^^^^^ expected a field's name
              |
              = help: the fields are `frames`, `fps`, `loop`, `bounce`, `durations`, `outputs`"#]],
    );
}

#[test]
fn a_value_of_many_lines() {
    check(
        "{\"fps\": {\n  \"value\": 10\n}}",
        expect![[r#"
            error: `fps` cannot be `{`
             --> animation.json:1:9
              |
            1 | {"fps": {
              |         ^ expected a number from 0.01 to 1000, or a fraction such as "30000/1001""#]],
    );
}

#[test]
fn a_field_set_twice() {
    check(
        r#"{"fps": 10, "fps": 20}"#,
        expect![[r#"
        error: `fps` is set twice
         --> animation.json:1:13
          |
        1 | {"fps": 10, "fps": 20}
          |             ^^^^^ expected each field at most once"#]],
    );
}

#[test]
fn text_that_is_not_json() {
    check(
        "{\n  \"fps\": 10,\n}\n",
        expect![[r#"
        error: this is not a JSON object: trailing comma
         --> animation.json:3:1
          |
        3 | }
          | ^ expected settings such as {"fps": 25}"#]],
    );
    check(
        "{'fps': 10}",
        expect![[r#"
        error: this is not a JSON object: key must be a string
         --> animation.json:1:2
          |
        1 | {'fps': 10}
          |  ^ expected settings such as {"fps": 25}"#]],
    );
    check(
        "{\"fps\": 10",
        expect![[r#"
            error: this is not a JSON object: EOF while parsing an object
             --> animation.json:1:11
              |
            1 | {"fps": 10
              |           ^ expected settings such as {"fps": 25}"#]],
    );
    check(
        "{\"fps\": 10} ä",
        expect![[r#"
        error: this is not a JSON object: trailing characters
         --> animation.json:1:13
          |
        1 | {"fps": 10} ä
          |             ^ expected settings such as {"fps": 25}"#]],
    );
    check(
        "",
        expect![[r#"
        error: this is not a JSON object: EOF while parsing a value
         --> animation.json:1:1
          |
        1 |
          | ^ expected settings such as {"fps": 25}"#]],
    );
}

#[test]
fn json_that_is_no_object() {
    check(
        "[10]",
        expect![[r#"
        error: this is not a JSON object: invalid type: sequence, expected an object
         --> animation.json:1:1
          |
        1 | [10]
          | ^ expected settings such as {"fps": 25}"#]],
    );
    check(
        "\n  10\n",
        expect![[r#"
        error: this is not a JSON object: invalid type: integer `10`, expected an object
         --> animation.json:2:4
          |
        2 |   10
          |    ^ expected settings such as {"fps": 25}"#]],
    );
}

#[test]
fn text_that_is_not_utf8() {
    check(
        b"{\n  \"sch\xf6n\": 1}",
        expect![[r#"
            error: this is not UTF-8 text: 0xF6
             --> animation.json:2:7
              |
            2 |   "sch�n": 1}
              |       ^ expected UTF-8
              |
              = help: save the settings as UTF-8"#]],
    );
}
