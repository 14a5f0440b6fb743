//! Scripts for each way in which indirect light is guided: towards glowing objects, windows, and the sun in a sky's
//! picture. Few random scripts have such light.

/// Walls and the ceiling of a room with a window, of this material.
macro_rules! walls {
    ($material:literal) => {
        concat!(
            "Box -2 2.5 -2  2 2.6 2  ",
            $material,
            "\nBox -2 0 -2.1  2 2.5 -2  ",
            $material,
            "\nBox -2 0 2  2 2.5 2.1  ",
            $material,
            "\nBox 2 0 -2  2.1 2.5 2  ",
            $material,
            "\nBox -2.1 0 -2  -2 2.5 -.9  ",
            $material,
            "\nBox -2.1 0 -.1  -2 2.5 2  ",
            $material,
            "\nBox -2.1 0 -.9  -2 .9 -.1  ",
            $material,
            "\nBox -2.1 1.9 -.9  -2 2.5 -.1  ",
            $material,
            "\n"
        )
    };
}

/// Each script with its name.
pub(super) const SCRIPTS: [(&str, &str); 4] =
    [("glow", GLOW), ("window", WINDOW), ("sun", SUN), ("all", ALL)];

/// A picture of a sky with a sun, as the scripts name it.
pub(super) const SKY: &str = "sun.hdr";

/// A pane, a tube and a lamp that moves, at rough surfaces, glass and fog.
const GLOW: &str = "Screen 40 30
Tone srgb
Samples 24
Indirect 3
Look 1.2 1.6 4.5  0 .6 0  45
Background .02 .02 .04  .05 .06 .1
Fog .1 .1 .15  60
Shutter .6
Frames 2
Material pane   glow 8 6 3
Material tube   glow .3 4 7
Material dark   diffuse .2 .2 .3
Material wall   diffuse .7 .6 .5   checker .6 dark
Material brass  mirror .8 .6 .3   rough .3
Material pearl  diffuse .5 .5 .5   mirror .3 .3 .3   rough .6   shine .4 .4 .4 40
Material clear  glass .9 1 .9 1.5
Plane 0 0 0  0 1 0  wall
Triangle -1 1.5 -1  1 1.5 -1  0 2.1 -1  pane
Capsule .03  -1.8 .3 -.5  -1.8 2 -.5  tube
Sphere .1  (1:-.5 3:1.5) 1.4 .6  pane
Sphere .5  -.7 .5 .2  brass
Sphere .4  .5 .4 .7  clear
Torus .4 .15  1.3 .2 -.2  0 1 0  pearl
Trace
";

/// A room that the sun and the sky light through a window, and whose samples go where the noise is.
const WINDOW: &str = concat!(
    "Screen 40 30
Tone srgb
Samples 40 4
Indirect 3
Look .4 1.3 1.8  -.2 1 -1  70
Sky .6 .6 .6  1 1.7 3
Ilight 6 5 3  1 -.7 -.3  2
Material plaster  diffuse .8 .75 .7
Material floor    diffuse .4 .25 .15   mirror .1 .1 .1   rough .4
Material ball     mirror .7 .7 .7   rough .2
Box -2 -.1 -2  2 0 2  floor
",
    walls!("plaster"),
    "Sphere .4  -.5 .4 -.8  ball
Cylinder .3  .6 0 -1  .6 .8 -1  plaster
Trace
"
);

/// Surfaces below the sun of a picture.
const SUN: &str = "Screen 40 30
Samples 24
Indirect 2
Look 0 1.5 5  0 .5 0  40
Sky \"sun.hdr\" .8 40
Material moss    diffuse .2 .4 .1
Material ground  diffuse .6 .6 .5   noise .3 moss
Material steel   mirror .6 .6 .6   rough .35
Material ice     glass .9 .95 1 1.3
Plane 0 0 0  0 1 0  ground
Roundbox -1.2 0 -.5  -.2 1 .5  .1  steel
Sphere .5  .8 .5 0  ice
Cone .4 .1  .1 0 -.8  .1 1 -.8  ground
Trace
";

/// A room with a lamp and a window, through which the sun of a picture is seen.
const ALL: &str = concat!(
    "Screen 40 30
Tone srgb
Samples 30 3
Indirect 4
Lens .02
Look .4 1.3 1.8  -.2 1 -1  70
Sky \"sun.hdr\" 1 120
Material wall   diffuse .8 .7 .6
Material gold   diffuse .2 .15 .05   mirror .6 .5 .2   rough .25
Material lamp   glow 5 4 2
Material clear  glass 1 .9 .9 1.5
Box -2 -.1 -2  2 0 2  wall
",
    walls!("wall"),
    "Group sign
Text \"8i\" .5 .05  lamp centre
End
Use sign  -.8 1.3 -1.5
Mesh \"model.obj\" gold
Sphere .3  .8 .3 -.6  clear
Trace
"
);

/// Returns the picture of a sky, in Radiance's format: dark but for one pixel.
pub(super) fn sky() -> Vec<u8> {
    let mut picture = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 6\n".to_vec();
    for pixel in 0..18 {
        picture.extend_from_slice(if pixel == 2 { &[200, 180, 140, 131] } else { &[60, 90, 150, 128] });
    }
    picture
}
