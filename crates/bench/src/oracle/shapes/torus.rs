//! Tori: Sturm's theorem on the quartic.

use rayfold_scene::Torus;

use super::Shape;
use crate::oracle::line::Line;
use crate::oracle::real::{Real, Vector};

/// The coefficients of the powers 0, 1, 2, ...
type Polynomial = Vec<Real>;

/// A remainder is rounding error if it is smaller than the dividend by this power of two.
const NOTHING: i32 = -330;

/// Bisections of an interval that contains a root, if Newton's method does not converge.
const HALVINGS: usize = 360;

impl Shape for Torus {
    fn extent(&self) -> f64 {
        self.center().abs().max_element() + self.radius() + self.thickness()
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let from = line.origin.minus(&self.center().into());
        let (radius, thickness) = (Real::from(self.radius()), Real::from(self.thickness()));
        let (ring, tube) = (&radius * &radius, &thickness * &thickness);
        // Only the part of the line within the bounding sphere.
        let square = line.direction.dot(&line.direction);
        let (middle, apart) = (from.dot(&line.direction), from.dot(&from));
        let outer = &radius + &thickness;
        let inside = &(&middle * &middle) - &(&square * &(&apart - &(&outer * &outer)));
        if inside.sign() < 0 {
            return None;
        }
        let root = inside.root();
        let hair = &root.shifted(-40) + &outer.shifted(-40);
        let (low, high) =
            ((&(&-&middle - &root) - &hair).over(&square), (&(&root - &middle) + &hair).over(&square));
        let low = if low > *start { low } else { start.clone() };
        if high <= low {
            return None;
        }
        // (|p|² + R² - r²)²·n² - 4·R²·(|p|²·n² - (p·n)²)
        let normal = Vector::from(self.normal());
        let of_normal = normal.dot(&normal);
        let ball = vec![&(&apart + &ring) - &tube, middle.shifted(1), square.clone()];
        let height = vec![from.dot(&normal), line.direction.dot(&normal)];
        let width = vec![apart, middle.shifted(1), square];
        let aside = difference(&scaled(&width, &of_normal), &product(&height, &height));
        let quartic =
            difference(&scaled(&product(&ball, &ball), &of_normal), &scaled(&aside, &ring.shifted(2)));
        first_root(quartic, low, high)
    }

    fn outward(&self, line: &Line, t: &Real) -> Vector {
        let from = line.at(t).minus(&self.center().into());
        let normal = Vector::from(self.normal()).unit();
        let aside = from.plus(&-&from.dot(&normal), &normal).unit();
        from.plus(&-&Real::from(self.radius()), &aside).unit()
    }

    fn face(&self, _: &Line, _: &Real) -> Option<(usize, f64)> {
        None
    }
}

fn product(p: &[Real], q: &[Real]) -> Polynomial {
    let mut out = vec![Real::zero(); p.len() + q.len() - 1];
    for (i, a) in p.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            out[i + j] = &out[i + j] + &(a * b);
        }
    }
    out
}

fn scaled(p: &[Real], by: &Real) -> Polynomial {
    p.iter().map(|a| a * by).collect()
}

/// Returns `p - q`. The degree of q is at most that of p.
fn difference(p: &[Real], q: &[Real]) -> Polynomial {
    p.iter().enumerate().map(|(k, a)| q.get(k).map_or_else(|| a.clone(), |b| a - b)).collect()
}

fn at(p: &[Real], t: &Real) -> Real {
    p.iter().rev().fold(Real::zero(), |sum, a| &(&sum * t) + a)
}

fn derivative(p: &[Real]) -> Polynomial {
    p.iter().enumerate().skip(1).map(|(k, a)| a * &Real::from(k as f64)).collect()
}

/// Returns the first root above `low`, up to `high`.
fn first_root(quartic: Polynomial, low: Real, high: Real) -> Option<Real> {
    // Maps the interval to 0..1, where the powers have similar sizes.
    let width = &high - &low;
    let quartic = shifted_to(&quartic, &low, &width);
    let chain = chain(quartic);
    let changes = |t: &Real| {
        let signs = chain.iter().map(|p| at(p, t).sign()).filter(|&sign| sign != 0);
        let signs: Vec<i32> = signs.collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    let (mut from, mut to) = (Real::zero(), Real::from(1.0));
    let before = changes(&from);
    if before <= changes(&to) {
        return None;
    }
    let slope = derivative(&chain[0]);
    for step in 0..HALVINGS {
        let middle = (&from + &to).shifted(-1);
        if changes(&middle) < before {
            to = middle
        } else {
            from = middle
        }
        // The interval contains a single root: Newton's method, if its steps stay within.
        if step >= 60 && step % 60 == 0 {
            let mut root = (&from + &to).shifted(-1);
            let mut stays = true;
            for _ in 0..6 {
                let rise = at(&slope, &root);
                if rise.sign() == 0 {
                    stays = false;
                    break;
                }
                root = &root - &at(&chain[0], &root).over(&rise);
                stays &= root >= from && root <= to;
            }
            if stays && at(&chain[0], &root).magnitude() < at(&slope, &root).magnitude().shifted(-450) {
                return Some(&low + &(&root * &width));
            }
        }
    }
    Some(&low + &(&(&from + &to).shifted(-1) * &width))
}

/// Returns the polynomial in s for t = `low` + s·`width`, with s from 0 to 1.
fn shifted_to(p: &[Real], low: &Real, width: &Real) -> Polynomial {
    let step = vec![low.clone(), width.clone()];
    p.iter().rev().fold(vec![Real::zero()], |sum, a| {
        let mut sum = product(&sum, &step);
        sum[0] = &sum[0] + a;
        sum.truncate(p.len());
        sum
    })
}

/// Returns Sturm's sequence.
fn chain(p: Polynomial) -> Vec<Polynomial> {
    let p = normalized(p, None).unwrap_or_default();
    let slope = normalized(derivative(&p), None).unwrap_or_default();
    let mut chain = vec![p, slope];
    while let [.., a, b] = &chain[..] {
        if b.len() < 2 {
            break;
        }
        let Some(next) = normalized(remainder(a, b), Some(NOTHING)) else { break };
        chain.push(next.iter().map(|x| -x).collect());
    }
    chain
}

/// Scales the largest coefficient to about 1, and removes leading zeros. Returns `None` if all are below 2^`least`.
fn normalized(mut p: Polynomial, least: Option<i32>) -> Option<Polynomial> {
    let largest = p.iter().map(Real::magnitude).reduce(|a, b| if b > a { b } else { a })?;
    let nothing = least.is_some_and(|least| largest < Real::from(1.0).shifted(least));
    if nothing || largest.sign() == 0 {
        return None;
    }
    for a in &mut p {
        *a = a.over(&largest);
    }
    let hair = Real::from(1.0).shifted(NOTHING);
    while p.last().is_some_and(|a| a.magnitude() < hair) {
        p.pop();
    }
    Some(p)
}

/// Returns the remainder of a division. The divisor's leading coefficient is not 0.
fn remainder(a: &[Real], b: &[Real]) -> Polynomial {
    let mut rest = a.to_vec();
    while rest.len() >= b.len() {
        let shift = rest.len() - b.len();
        let (Some(top), Some(leading)) = (rest.pop(), b.last()) else { break };
        let part = top.over(leading);
        for (k, coefficient) in b.iter().enumerate().take(b.len() - 1) {
            rest[shift + k] = &rest[shift + k] - &(&part * coefficient);
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rayfold_scene::{Material, Object};

    use super::*;
    use crate::oracle::nearest;

    #[test]
    fn a_ray_meets_a_torus_where_it_should() {
        let torus = Torus::new(3.0, 1.0, DVec3::ZERO, DVec3::new(0.0, 2.0, 0.0), Material::default());
        let torus = Object::Torus(torus.unwrap());
        let t = |origin: [f64; 3], direction: [f64; 3]| {
            nearest(std::slice::from_ref(&torus), origin.into(), direction.into()).map(|hit| hit.t.to_f64())
        };
        assert_eq!(t([9.0, 0.0, 0.0], [-2.0, 0.0, 0.0]), Some(2.5));
        assert_eq!(t([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some(1.0));
        assert_eq!(t([0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some(2.0));
        assert_eq!(t([-3.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some(1.0));
        assert_eq!(t([-5.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(t([0.0, 9.0, 0.0], [0.0, -1.0, 0.0]), None);
        assert_eq!(t([9.0, 1.0, 0.0], [-1.0, 0.0, 0.0]), Some(6.0), "it touches the top");
        assert_eq!(t([9.0, 1.0 + 1e-15, 0.0], [-1.0, 0.0, 0.0]), None);
        assert_eq!(t([2.0, 9.0, 0.0], [0.0, -1.0, 0.0]), Some(9.0), "it touches the inner equator");
        assert_eq!(t([4.0, 0.0, 0.0], [1.0, 0.0, 0.0]), None, "from the surface");
        assert_eq!(t([4.0, 0.0, 0.0], [-1.0, 0.0, 0.0]), Some(2.0), "from the surface inwards");
        let far = t([9e15, 0.0, 0.0], [-1.0, 0.0, 0.0]);
        assert_eq!(far, Some(9e15 - 4.0));
    }
}
