//! An estimate of the light that the depth of a scene cuts off, because rays after the last bounce are black.

use rayfold_scene::{Camera, Depth, Samples, Scene, Screen};

use crate::{Drawing, RenderError, RenderOptions};

/// The largest share of a frame's light that may be cut off without a warning.
const NEGLIGIBLE: f64 = 0.001;

/// The number of pixels, approximately, of the smaller picture that is drawn for an estimate.
const PIXELS: f64 = 20_000.0;

/// The light that is missing from a frame because rays are followed for too few bounces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutLight {
    /// The missing share of the frame's light, above .001 and at most 1. The whole is the sum of the frame's levels at
    /// [`Depth::MOST`].
    pub share: f64,
    /// The smallest depth at which the missing share is at most .001; `None` if there is none up to [`Depth::MOST`].
    pub enough: Option<u32>,
}

/// Estimates the light that the depth of a scene cuts off. Returns `None` if it is at most a thousandth.
///
/// Compares pictures with one ray per pixel at the scene's depth and at the greatest depth. They have about 20,000
/// pixels if the frame has more. In parallel projection, in which a pixel is a unit of the world, they have all pixels.
/// A scene without mirrors and glass is not drawn.
///
/// # Errors
/// The errors of [`crate::render`].
pub fn cut_light(scene: &Scene, options: &RenderOptions) -> Result<Option<CutLight>, RenderError> {
    let sends_rays_on = scene.objects.iter().any(|object| {
        let material = object.material();
        let finish = material.finish();
        material.mirror() != glam::DVec3::ZERO
            || finish.is_some_and(|finish| {
                finish.glass.is_some()
                    || finish.pattern.is_some_and(|pattern| pattern.other.mirror() != glam::DVec3::ZERO)
            })
    });
    let depth = options.bounces(scene);
    if !sends_rays_on || depth >= Depth::MOST {
        return Ok(None);
    }
    let share = (PIXELS / scene.screen.pixels() as f64).sqrt();
    let is_small = share >= 1.0 || matches!(scene.camera, Camera::Orthographic);
    let side = |side: u32| if is_small { side } else { (f64::from(side) * share).ceil() as u32 };
    let screen = Screen::new(side(scene.screen.width()), side(scene.screen.height())).unwrap_or(scene.screen);
    let scene = Scene { screen, samples: Samples::default(), ..scene.clone() };
    let levels = |depth| levels(&scene, &RenderOptions { bounces: Some(depth), ..*options });
    let whole = levels(Depth::MOST)?;
    let light = whole.iter().map(|&level| f64::from(level)).sum::<f64>().max(1.0);
    let missing = |depth| -> Result<f64, RenderError> {
        let apart = levels(depth)?.into_iter().zip(&whole).map(|(a, &b)| f64::from(a.abs_diff(b)));
        Ok((apart.sum::<f64>() / light).min(1.0))
    };
    let share = missing(depth)?;
    if share <= NEGLIGIBLE {
        return Ok(None);
    }
    if missing(Depth::MOST - 1)? > NEGLIGIBLE {
        return Ok(Some(CutLight { share, enough: None }));
    }
    // The missing share falls with the depth. Invariant: the depth `enough` is sufficient, `short` is not.
    let (mut short, mut enough) = (depth, Depth::MOST - 1);
    while enough - short > 1 {
        let middle = short.midpoint(enough);
        if missing(middle)? <= NEGLIGIBLE { enough = middle } else { short = middle }
    }
    Ok(Some(CutLight { share, enough: Some(enough) }))
}

/// Returns the levels of the picture, channel by channel.
fn levels(scene: &Scene, options: &RenderOptions) -> Result<Vec<u8>, RenderError> {
    Ok(Drawing::new(scene, options)?.draw()?.into_raw())
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, parse};

    use super::*;

    fn cut(script: &str) -> Option<CutLight> {
        let scene = parse("test", script.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap();
        cut_light(&scene, &RenderOptions::default()).unwrap()
    }

    fn panes(count: u32, depth: u32) -> String {
        let panes: String = (1..=count).map(|k| format!("Disc 30 0 0 -{k} 0 0 1 pane\n")).collect();
        format!(
            "Screen 32 24\nBackground 1 1 1\nLook 0 0 5 0 0 0 20\nDepth {depth}\nMaterial pane glass 1 1 1 1\n{panes}Trace\n"
        )
    }

    #[test]
    fn light_behind_more_panes_than_the_depth_is_missed() {
        assert_eq!(cut(&panes(17, 16)), Some(CutLight { share: 1.0, enough: Some(17) }));
        assert_eq!(cut(&panes(17, 17)), None);
        assert_eq!(cut(&panes(40, 5)), Some(CutLight { share: 1.0, enough: Some(40) }));
    }

    #[test]
    fn what_no_depth_shows_has_none_that_would() {
        let CutLight { share, enough } =
            cut(&panes(80, 3)).unwrap_or(CutLight { share: 0.0, enough: Some(0) });
        // The picture is black at each depth, so no visible light can be missing.
        assert_eq!((share, enough), (0.0, Some(0)));
        let hall =
            "Screen 32 24\nLook 0 0 0 0 0 1 60\nBox -1 -1 -9 1 1 9 .01 .01 .01 0 0 0 .99 .99 .99\nTrace\n";
        let CutLight { share, enough } = cut(hall).unwrap();
        assert!(share > 0.5 && enough.is_none(), "{share} {enough:?}");
    }

    #[test]
    fn a_scene_that_sends_no_ray_on_misses_nothing() {
        assert_eq!(
            cut("Screen 32 24\nLook 0 0 5 0 0 0 20\nDepth 0\nSphere 1 0 0 0 1 1 1 0 0 0\nTrace\n"),
            None
        );
    }

    #[test]
    fn light_behind_sixty_panes_arrives_at_a_depth_of_sixty() {
        let scene = |depth| {
            parse("test", panes(60, depth).as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap()
        };
        for (depth, level) in [(60, 255), (59, 0)] {
            let scene = scene(depth);
            let image = crate::render(&scene, &RenderOptions::default()).unwrap();
            assert_eq!(image.get_pixel(16, 12).0, [level; 3], "depth {depth}");
            assert_eq!(image, crate::reference::render(&scene, &RenderOptions::default()).unwrap());
        }
    }
}
