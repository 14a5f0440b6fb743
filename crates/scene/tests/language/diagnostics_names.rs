//! The diagnostics of materials and groups with faults, word for word.
//!
//! After a deliberate change, `UPDATE_EXPECT=1 cargo test -p rayfold-scene` renews the expected texts.

use expect_test::expect;
use rayfold_scene::Limits;

use super::diagnostic_text::{check, check_limited};

#[test]
fn a_material_that_is_not_there() {
    check(
        "Screen 4 3\nMaterial red diffuse 1 0 0\nSphere 1 0 0 -5 rde\nSphere 1 0 0 -5 red\nSphere 1 0 0 -5 azure\nTrace",
        expect![[r#"
            error: unknown material `rde`
             --> a.txt:3:17
              |
            3 | Sphere 1 0 0 -5 rde
              |                 ^^^ expected a material that is defined before this
              |
              = help: did you mean `red`?

            error: unknown material `azure`
             --> a.txt:5:17
              |
            5 | Sphere 1 0 0 -5 azure
              |                 ^^^^^ expected a material that is defined before this"#]],
    );
}

#[test]
fn a_material_that_comes_later() {
    check(
        "Screen 4 3\nSphere 1 0 0 -5 red\nMaterial red diffuse 1 0 0\nTrace",
        expect![[r#"
            error: the material `red` is not known before line 3
             --> a.txt:2:17
              |
            2 | Sphere 1 0 0 -5 red
              |                 ^^^ expected a material that is defined before this
              |
              = help: move line 3 up, before this"#]],
    );
}

#[test]
fn a_material_that_is_defined_twice() {
    check(
        "Screen 4 3\nMaterial red diffuse 1 0 0\n\nMaterial red diffuse 0 1 0\nSphere 1 0 0 -5 red\nTrace",
        expect![[r#"
            error: there is a material `red` already, in line 2
             --> a.txt:4:10
              |
            4 | Material red diffuse 0 1 0
              |          ^^^ expected another name"#]],
    );
}

#[test]
fn a_name_with_numbers_behind_it() {
    check(
        "Screen 4 3\nMaterial red diffuse 1 0 0\nSphere 1 0 0 -5 red 1 1\nTrace",
        expect![[r#"
            error: `red` is not a number
             --> a.txt:3:17
              |
            3 | Sphere 1 0 0 -5 red 1 1
              |                 ^^^ expected `ar`, a number such as 2, -.5 or 1e-3
              |
              = help: the name of a material replaces all coefficients"#]],
    );
}

#[test]
fn names_that_are_none() {
    check(
        "Screen 4 3\nMaterial\nMaterial 1st diffuse 1 0 0\nGroup roté\nEnd\nUse (1:2)\nGroup\nEnd\nTrace",
        expect![[r#"
            error: `Material` lacks the name of a material
             --> a.txt:2:9
              |
            2 | Material
              |         ^ expected a name here
              |
              = help: write `Material NAME CLAUSE ...`

            error: invalid name `1st`
             --> a.txt:3:10
              |
            3 | Material 1st diffuse 1 0 0
              |          ^^^ expected the name of a material
              |
              = help: a name is a letter or `_`, then letters, digits, `_` and `-`

            error: invalid name `roté`
             --> a.txt:4:7
              |
            4 | Group roté
              |       ^^^^ expected the name of a group
              |
              = help: a name is a letter or `_`, then letters, digits, `_` and `-`

            error: invalid name `(1:2)`
             --> a.txt:6:5
              |
            6 | Use (1:2)
              |     ^^^^^ expected the name of a group
              |
              = help: a name is a letter or `_`, then letters, digits, `_` and `-`

            error: `Group` lacks the name of a group
             --> a.txt:7:6
              |
            7 | Group
              |      ^ expected a name here
              |
              = help: write `Group NAME`"#]],
    );
}

#[test]
fn clauses() {
    check(
        "Screen 4 3\nMaterial a\nMaterial b difuse 1 0 0 shine 1 1 1 9\nMaterial c colour 1 0 0\nMaterial d diffuse 1 0 0 diffuse 0 1 0\nMaterial e shine 1 1 diffuse 0 0 0\nMaterial f diffuse 1 x 1\nMaterial g shine 1 1 1 .5 glass 1 1 1 0\nMaterial h diffuse 1 0 0 1\nTrace",
        expect![[r#"
            error: this material has no clauses
             --> a.txt:2:11
              |
            2 | Material a
              |           ^ expected a clause, such as `diffuse .8 .2 .1`
              |
              = help: the clauses are `ambient`, `diffuse`, `mirror`, `shine`, `glass`, `checker`, `stripes`, `noise`, `gradient`, `image`, `own`, `glow`, `rough`

            error: unknown material clause `difuse`
             --> a.txt:3:12
              |
            3 | Material b difuse 1 0 0 shine 1 1 1 9
              |            ^^^^^^ expected a clause
              |
              = help: did you mean `diffuse`?

            error: unknown material clause `colour`
             --> a.txt:4:12
              |
            4 | Material c colour 1 0 0
              |            ^^^^^^ expected a clause
              |
              = help: did you mean `diffuse`?

            error: a material has one `diffuse` only
             --> a.txt:5:26
              |
            5 | Material d diffuse 1 0 0 diffuse 0 1 0
              |                          ^^^^^^^ expected another clause

            error: `shine` takes 4 numbers, found 2
             --> a.txt:6:21
              |
            6 | Material e shine 1 1 diffuse 0 0 0
              |                     ^ expected `b` here
              |
              = help: write `shine r g b n`

            error: `x` is not a number
             --> a.txt:7:22
              |
            7 | Material f diffuse 1 x 1
              |                      ^ expected `rg`, a number such as 2, -.5 or 1e-3

            error: the exponent n must be at least 1
             --> a.txt:8:24
              |
            8 | Material g shine 1 1 1 .5 glass 1 1 1 0
              |                        ^^ expected a number from 1

            error: the index of refraction must be greater than zero
             --> a.txt:8:39
              |
            8 | Material g shine 1 1 1 .5 glass 1 1 1 0
              |                                       ^ expected a number greater than 0

            error: unknown material clause `1`
             --> a.txt:9:26
              |
            9 | Material h diffuse 1 0 0 1
              |                          ^ expected a clause
              |
              = help: the clauses are `ambient`, `diffuse`, `mirror`, `shine`, `glass`, `checker`, `stripes`, `noise`, `gradient`, `image`, `own`, `glow`, `rough`"#]],
    );
}

#[test]
fn patterns() {
    check(
        "Screen 4 3\nMaterial a diffuse 1 0 0\nMaterial b shine 1 1 1 9\nMaterial c checker 1 a stripes 1 a\nMaterial d checker 1 b\nMaterial e checker 0 a\nMaterial f gradient 1 1 a\nMaterial g noise 1\nMaterial h noise 1 h\nTrace",
        expect![[r#"
            error: a material has one pattern only, and this one has `checker`
             --> a.txt:4:24
              |
            4 | Material c checker 1 a stripes 1 a
              |                        ^^^^^^^ expected another clause

            error: the material `b` cannot be part of a pattern: it has clauses other than `ambient`, `diffuse` and `mirror`
             --> a.txt:5:22
              |
            5 | Material d checker 1 b
              |                      ^ expected a material of `ambient`, `diffuse` and `mirror` only

            error: the size s must be greater than zero
             --> a.txt:6:20
              |
            6 | Material e checker 0 a
              |                    ^ expected a number greater than 0

            error: the ends of the gradient must differ
             --> a.txt:7:21
              |
            7 | Material f gradient 1 1 a
              |                     ^^^ expected `a` and `b` to differ

            error: `noise` lacks the name of a material
             --> a.txt:8:19
              |
            8 | Material g noise 1
              |                   ^ expected a name here
              |
              = help: write `noise s NAME`

            error: the material `h` is not known before line 9
             --> a.txt:9:20
              |
            9 | Material h noise 1 h
              |                    ^ expected a material that is defined before this
              |
              = help: move line 9 up, before this"#]],
    );
}

#[test]
fn unused_names_are_warnings() {
    check(
        "Screen 4 3\nMaterial red diffuse 1 0 0\nMaterial blue diffuse 0 0 1\nMaterial both checker 1 blue\nGroup ball\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nTrace",
        expect![[r#"
            warning: this material is not used
             --> a.txt:2:10
              |
            2 | Material red diffuse 1 0 0
              |          ^^^ expected something that uses this material

            warning: this material is not used
             --> a.txt:4:10
              |
            4 | Material both checker 1 blue
              |          ^^^^ expected something that uses this material

            warning: this group is not used
             --> a.txt:5:7
              |
            5 | Group ball
              |       ^^^^ expected something that uses this group"#]],
    );
}

#[test]
fn a_group_that_is_not_there() {
    check(
        "Screen 4 3\nGroup ball\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nUse bal\nUse ball\nUse lamp\nTrace",
        expect![[r#"
            error: unknown group `bal`
             --> a.txt:5:5
              |
            5 | Use bal
              |     ^^^ expected a group that is defined before this
              |
              = help: did you mean `ball`?

            error: unknown group `lamp`
             --> a.txt:7:5
              |
            7 | Use lamp
              |     ^^^^ expected a group that is defined before this"#]],
    );
}

#[test]
fn groups_that_use_themselves_or_what_comes_later() {
    check(
        "Screen 4 3\nGroup a\nUse a\nUse b\nEnd\nGroup b\nUse a\nEnd\nUse b\nTrace",
        expect![[r#"
            error: the group `a` cannot use itself
             --> a.txt:3:5
              |
            3 | Use a
              |     ^ expected a group that is defined before this

            error: the group `b` is not known before line 6
             --> a.txt:4:5
              |
            4 | Use b
              |     ^ expected a group that is defined before this
              |
              = help: move line 6 up, before this"#]],
    );
}

#[test]
fn a_group_that_is_defined_twice() {
    check(
        "Screen 4 3\nGroup a\nEnd\nGroup a\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nUse a\nTrace",
        expect![[r#"
            error: there is a group `a` already, in line 2
             --> a.txt:4:7
              |
            4 | Group a
              |       ^ expected another name"#]],
    );
}

#[test]
fn an_end_without_a_group() {
    check(
        "Screen 4 3\nEnd\nTrace",
        expect![[r#"
            error: `End` without a `Group`
             --> a.txt:2:1
              |
            2 | End
              | ^^^ expected a `Group` before this"#]],
    );
}

#[test]
fn a_group_without_an_end() {
    check(
        "Screen 4 3\nTrace\nGroup a\nSphere 1 0 0 0 1 0 0 0 0 0",
        expect![[r#"
            error: this group has no end
             --> a.txt:3:1
              |
            3 | Group a
              | ^^^^^ expected an `End` after its objects"#]],
    );
}

#[test]
fn what_may_not_stand_in_a_group() {
    check(
        "Screen 4 3\nGroup a\nSphere 1 0 0 0 1 0 0 0 0 0\nIlight 1 1 1 0 0 -1\nUse a\nTrace",
        expect![[r#"
            error: `Ilight` is not allowed in a group
             --> a.txt:4:1
              |
            4 | Ilight 1 1 1 0 0 -1
              | ^^^^^^ expected an object, `Use` or `End`
              |
              = help: the group `a` starts in line 2; is its `End` missing?"#]],
    );
}

#[test]
fn a_group_in_a_group() {
    check(
        "Screen 4 3\nGroup a\nGroup b\nEnd\nEnd\nUse a\nUse b\nTrace",
        expect![[r#"
            error: `Group` is not allowed in a group
             --> a.txt:3:1
              |
            3 | Group b
              | ^^^^^ expected an object, `Use` or `End`
              |
              = help: the group `a` starts in line 2; is its `End` missing?"#]],
    );
}

#[test]
fn a_misspelt_group_or_end() {
    check(
        "Screen 4 3\nGruop a\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nGroup b\nSphere 1 0 0 0 1 0 0 0 0 0\nEnnd\nUse a\nUse b\nTrace",
        expect![[r#"
            error: unknown command `Gruop`
             --> a.txt:2:1
              |
            2 | Gruop a
              | ^^^^^ expected a command
              |
              = help: did you mean `Group`?

            error: unknown command `Ennd`
             --> a.txt:7:1
              |
            7 | Ennd
              | ^^^^ expected a command
              |
              = help: did you mean `End`?"#]],
    );
}

#[test]
fn faults_of_a_definition_are_told_once() {
    check(
        "Screen 4 3\nMaterial red diffuse 1 0 x\nSphere 1 0 0 -5 red\nMatreial blue diffuse 1 0 0\nSphere 1 0 0 -5 blue\nTrace",
        expect![[r#"
            error: `x` is not a number
             --> a.txt:2:26
              |
            2 | Material red diffuse 1 0 x
              |                          ^ expected `rb`, a number such as 2, -.5 or 1e-3

            error: unknown command `Matreial`
             --> a.txt:4:1
              |
            4 | Matreial blue diffuse 1 0 0
              | ^^^^^^^^ expected a command
              |
              = help: did you mean `Material`?"#]],
    );
}

#[test]
fn a_group_with_a_negative_scale() {
    check(
        "Screen 4 3\nGroup a\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nUse a 0 0 0 0 0 0 -1\nUse a 0 0 0 0 0 0 (1:1 5:-1)\nFrames 5\nTrace",
        expect![[r#"
            error: the scale must not be negative
             --> a.txt:5:19
              |
            5 | Use a 0 0 0 0 0 0 -1
              |                   ^^ expected a number from 0

            error: the scale is -1 at frame 5
             --> a.txt:6:19
              |
            6 | Use a 0 0 0 0 0 0 (1:1 5:-1)
              |                   ^^^^^^^^^^ expected a number from 0 from frame 1 to 5"#]],
    );
}

#[test]
fn a_material_whose_shine_fails_at_a_frame() {
    check(
        "Screen 4 3\nMaterial a shine 1 1 1 (1:9 10:.5)\nGroup g\nSphere 1 0 0 0 a\nEnd\nUse g\nFrames 10\nTrace",
        expect![[r#"
            error: the exponent n is 0.5 at frame 10
             --> a.txt:2:24
              |
            2 | Material a shine 1 1 1 (1:9 10:.5)
              |                        ^^^^^^^^^^^ expected a number from 1 from frame 1 to 10

            warning: there is no light: diffuse colours are black
             --> a.txt:8:1
              |
            8 | Trace
              | ^^^^^ expected an `Ilight` or `Plight` before this
              |
              = help: write for example `Ilight 1 1 1  -1 -2 -1`"#]],
    );
}

#[test]
fn a_group_that_is_moved_too_far() {
    check(
        "Screen 4 3\nGroup a\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nGroup b\nUse a 1e300 0 0 0 0 0 1e10\nEnd\nUse b 0 0 0 0 0 0 1e10\nUse b 0 0 0 0 0 0 .5\nTrace",
        expect![[r#"
            error: the group's position or scale overflows
             --> a.txt:8:7
              |
            8 | Use b 0 0 0 0 0 0 1e10
              |       ^^^^^^^^^^^^^^^^ expected values up to 1.79e308"#]],
    );
}

#[test]
fn what_a_clear_removes_of_groups() {
    check(
        "Screen 4 3\nGroup a\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\nUse a\nClear\nSamples 4\nTrace\nDepth 3",
        expect![[r#"
            warning: this has no effect: a `Clear` removes it before a `Trace` shows it
             --> a.txt:5:1
              |
            5 | Use a
              | ^^^ expected a `Trace` between this and the `Clear`
              |
              = help: `Trace` renders a frame of everything that stands before it

            warning: this has no effect: no `Trace` follows
             --> a.txt:9:1
              |
            9 | Depth 3
              | ^^^^^ expected a `Trace` after this
              |
              = help: `Trace` renders a frame of everything that stands before it"#]],
    );
}

#[test]
fn a_chain_of_doublings_is_counted_not_drawn() {
    let mut script = String::from("Screen 4 3\nGroup g0\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\n");
    for k in 1..=70 {
        script += &format!("Group g{k}\nUse g{}\nUse g{}\nEnd\n", k - 1, k - 1);
    }
    check(
        format!("{script}Use g21\nUse g22\nUse g70\nTrace"),
        expect![[r#"
            error: more than 4,000,000 objects in a scene
               --> a.txt:286:1
                |
            286 | Use g22
                | ^^^ expected at most 4,000,000, with this there are 6,291,456

            error: more than 16,000,000 groups drawn in a scene
               --> a.txt:287:1
                |
            287 | Use g70
                | ^^^ expected at most 16,000,000, with this there are many more"#]],
    );
    check(
        format!("{script}Use g70\nTrace"),
        expect![[r#"
            error: more than 4,000,000 objects in a scene
               --> a.txt:285:1
                |
            285 | Use g70
                | ^^^ expected at most 4,000,000, with this there are many more

            error: more than 16,000,000 groups drawn in a scene
               --> a.txt:285:1
                |
            285 | Use g70
                | ^^^ expected at most 16,000,000, with this there are many more"#]],
    );
}

#[test]
fn a_long_chain_of_groups_is_counted_too() {
    let mut script = String::from("Screen 4 3\nGroup g0\nSphere 1 0 0 0 1 0 0 0 0 0\nEnd\n");
    for k in 1..=1000 {
        script += &format!("Group g{k}\nUse g{}\nEnd\n", k - 1);
    }
    let uses = "Use g1000\n".repeat(5);
    let limits = Limits { max_objects: 1000, ..Limits::default() };
    check_limited(
        format!("{script}{uses}Trace"),
        limits,
        expect![[r#"
        error: more than 4,000 groups drawn in a scene
            --> a.txt:3008:1
             |
        3008 | Use g1000
             | ^^^ expected at most 4,000, with this there are 4,004"#]],
    );
}
