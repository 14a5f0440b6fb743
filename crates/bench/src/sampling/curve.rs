//! Times and errors of one way to draw a picture.

/// A measured picture.
#[derive(Clone, Copy)]
pub(super) struct Point {
    pub(super) ms: f64,
    /// Rays per pixel, if known.
    pub(super) rays: f64,
    pub(super) error: f64,
    /// The share of pixels off by more than 4 levels.
    pub(super) off: f64,
}

/// The times and errors of one way to draw a picture.
pub(super) struct Curve {
    pub(super) work: &'static str,
    /// The peer whose way this is; `None` for ours. Of all ways of a peer the best counts.
    pub(super) peer: Option<&'static str>,
    pub(super) way: String,
    pub(super) points: Vec<Point>,
}

impl Curve {
    /// Returns the least time for an error, interpolated between neighbouring points on logarithmic scales; `None` if
    /// the curve does not reach the error.
    pub(super) fn time(&self, error: f64) -> Option<f64> {
        let mut points: Vec<(f64, f64)> = self.points.iter().map(|point| (point.ms, point.error)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        // A slower point that is no better does not count.
        let mut best = f64::INFINITY;
        points.retain(|&(_, error)| error < best && ((best = error), true).1);
        if points.first().is_some_and(|&(_, first)| first <= error) {
            return points.first().map(|&(ms, _)| ms);
        }
        points.windows(2).find(|pair| pair[1].1 <= error).map(|pair| {
            let [(t0, e0), (t1, e1)] = [pair[0], pair[1]];
            t0 * (t1 / t0).powf((error / e0).ln() / (e1 / e0).ln())
        })
    }
}

/// Returns our curves one by one, and those of each peer together.
pub(super) fn gathered(curves: &[Curve], work: &str) -> Vec<Curve> {
    let mut gathered: Vec<Curve> = vec![];
    for Curve { work, peer, way, points } in curves.iter().filter(|curve| curve.work == work) {
        match gathered.iter_mut().find(|curve| peer.is_some() && curve.peer == *peer) {
            Some(curve) => curve.points.extend(points),
            None => gathered.push(Curve {
                work,
                peer: *peer,
                way: peer.map_or(way.clone(), str::to_owned),
                points: points.clone(),
            }),
        }
    }
    gathered
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(peer: Option<&'static str>, way: &str, points: &[(f64, f64)]) -> Curve {
        let points = points.iter().map(|&(ms, error)| Point { ms, rays: 0.0, error, off: 0.0 }).collect();
        Curve { work: "edges", peer, way: way.to_owned(), points }
    }

    #[test]
    fn times_are_read_off_the_best_measurements() {
        let curve = curve(None, "", &[(10.0, 2.0), (15.0, 3.0), (40.0, 0.5)]);
        assert_eq!(curve.time(2.5), Some(10.0));
        assert!((curve.time(1.0).unwrap() - 20.0).abs() < 1e-9);
        assert_eq!(curve.time(0.4), None);
    }

    #[test]
    fn of_a_peer_the_best_way_counts_at_each_error() {
        let curves = [
            curve(None, "adaptive", &[(1.0, 1.0)]),
            curve(None, "uniform", &[(2.0, 1.0)]),
            curve(Some("Mitsuba"), "Mitsuba, one", &[(10.0, 2.0), (30.0, 1.0)]),
            curve(Some("Mitsuba"), "Mitsuba, another", &[(20.0, 1.0), (40.0, 0.5)]),
        ];
        let gathered = gathered(&curves, "edges");
        let ways: Vec<&str> = gathered.iter().map(|curve| curve.way.as_str()).collect();
        assert_eq!(ways, ["adaptive", "uniform", "Mitsuba"]);
        assert_eq!(gathered[2].time(1.0), Some(20.0));
        assert!(super::gathered(&curves, "soft").is_empty());
    }
}
