//! Example scenes to start with: those of `scenes/`, each as one script.

/// The name and the text of an example.
type Example = (&'static str, &'static str);

/// All examples that use no other files: the script with curves if the animation has one, else the script of its first
/// frame.
const ALL: [Example; 13] = [
    ("hello", include_str!("../../../scenes/hello/frame01.txt")),
    ("marbles", include_str!("../../../scenes/marbles/marbles.txt")),
    ("glass", include_str!("../../../scenes/glass/glass.txt")),
    ("clockwork", include_str!("../../../scenes/clockwork/clockwork.txt")),
    ("planets", include_str!("../../../scenes/planets/planets.txt")),
    ("lamp", include_str!("../../../scenes/lamp/lamp.txt")),
    ("logo", include_str!("../../../scenes/logo/logo.txt")),
    ("pendulum", include_str!("../../../scenes/pendulum/pendulum.txt")),
    ("room", include_str!("../../../scenes/room/room.txt")),
    ("sphere_light", include_str!("../../../scenes/sphere_light/frame01.txt")),
    ("moving_up", include_str!("../../../scenes/moving_up/frame01.txt")),
    ("artistic", include_str!("../../../scenes/artistic/frame01.txt")),
    ("artisticsss", include_str!("../../../scenes/artisticsss/frame01.txt")),
];

/// Returns the names of the examples.
pub(crate) fn names() -> Vec<&'static str> {
    ALL.iter().map(|(name, _)| *name).collect()
}

/// Returns the text of an example.
pub(crate) fn text(name: &str) -> Option<&'static str> {
    ALL.iter().find(|(other, _)| *other == name).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_example_is_in_order() {
        for name in names() {
            let parsed = rayfold_scene::parse(name, text(name).unwrap().as_bytes(), &Default::default());
            assert!(parsed.script.is_some(), "{name}");
        }
        let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
        let folders =
            std::fs::read_dir(scenes).unwrap().filter(|entry| entry.as_ref().unwrap().path().is_dir());
        // Those that need the files of their folders.
        let with_files = ["grove", "globe", "chess", "package", "still", "neon"];
        assert_eq!(folders.count(), ALL.len() + with_files.len(), "is one of scenes/ missing?");
    }
}
