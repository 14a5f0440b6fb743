//! Random scripts of all versions of the language: small pictures of every command and clause, by every kind of light.
//!
//! A script depends on its seed alone, on every machine: its numbers are decimals, made of whole numbers.

use fastrand::Rng;

use crate::needs::SKY;

/// The files that scripts name.
pub(super) const FILES: [(&str, &[u8]); 2] = [("model.obj", MODEL), ("sky.png", SKY)];

/// A closed model with normals, colours, and places in a picture: an octahedron.
const MODEL: &[u8] = b"v 1 0 0 .9 .2 .1\nv -1 0 0 .1 .8 .2\nv 0 1 0 .3 .3 .9
v 0 -1 0 .9 .9 .2\nv 0 0 1 .5 .1 .5\nv 0 0 -1 1 1 1
vn 1 0 0\nvn -1 0 0\nvn 0 1 0\nvn 0 -1 0\nvn 0 0 1\nvn 0 0 -1
vt 0 0\nvt .9 0\nvt .5 1\nvt .2 .1\nvt .3 .8\nvt .7 .3
f 1/1/1 3/3/3 5/5/5\nf 3/3/3 2/2/2 5/5/5\nf 2/2/2 4/4/4 5/5/5\nf 4/4/4 1/1/1 5/5/5
f 3/3/3 1/1/1 6/6/6\nf 2/2/2 3/3/3 6/6/6\nf 4/4/4 2/2/2 6/6/6\nf 1/1/1 4/4/4 6/6/6
";

/// The words that are written as solid letters.
const WORDS: [&str; 4] = ["A&", "ray", "8i", "%"];

/// The materials that scripts define. The first is without clauses that cannot be part of a pattern, and the others name it.
const MATERIALS: [&str; 4] = ["plain", "first", "second", "third"];

/// Returns the script of a seed.
pub(super) fn script(seed: u64) -> String {
    let mut dice = Dice { rng: Rng::with_seed(seed), text: String::new(), unit: 1 };
    dice.picture();
    dice.surroundings();
    dice.materials();
    dice.lights();
    dice.objects();
    dice.text += "Trace\n";
    dice.text
}

/// A writer of a script.
struct Dice {
    rng: Rng,
    text: String,
    /// The length of a unit. The units of an orthographic camera are pixels.
    unit: i32,
}

impl Dice {
    fn one_in(&mut self, n: u32) -> bool {
        self.rng.u32(0..n) == 0
    }

    fn one_of<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.rng.usize(0..from.len())]
    }

    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// Returns a number between two numbers of hundredths. Many are round, so that surfaces coincide.
    fn hundredths(&mut self, from: i32, to: i32) -> String {
        let mut number = self.rng.i32(from..=to);
        if self.one_in(3) {
            number = (number / 50 * 50).clamp(from, to);
        }
        format!("{}{}.{:02}", if number < 0 { "-" } else { "" }, number.abs() / 100, number.abs() % 100)
    }

    /// Returns a length between two numbers of hundredths of a unit.
    fn length(&mut self, from: i32, to: i32) -> String {
        self.hundredths(self.unit * from, self.unit * to)
    }

    fn place(&mut self, reach: i32) -> String {
        let [x, y, z] = [(); 3].map(|()| self.length(-reach, reach));
        format!("{x} {y} {z}")
    }

    fn direction(&mut self) -> String {
        if self.one_in(3) {
            return self.one_of(&["0 1 0", "1 0 0", "0 0 1", "0 -1 0", "1 1 0"]).into();
        }
        let [x, z] = [(); 2].map(|()| self.hundredths(-100, 100));
        format!("{x} {} {z}", self.hundredths(10, 100))
    }

    fn color(&mut self) -> String {
        let [r, g, b] = [(); 3].map(|()| self.hundredths(0, 100));
        format!("{r} {g} {b}")
    }

    /// Writes the size, the camera, and how a picture is drawn.
    fn picture(&mut self) {
        let (width, height) = (self.rng.u32(16..48), self.rng.u32(12..32));
        self.line(&format!("Screen {width} {height}"));
        let [eye, target] = [(500, 900), (-50, 50)].map(|(from, to)| self.hundredths(from, to));
        let [aside, up] = [(); 2].map(|()| self.hundredths(-300, 300));
        match self.rng.u32(0..6) {
            0 => {
                self.unit = 12;
                self.line("Orthocamera");
            }
            1 => {
                let camera = format!("Camera {aside} {up} {eye}  0 {target} -1  0 1 0  1  -.6 -.45 .6 .45");
                self.line(&camera);
            }
            _ => {
                let angle = self.rng.u32(20..80);
                self.line(&format!("Look {aside} {up} {eye}  0 {target} 0  {angle}"));
            }
        }
        let samples = self.one_of(&["", "", "", "Samples 4 0", "Samples 9 1", "Samples 16"]);
        self.line(samples);
        if self.unit == 1 && !samples.is_empty() && self.one_in(3) {
            let radius = self.hundredths(5, 40);
            self.line(&format!("Lens {radius}"));
        }
        if !samples.is_empty() && self.one_in(4) {
            let share = self.hundredths(20, 100);
            self.line(&format!("Shutter {share}\nFrames 4"));
        }
        if !samples.is_empty() && self.one_in(3) {
            let bounces = self.rng.u32(1..4);
            self.line(&format!("Indirect {bounces}"));
        }
        if self.one_in(2) {
            self.line("Tone srgb");
        }
        if self.one_in(2) {
            let depth = self.rng.u32(0..9);
            self.line(&format!("Depth {depth}"));
        }
    }

    fn surroundings(&mut self) {
        let [low, high, sky] = [(); 3].map(|()| self.color());
        let line = match self.rng.u32(0..8) {
            0 => String::new(),
            1 => "Background none".into(),
            2 => format!("Background {low}  {high}"),
            3 => format!("Background {low}\nSky {sky}"),
            4 => format!("Sky {low}  {high}"),
            5 => format!("Sky \"sky.png\" {} {}", self.hundredths(20, 150), self.rng.u32(0..360)),
            _ => format!("Background {low}"),
        };
        self.line(&line);
        if self.one_in(6) {
            let (color, distance) = (self.color(), self.length(300, 3000));
            self.line(&format!("Fog {color} {distance}"));
        }
    }

    fn materials(&mut self) {
        for (at, name) in MATERIALS.into_iter().enumerate() {
            let [ambient, diffuse] = [(); 2].map(|()| self.color());
            let mut line = format!("Material {name}  diffuse {diffuse}");
            if self.one_in(2) {
                line += &format!("  ambient {ambient}");
            }
            match self.rng.u32(0..6) {
                0 => line += &format!("  mirror {}", self.color()),
                1 if at > 0 => line += &format!("  glass {} {}", self.color(), self.hundredths(80, 240)),
                _ => {}
            }
            if at == 0 {
                self.line(&line);
                continue;
            }
            if line.contains("mirror") && self.one_in(3) {
                line += &format!("  rough {}", self.hundredths(5, 100));
            }
            if self.one_in(4) {
                line += &format!("  shine {} {}", self.color(), self.rng.u32(2..300));
            }
            if self.one_in(6) {
                line += &format!("  glow {}", self.color());
            }
            let other = MATERIALS[0];
            let size = self.length(10, 150);
            match self.rng.u32(0..10) {
                0 => line += &format!("  checker {size} {other}"),
                1 => line += &format!("  stripes {size} {other}"),
                2 => line += &format!("  noise {size} {other}"),
                3 => line += &format!("  gradient -1 {size} {other}"),
                4 => line += "  image \"sky.png\" ball",
                5 => line += &format!("  image \"sky.png\" flat {size} xy"),
                6 => line += "  own",
                _ => {}
            }
            self.line(&line);
        }
        // Only models have texture coordinates.
        let diffuse = self.color();
        self.line(&format!("Material painted  diffuse {diffuse}  image \"sky.png\" uv"));
    }

    fn lights(&mut self) {
        for _ in 0..self.rng.u32(0..4) {
            let (color, place) = (self.color(), self.place(400));
            let line = if self.one_in(2) {
                let size = self.one_of(&["", "", "3", "20"]);
                format!(
                    "Ilight {color}  {} -1 {}  {size}",
                    self.hundredths(-90, 90),
                    self.hundredths(-90, 90)
                )
            } else {
                let size = self.one_of(&["", "", ".3", "0 2", ".2 3"]);
                format!("Plight {color}  {place}  {size}")
            };
            self.line(&line);
        }
    }

    fn objects(&mut self) {
        self.line("Group pair");
        for _ in 0..self.rng.u32(1..3) {
            self.object();
        }
        self.line("End");
        if self.one_in(3) {
            let (place, normal, material) = (self.length(-200, 0), self.direction(), self.material());
            self.line(&format!("Plane 0 {place} 0  {normal}  {material}"));
        }
        let count = if self.one_in(12) { self.rng.u32(60..120) } else { self.rng.u32(1..10) };
        for _ in 0..count {
            if self.one_in(5) {
                let (place, size) = (self.place(250), self.hundredths(30, 120));
                let [x, y, z] = [(); 3].map(|()| self.rng.u32(0..360));
                self.line(&format!("Use pair  {place}  {x} {y} {z}  {size}"));
            } else {
                self.object();
            }
        }
    }

    /// Returns the name of a material, or its colours.
    fn material(&mut self) -> String {
        if self.one_in(3) {
            let [ambient, diffuse] = [(); 2].map(|()| self.color());
            return format!("{ambient}  {diffuse}");
        }
        self.one_of(&MATERIALS).into()
    }

    fn object(&mut self) {
        let [a, b, c] = [(); 3].map(|()| self.place(250));
        let [radius, other, thin] = [(35, 150), (10, 100), (4, 30)].map(|(from, to)| self.length(from, to));
        let (normal, material) = (self.direction(), self.material());
        let moving = self.length(-100, 100);
        let solid = match self.rng.u32(0..13) {
            0 => format!("Triangle {a}  {b}  {c}"),
            1 => format!("Box {a}  {b}"),
            2 => format!("Disc {radius}  {a}  {normal}"),
            3 => format!("Cylinder {other}  {a}  {b}"),
            4 => format!("Cone {other} {thin}  {a}  {b}"),
            5 => format!("Torus {radius} {thin}  {a}  {normal}"),
            6 => format!("Capsule {other}  {a}  {b}"),
            7 => {
                // Its sides are at least twice as long as its radius.
                let [low, high] = [(-250, 0), (65, 250)]
                    .map(|(from, to)| [(); 3].map(|()| self.length(from, to)).join(" "));
                format!("Roundbox {low}  {high}  {thin}")
            }
            8 => {
                let smooth = self.one_of(&["", "flat", "smooth 60"]);
                let named = if self.one_in(3) { "painted" } else { self.one_of(&MATERIALS) };
                return self.line(&format!("Mesh \"model.obj\" {named} {smooth}"));
            }
            9 => {
                let (words, named) = (self.one_of(&WORDS), self.one_of(&MATERIALS));
                return self.line(&format!("Text \"{words}\" {radius} {thin} {named} centre"));
            }
            10 => format!("Sphere (1:{radius} 3:{other}) {a}"),
            11 => format!("Sphere {radius}  (smooth 1:{moving} 2:{other} 4:0) 0 {moving}"),
            _ => format!("Sphere {radius}  {a}"),
        };
        self.line(&format!("{solid}  {material}"));
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::assets::{Library, MemoryFiles};
    use rayfold_scene::{Limits, parse_with_files};

    use super::*;

    #[test]
    fn all_scripts_are_right_and_use_the_whole_language() {
        let library = Library::new(MemoryFiles::from(FILES.map(|(name, bytes)| (name, bytes.to_vec()))));
        let mut all = String::new();
        for seed in 1..=400 {
            let text = script(seed);
            let parsed = parse_with_files("a", text.as_bytes(), &Limits::default(), &library);
            assert!(parsed.script.is_some(), "seed {seed}: {:?}\n{text}", parsed.diagnostics);
            all += &text;
        }
        let language = rayfold_scene::language();
        let is_missing = |name: &&str| !all.split_whitespace().any(|word| word == *name);
        let missing: Vec<_> = language
            .commands
            .iter()
            .chain(&language.clauses)
            .map(|entry| entry.name)
            .filter(is_missing)
            .collect();
        assert_eq!(missing, ["Clear"]);
    }
}
