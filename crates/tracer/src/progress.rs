//! The progress of a drawing, for displays of it.

use std::sync::atomic::{AtomicU64, Ordering};

/// The work of a drawing: pixels, or samples of pixels. Another thread can read it at any time.
///
/// It is that of the latest drawing whose [`crate::RenderOptions`] refer to it. The preparation of a scene is not counted.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicU64,
    total: AtomicU64,
}

impl Progress {
    /// Returns the work that is done, and the total work, which is 0 before the first pixel. The total of adaptive
    /// sampling is an upper bound, which falls when pixels need no more samples.
    pub fn get(&self) -> (u64, u64) {
        let total = self.total.load(Ordering::Relaxed);
        (self.done.load(Ordering::Relaxed).min(total), total)
    }

    /// Sets the work that is done and the work that remains.
    pub(crate) fn set(&self, done: u64, left: u64) {
        self.done.store(done, Ordering::Relaxed);
        self.total.store(done.saturating_add(left), Ordering::Relaxed);
    }

    pub(crate) fn add(&self, work: u64) {
        self.done.fetch_add(work, Ordering::Relaxed);
    }

    /// Returns the work that is done, without the limit of the total.
    pub(crate) fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, Scene, parse};

    use super::*;
    use crate::{Drawing, RenderOptions, reference};

    const PIXELS: u64 = 40 * 24;

    fn scene(samples: &str) -> Scene {
        let script = format!(
            "Screen 40 24\n{samples}\nLook 0 0 5 0 0 0 45\nIlight 1 1 1 -1 -1 -1\nSphere 1 0 0 0 .1 .1 .1 .5 .5 .5 .3 .3 .3\nTrace\n"
        );
        parse("test", script.as_bytes(), &Limits::default()).script.unwrap().frame(0).unwrap()
    }

    #[test]
    fn all_work_is_done_at_the_end() {
        for (samples, work) in [("", PIXELS), ("Samples 300 0", 300 * PIXELS)] {
            let (scene, progress) = (scene(samples), Progress::default());
            assert_eq!(progress.get(), (0, 0));
            let options = RenderOptions { progress: Some(&progress), ..Default::default() };
            let drawing = Drawing::new(&scene, &options).unwrap();
            for _ in 0..2 {
                drawing.draw().unwrap();
                assert_eq!(progress.get(), (work, work), "{samples}");
            }
            reference::render(&scene, &options).unwrap();
            assert_eq!(progress.get(), (PIXELS, PIXELS));
        }
    }

    #[test]
    fn adaptive_sampling_counts_up_and_its_total_falls() {
        let (scene, progress) = (scene("Samples 1024 1"), Progress::default());
        let options = RenderOptions { progress: Some(&progress), ..Default::default() };
        let drawing = Drawing::new(&scene, &options).unwrap();
        let mut seen = vec![];
        let image = drawing
            .draw_progressively(|_| {
                seen.push(progress.get());
                Ok(())
            })
            .unwrap();
        assert_eq!(seen[0].0, PIXELS, "the first pass is a sample of each pixel");
        assert!(seen.len() > 3 && seen.is_sorted_by(|(before, _), (done, _)| before < done), "{seen:?}");
        assert!(seen.iter().all(|(done, total)| done <= total && *total <= 1024 * PIXELS), "{seen:?}");
        let (done, total) = progress.get();
        assert!(
            done == total && seen[seen.len() - 1].0 < done && total < seen[0].1,
            "{done} {total} {seen:?}"
        );
        let unwatched = RenderOptions::default();
        assert_eq!(image, Drawing::new(&scene, &unwatched).unwrap().draw_picture().unwrap());
    }

    #[cfg(feature = "accuracy")]
    #[test]
    fn the_samples_that_are_counted_are_those_of_the_picture() {
        for samples in ["Samples 64 1", "Samples 700 .5", "Samples 3 0"] {
            let (scene, progress) = (scene(samples), Progress::default());
            let options = RenderOptions { progress: Some(&progress), ..Default::default() };
            let means = Drawing::new(&scene, &options).unwrap().draw_means().unwrap().unwrap();
            let samples_drawn = means.counts.iter().map(|&count| u64::from(count)).sum();
            assert_eq!(progress.get(), (samples_drawn, samples_drawn), "{samples}");
        }
    }
}
