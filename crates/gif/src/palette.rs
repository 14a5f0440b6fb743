//! The palette that fits the many colours of a frame best.
//!
//! The colours are divided into clusters: the cluster with the largest error is split repeatedly at the mean of its
//! widest coordinate. Then k-means (Lloyd 1982) improves the clusters. A colour is compared only with centres closer
//! to its own centre than twice its distance from that: by the triangle inequality, no other can be nearer.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use crate::colour::{self, DIMENSIONS, Point};
use crate::histogram::{Bin, Histogram};

/// The largest number of rounds of k-means.
const ROUNDS: usize = 5;
/// The largest number of colours that are clustered one by one. More are counted in coarser bins first.
const SAMPLES: usize = 1 << 13;
/// The number of nearest other entries that are stored per palette entry.
pub(crate) const NEIGHBOURS: usize = 16;

/// A weighted colour.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) point: Point,
    pub(crate) rgb: [f32; 3],
    weight: f32,
}

impl Sample {
    pub(crate) fn of_bins(histogram: &Histogram) -> Vec<Self> {
        histogram.bins().par_iter().with_min_len(1024).map(Self::from).collect()
    }
}

impl From<&Bin> for Sample {
    fn from(bin: &Bin) -> Self {
        let rgb = bin.mean();
        Self { point: colour::point(rgb), rgb, weight: bin.count as f32 }
    }
}

/// The number of nearest other entries that may be drawn in place of a palette entry.
const ALTERNATIVES: usize = 8;

/// The palette, with the point and the nearest other entries of each colour.
#[derive(Debug, Clone)]
pub(crate) struct Palette {
    pub(crate) colours: Vec<[u8; 3]>,
    pub(crate) points: Vec<Point>,
    /// The entries that may be drawn in place of each entry.
    pub(crate) alternatives: Vec<Alternatives>,
    neighbours: Neighbours,
}

/// The nearest other entries of a palette entry.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Alternatives {
    pub(crate) indices: [u8; ALTERNATIVES],
    /// If there are fewer entries, the rest have levels that are far from every colour.
    pub(crate) levels: [[f32; 3]; ALTERNATIVES],
    /// The squared distances of these entries from the entry itself, the least first.
    pub(crate) apart: [f32; ALTERNATIVES],
}

impl Alternatives {
    fn of(near: &[Neighbour], colours: &[[u8; 3]]) -> Self {
        let mut alternatives = Self {
            indices: [0; ALTERNATIVES],
            levels: [[1e9; 3]; ALTERNATIVES],
            apart: [f32::INFINITY; ALTERNATIVES],
        };
        for (at, neighbour) in near.iter().take(ALTERNATIVES).enumerate() {
            alternatives.indices[at] = neighbour.index;
            alternatives.apart[at] = neighbour.apart;
            alternatives.levels[at] = colour::levels(colours[usize::from(neighbour.index)]);
        }
        alternatives
    }
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Neighbour {
    pub(crate) index: u8,
    /// The squared distance, rounded down a little.
    pub(crate) apart: f32,
}

/// For each bin of a histogram, a palette entry near it, from which the search for the nearest starts.
#[derive(Debug)]
pub(crate) struct Guesses {
    /// The bins that `indices` belongs to, if they are not those of the histogram itself.
    coarse: Option<Histogram>,
    indices: Vec<u8>,
}

impl Guesses {
    /// Makes guesses of one index per bin. Without indices, the guess is always the first entry.
    pub(crate) fn of_each(indices: Vec<u8>) -> Self {
        Self { coarse: None, indices }
    }

    /// Returns the index of an entry near a bin, which is given by its number and its mean colour.
    pub(crate) fn of(&self, number: usize, mean: [f32; 3]) -> u8 {
        let at = match &self.coarse {
            None => Some(number),
            Some(coarse) => coarse.find(mean.map(|level| level as u8)),
        };
        at.and_then(|at| self.indices.get(at)).copied().unwrap_or(0)
    }
}

impl Palette {
    /// Makes a palette of these colours, at most 256.
    pub(crate) fn new(colours: Vec<[u8; 3]>) -> Self {
        let points = colours.iter().map(|&rgb| colour::point_of(rgb)).collect::<Vec<_>>();
        let neighbours = Neighbours::of(&points);
        let alternatives =
            (0..colours.len()).map(|at| Alternatives::of(neighbours.at(at as u8), &colours)).collect();
        Self { colours, points, alternatives, neighbours }
    }

    /// Returns the colours of the bins if there are at most `size`, else `size` colours that fit them well. `samples`
    /// are the samples of the bins.
    pub(crate) fn of_bins(histogram: &Histogram, samples: &[Sample], size: usize) -> (Self, Guesses) {
        let bins = histogram.bins();
        if histogram.is_exact() && bins.len() <= size {
            let mut colours = bins.iter().map(|bin| bin.mean().map(|level| level as u8)).collect::<Vec<_>>();
            colours.sort_unstable();
            return (Self::new(colours), Guesses::of_each(Vec::new()));
        }
        if bins.len() <= SAMPLES {
            let (palette, indices) = Self::of(samples, size);
            return (palette, Guesses { coarse: None, indices });
        }
        let mut coarse = Histogram::new(SAMPLES);
        coarse.absorb(histogram);
        let (palette, indices) = Self::of(&Sample::of_bins(&coarse), size);
        (palette, Guesses { coarse: Some(coarse), indices })
    }

    /// Returns at most `size` colours that fit the samples well, and for each sample the index of one near it. There
    /// must be at least one sample.
    fn of(samples: &[Sample], size: usize) -> (Self, Vec<u8>) {
        let mut owners = split(samples, size);
        let mut near: Option<Neighbours> = None;
        for _ in 0..ROUNDS {
            let centres = centres(samples, &mut owners);
            let points = centres.iter().map(|&rgb| colour::point(rgb)).collect::<Vec<_>>();
            let near = match &mut near {
                // Centres move little, so their neighbours hardly change.
                Some(near) if near.points == points.len() => {
                    near.measure(&points);
                    near
                }
                near => near.insert(Neighbours::of(&points)),
            };
            let owned = samples.par_iter().zip(&mut owners).with_min_len(1024);
            let moved = owned.map(|(sample, owner)| {
                let before = *owner;
                *owner = near.nearest(&points, &sample.point, before);
                usize::from(*owner != before)
            });
            let moved = moved.sum::<usize>();
            if moved * 200 < samples.len() {
                break;
            }
        }
        let centres =
            centres(samples, &mut owners).into_iter().map(|rgb| rgb.map(|level| level.round() as u8));
        let centres = centres.collect::<Vec<_>>();
        let mut colours = centres.clone();
        colours.sort_unstable();
        colours.dedup();
        let places =
            centres.iter().map(|rgb| colours.binary_search(rgb).unwrap_or(0) as u8).collect::<Vec<_>>();
        let indices = owners.into_iter().map(|owner| places[usize::from(owner)]).collect();
        (Self::new(colours), indices)
    }

    /// Returns the squared distance of a colour from the nearest other colour.
    pub(crate) fn apart_from_others(&self, index: u8) -> f32 {
        self.neighbours.at(index).first().map_or(f32::INFINITY, |neighbour| neighbour.apart)
    }

    /// Returns the index of the nearest colour. The search starts at `guess`.
    pub(crate) fn nearest(&self, point: &Point, guess: u8) -> u8 {
        self.neighbours.nearest(&self.points, point, guess)
    }
}

/// The nearest others of each point, nearest first.
#[derive(Debug, Clone)]
struct Neighbours {
    points: usize,
    /// The number of neighbours per point.
    each: usize,
    all: Vec<Neighbour>,
}

impl Neighbours {
    fn of(points: &[Point]) -> Self {
        // One coordinate after the other, with padding at the end, so that several distances are computed at once.
        let mut columns = [[0.0_f32; 256]; DIMENSIONS];
        for (index, point) in points.iter().enumerate() {
            for (column, &at) in columns.iter_mut().zip(point) {
                column[index] = at;
            }
        }
        let each = points.len().saturating_sub(1).min(NEIGHBOURS);
        let padded = points.len().next_multiple_of(16);
        let near = points.par_iter().enumerate().with_min_len(64).map(|(own, point)| {
            let mut apart = [0.0_f32; 256];
            for (column, at) in columns.iter().zip(point) {
                for (sum, other) in apart[..padded].iter_mut().zip(column) {
                    *sum += (at - other) * (at - other);
                }
            }
            // The index replaces the lowest bits of the distance.
            let mut keys = [f32::INFINITY; 256];
            for (index, (key, apart)) in (0..).zip(keys.iter_mut().zip(&apart[..points.len()])) {
                *key = f32::from_bits(apart.to_bits() & !0xFF | index);
            }
            keys[own] = f32::INFINITY;
            // The least of each block of 16. The least of these is removed repeatedly.
            let (blocks, _) = keys.as_chunks_mut::<16>();
            let mut leasts = [0.0; 16];
            for (least_of, block) in leasts.iter_mut().zip(&*blocks) {
                *least_of = least(block);
            }
            let mut near = [0; NEIGHBOURS];
            for near in &mut near[..each] {
                *near = least(&leasts).to_bits();
                let (block, at) = ((*near & 0xFF) as usize / 16, *near as usize % 16);
                blocks[block][at] = f32::INFINITY;
                leasts[block] = least(&blocks[block]);
            }
            near
        });
        let neighbour = |key: u32| Neighbour { index: key as u8, apart: f32::from_bits(key & !0xFF) };
        let near = near.collect::<Vec<_>>();
        let all = near.iter().flat_map(|near| &near[..each]).map(|&key| neighbour(key)).collect();
        Self { points: points.len(), each, all }
    }

    fn at(&self, index: u8) -> &[Neighbour] {
        &self.all[usize::from(index) * self.each..][..self.each]
    }

    /// Computes the distances for points that have moved, and sorts the neighbours again.
    fn measure(&mut self, points: &[Point]) {
        for (own, near) in points.iter().zip(self.all.chunks_exact_mut(self.each.max(1))) {
            for neighbour in near.iter_mut() {
                neighbour.apart = colour::error(own, &points[usize::from(neighbour.index)]);
            }
            near.sort_unstable_by(|a, b| a.apart.total_cmp(&b.apart).then(a.index.cmp(&b.index)));
        }
    }

    fn nearest(&self, points: &[Point], point: &Point, guess: u8) -> u8 {
        let from_guess = colour::error(point, &points[usize::from(guess)]);
        let (mut best, mut least) = (guess, from_guess);
        for neighbour in self.at(guess) {
            // By the triangle inequality, a colour twice as far from the guess as the point is cannot be nearer to the point.
            if neighbour.apart >= 4.0 * from_guess {
                return best;
            }
            let error = colour::error(point, &points[usize::from(neighbour.index)]);
            if error < least {
                (best, least) = (neighbour.index, error);
            }
        }
        if self.each + 1 == points.len() {
            return best;
        }
        if best != guess {
            return self.nearest(points, point, best);
        }
        for (index, other) in points.iter().enumerate() {
            let error = colour::error(point, other);
            if error < least {
                (best, least) = (index as u8, error);
            }
        }
        best
    }
}

/// Returns the least number. Compares four at a time, which `fold` does not do by itself.
fn least(numbers: &[f32; 16]) -> f32 {
    let lesser = |a: f32, b: f32| if b < a { b } else { a };
    let mut least = [f32::INFINITY; 4];
    for four in numbers.as_chunks::<4>().0 {
        for k in 0..4 {
            least[k] = lesser(least[k], four[k]);
        }
    }
    lesser(lesser(least[0], least[1]), lesser(least[2], least[3]))
}

/// Returns the mean colours of the clusters. Renumbers the owners (the cluster of each sample) so that
/// no cluster is empty.
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
    /// Approximately the sum of the distances from the mean.
    error: f64,
    /// The coordinate in which the members differ most; `mean` is its mean.
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
        // Distances, not their squares: to the eye, a few exact colours are worth less than many close ones.
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

/// Returns the cluster of each sample, below `size`.
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

/// Moves the wanted items to the front. Returns their number.
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
        assert_eq!(Palette::of(&samples(colours.iter().copied()), 255).0.colours, colours);
    }

    #[test]
    fn nearest_is_the_nearest() {
        let scatter = |k: u32| {
            let [a, b, c, _] = k.wrapping_mul(2_654_435_761).to_be_bytes();
            [a, b, c]
        };
        let (palette, _) = Palette::of(&samples((0..5_000).map(scatter)), 256);
        assert_eq!(palette.colours.len(), 256);
        for k in 5_000..6_000 {
            let point = colour::point_of(scatter(k));
            let found = palette.nearest(&point, (k % 256) as u8);
            let least = palette.points.iter().map(|p| colour::error(p, &point)).fold(f32::MAX, f32::min);
            assert_eq!(colour::error(&palette.points[usize::from(found)], &point), least);
        }
    }
}
