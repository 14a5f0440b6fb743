//! The best few colours for many.
//!
//! Clusters are split at the mean of their widest coordinate, always the one with the largest error first, and then
//! settled by k-means (Lloyd 1982), where a colour looks only at centres closer than twice its distance from its own.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::colour::{self, DIMENSIONS, Point};
use crate::histogram::{Bin, Histogram};

/// Rounds of k-means at most.
const ROUNDS: usize = 5;
/// The most colours that are looked at one by one.
const SAMPLES: usize = 1 << 12;
/// How many of a colour's nearest others are kept at hand.
pub(crate) const NEIGHBOURS: usize = 16;

/// A weighted colour.
#[derive(Debug, Clone, Copy)]
struct Sample {
    point: Point,
    rgb: [f32; 3],
    weight: f32,
}

impl From<&Bin> for Sample {
    fn from(bin: &Bin) -> Self {
        let rgb = bin.mean();
        Self { point: colour::point(rgb), rgb, weight: bin.count as f32 }
    }
}

/// Colours to draw with; for each its point and its nearest others.
#[derive(Debug, Clone)]
pub(crate) struct Palette {
    pub(crate) colours: Vec<[u8; 3]>,
    pub(crate) points: Vec<Point>,
    neighbours: Vec<Vec<Neighbour>>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Neighbour {
    pub(crate) index: u8,
    /// Squared distance.
    pub(crate) apart: f32,
}

impl Palette {
    /// Colours as they are, at most 256.
    pub(crate) fn new(colours: Vec<[u8; 3]>) -> Self {
        let points = colours.iter().map(|&rgb| colour::point_of(rgb)).collect::<Vec<_>>();
        let neighbours = neighbours(&points);
        Self { colours, points, neighbours }
    }

    /// The colours of the bins if there are at most `size`, else so many that fit them well.
    pub(crate) fn of_bins(histogram: &Histogram, size: usize) -> Self {
        let samples = histogram.bins().iter().map(Sample::from).collect::<Vec<_>>();
        if histogram.is_exact() && samples.len() <= size {
            let mut colours = samples.iter().map(|s| s.rgb.map(|level| level as u8)).collect::<Vec<_>>();
            colours.sort_unstable();
            return Self::new(colours);
        }
        if samples.len() <= SAMPLES {
            return Self::of(&samples, size);
        }
        let mut coarse = Histogram::new(SAMPLES);
        coarse.absorb(histogram);
        Self::of(&coarse.bins().iter().map(Sample::from).collect::<Vec<_>>(), size)
    }

    /// At most `size` colours that fit the samples well, of which there is at least one.
    fn of(samples: &[Sample], size: usize) -> Self {
        let mut owners = split(samples, size);
        for _ in 0..ROUNDS {
            let centres = centres(samples, &mut owners);
            let points = centres.iter().map(|&rgb| colour::point(rgb)).collect::<Vec<_>>();
            let near = neighbours(&points);
            let mut moved = 0;
            for (sample, owner) in samples.iter().zip(&mut owners) {
                let nearest = nearest(&points, &near, &sample.point, *owner);
                moved += usize::from(nearest != *owner);
                *owner = nearest;
            }
            if moved * 200 < samples.len() {
                break;
            }
        }
        let mut colours = centres(samples, &mut owners)
            .into_iter()
            .map(|rgb| rgb.map(|level| level.round() as u8))
            .collect::<Vec<_>>();
        colours.sort_unstable();
        colours.dedup();
        Self::new(colours)
    }

    /// The nearest colour; `guess` is where to start looking.
    pub(crate) fn nearest(&self, point: &Point, guess: u8) -> u8 {
        nearest(&self.points, &self.neighbours, point, guess)
    }

    /// The nearest others of a colour, nearest first.
    pub(crate) fn neighbours(&self, index: u8) -> &[Neighbour] {
        &self.neighbours[usize::from(index)]
    }
}

fn neighbours(points: &[Point]) -> Vec<Vec<Neighbour>> {
    // Coordinate by coordinate, and to the end: several distances are worked out at once.
    let mut columns = [[0.0_f32; 256]; DIMENSIONS];
    for (index, point) in points.iter().enumerate() {
        for (column, &at) in columns.iter_mut().zip(point) {
            column[index] = at;
        }
    }
    let of = |own: usize| {
        let mut apart = [0.0_f32; 256];
        for (column, at) in columns.iter().zip(points[own]) {
            for (sum, other) in apart.iter_mut().zip(column) {
                *sum += (at - other) * (at - other);
            }
        }
        apart[own] = f32::INFINITY;
        let mut near: Vec<Neighbour> = Vec::with_capacity(NEIGHBOURS + 1);
        let mut farthest = f32::INFINITY;
        for (index, &apart) in apart[..points.len()].iter().enumerate() {
            if apart >= farthest || index == own {
                continue;
            }
            let at = near.iter().rposition(|n| n.apart <= apart).map_or(0, |before| before + 1);
            near.insert(at, Neighbour { index: index as u8, apart });
            if near.len() >= NEIGHBOURS {
                near.truncate(NEIGHBOURS);
                farthest = near[NEIGHBOURS - 1].apart;
            }
        }
        near
    };
    (0..points.len()).map(of).collect()
}

fn nearest(points: &[Point], neighbours: &[Vec<Neighbour>], point: &Point, guess: u8) -> u8 {
    let from_guess = colour::error(point, &points[usize::from(guess)]);
    let (mut best, mut least) = (guess, from_guess);
    let near = &neighbours[usize::from(guess)];
    for neighbour in near {
        // Triangle inequality: a colour twice as far from the guess as the point is cannot be nearer to it.
        if neighbour.apart >= 4.0 * from_guess {
            return best;
        }
        let error = colour::error(point, &points[usize::from(neighbour.index)]);
        if error < least {
            (best, least) = (neighbour.index, error);
        }
    }
    if near.len() + 1 == points.len() {
        return best;
    }
    if best != guess {
        return nearest(points, neighbours, point, best);
    }
    for (index, other) in points.iter().enumerate() {
        let error = colour::error(point, other);
        if error < least {
            (best, least) = (index as u8, error);
        }
    }
    best
}

/// Mean colours of the clusters; owners are renumbered so that no cluster is empty.
fn centres(samples: &[Sample], owners: &mut [u8]) -> Vec<[f32; 3]> {
    let mut sums = [[0.0_f64; 4]; 256];
    for (sample, &owner) in samples.iter().zip(owners.iter()) {
        let sum = &mut sums[usize::from(owner)];
        for (sum, level) in sum.iter_mut().zip(sample.rgb) {
            *sum += f64::from(level * sample.weight);
        }
        sum[3] += f64::from(sample.weight);
    }
    let mut number = [0_u8; 256];
    let mut means = Vec::with_capacity(256);
    for (sum, number) in sums.iter().zip(&mut number) {
        if sum[3] > 0.0 {
            *number = means.len() as u8;
            means.push([0, 1, 2].map(|k| (sum[k] / sum[3]) as f32));
        }
    }
    for owner in owners {
        *owner = number[usize::from(*owner)];
    }
    means
}

struct Cluster {
    /// Weighted difference from the mean, about.
    error: f64,
    /// The coordinate with the largest part in it, and its mean.
    widest: usize,
    mean: f32,
    members: std::ops::Range<usize>,
}

impl Cluster {
    fn new(samples: &[Sample], order: &[u32], members: std::ops::Range<usize>) -> Self {
        let mut weight = 0.0_f64;
        let mut sums = [0.0_f64; DIMENSIONS];
        let mut squares = [0.0_f64; DIMENSIONS];
        for &member in &order[members.clone()] {
            let Sample { point, weight: w, .. } = &samples[member as usize];
            weight += f64::from(*w);
            for k in 0..DIMENSIONS {
                let weighted = point[k] * w;
                sums[k] += f64::from(weighted);
                squares[k] += f64::from(weighted * point[k]);
            }
        }
        let spread = |k: usize| squares[k] - sums[k] * sums[k] / weight;
        let widest = (1..DIMENSIONS).fold(0, |best, k| if spread(k) > spread(best) { k } else { best });
        let squares = if members.len() > 1 { (0..DIMENSIONS).map(spread).sum::<f64>() } else { 0.0 };
        // The mean of differences, not of their squares: the eye is not helped by a few colours that are right.
        let error = (squares.max(0.0) * weight).sqrt();
        Self { error, widest, mean: (sums[widest] / weight) as f32, members }
    }
}

impl PartialEq for Cluster {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Cluster {}
impl PartialOrd for Cluster {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cluster {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then(other.members.start.cmp(&self.members.start))
    }
}

/// The cluster, below `size`, of each sample.
fn split(samples: &[Sample], size: usize) -> Vec<u8> {
    let mut order = (0..samples.len() as u32).collect::<Vec<_>>();
    let mut clusters = BinaryHeap::from([Cluster::new(samples, &order, 0..samples.len())]);
    let mut done = Vec::new();
    while clusters.len() + done.len() < size
        && let Some(cluster) = clusters.pop()
    {
        let Cluster { widest, mean, members, .. } = &cluster;
        let below = partition(&mut order[members.clone()], |&m| samples[m as usize].point[*widest] <= *mean);
        if below == 0 || below == members.len() {
            done.push(cluster);
            continue;
        }
        let middle = members.start + below;
        let parts =
            [members.start..middle, middle..members.end].map(|part| Cluster::new(samples, &order, part));
        clusters.extend(parts);
    }
    let mut owners = vec![0; samples.len()];
    for (number, cluster) in done.iter().chain(&clusters).enumerate() {
        for &member in &order[cluster.members.clone()] {
            owners[member as usize] = number as u8;
        }
    }
    owners
}

/// Moves what is wanted to the front and says how many there are.
fn partition<T>(items: &mut [T], wanted: impl Fn(&T) -> bool) -> usize {
    let mut front = 0;
    for k in 0..items.len() {
        if wanted(&items[k]) {
            items.swap(front, k);
            front += 1;
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(colours: impl IntoIterator<Item = [u8; 3]>) -> Vec<Sample> {
        let sample =
            |rgb: [u8; 3]| Sample { point: colour::point_of(rgb), rgb: rgb.map(f32::from), weight: 1.0 };
        colours.into_iter().map(sample).collect()
    }

    #[test]
    fn few_colours_are_all_kept() {
        let colours = (0..200).map(|k| [k, k / 2, 255 - k]).collect::<Vec<_>>();
        assert_eq!(Palette::of(&samples(colours.iter().copied()), 255).colours, colours);
    }

    #[test]
    fn nearest_is_the_nearest() {
        let scatter = |k: u32| {
            let [a, b, c, _] = k.wrapping_mul(2_654_435_761).to_be_bytes();
            [a, b, c]
        };
        let palette = Palette::of(&samples((0..5_000).map(scatter)), 256);
        assert_eq!(palette.colours.len(), 256);
        for k in 5_000..6_000 {
            let point = colour::point_of(scatter(k));
            let found = palette.nearest(&point, (k % 256) as u8);
            let least = palette.points.iter().map(|p| colour::error(p, &point)).fold(f32::MAX, f32::min);
            assert_eq!(colour::error(&palette.points[usize::from(found)], &point), least);
        }
    }
}
