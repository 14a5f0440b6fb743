//! `rayfold encode`.

use crate::{BALL, Folder, ball_at};

#[test]
fn encoded_images_are_the_rendered_animation() {
    let script: String = (0..4).map(|step| format!("Clear\n{}", ball_at(step))).collect();
    let folder = Folder::with("balls.txt", script);
    folder.rayfold("render balls.txt -o whole.gif --fps 30 --loop 2").assert().code(0);
    folder.rayfold("render balls.txt -o %d.png").assert().code(0);
    folder.rayfold("render balls.txt -o %d.tif").assert().code(0);
    folder
        .rayfold("encode 1.png 2.tif 3.png 4.png -o parts.gif --fps 30 --loop 2 --threads 1")
        .assert()
        .code(0);
    assert_eq!(folder.read("whole.gif"), folder.read("parts.gif"));
}

#[test]
fn the_image_at_fault_is_named_and_nothing_is_written() {
    let folder = Folder::with("ball.txt", BALL);
    folder.rayfold("render ball.txt -o a.png").assert().code(0);
    folder.rayfold("render ball.txt -o b.png --size 30x20").assert().code(0);
    folder.write("text.png", "this is no image");
    for (frames, fault) in
        [("a.png b.png", "frame 2"), ("a.png text.png", "text.png"), ("none.png", "none.png")]
    {
        let out = folder.rayfold(&format!("encode {frames} -o out.gif")).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(1) && said.contains(fault), "{said}");
    }
    folder.rayfold("encode a.png -o out.png").assert().code(2);
    folder.rayfold("encode a.png -o out.gif --fps 0").assert().code(2);
    assert_eq!(folder.list("."), ["a.png", "b.png", "ball.txt", "text.png"]);
}
