//! The natural order of script names, in which digits count as numbers.

use std::cmp::Ordering;

/// Compares names so that `f2` comes before `f10`: consecutive digits count as one number of any length, and
/// everything else is compared by bytes.
///
/// This is a total order: names with equal numbers (`f1`, `f01`) are ordered by their bytes, so only
/// identical names are equal.
///
/// ```
/// let mut names = ["f10.txt", "f2.txt", "f1.txt"];
/// names.sort_by(|a, b| rayfold_scene::natural_cmp(a, b));
/// assert_eq!(names, ["f1.txt", "f2.txt", "f10.txt"]);
/// ```
pub fn natural_cmp(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a.as_bytes(), b.as_bytes());
    while let (Some(&p), Some(&q)) = (x.first(), y.first()) {
        let order = if p.is_ascii_digit() && q.is_ascii_digit() {
            let (m, n) = (take_number(&mut x), take_number(&mut y));
            m.len().cmp(&n.len()).then_with(|| m.cmp(n))
        } else {
            (x, y) = (&x[1..], &y[1..]);
            p.cmp(&q)
        };
        if order.is_ne() {
            return order;
        }
    }
    x.len().cmp(&y.len()).then_with(|| a.cmp(b))
}

/// Removes the digits at the start, and returns them without leading zeros.
fn take_number<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let end = text.iter().position(|b| !b.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    *text = rest;
    let zeros = digits.iter().take_while(|&&b| b == b'0').count();
    &digits[zeros..]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(ascending: &[&str]) {
        for (i, a) in ascending.iter().enumerate() {
            for (j, b) in ascending.iter().enumerate() {
                assert_eq!(natural_cmp(a, b), i.cmp(&j), "{a:?} against {b:?}");
            }
        }
    }

    #[test]
    fn numbers_count_by_value() {
        check(&["f2", "f10"]);
        check(&["f1.txt", "f2.txt", "f10.txt", "f10a.txt", "g1.txt"]);
        check(&["1-9", "1-10", "2-1"]);
    }

    #[test]
    fn numbers_may_be_longer_than_any_integer_type() {
        check(&["f99999999999999999999", "f100000000000000000000", "f100000000000000000001"]);
    }

    #[test]
    fn names_that_number_alike_are_ordered_by_bytes() {
        check(&["f01", "f1"]);
        check(&["f0", "f00", "f000"]);
        check(&["f01a1", "f1a01", "f01a2"]);
    }

    #[test]
    fn a_name_comes_before_its_extensions() {
        check(&["", "f", "f.txt", "f1", "fa", "ä"]);
    }

    proptest! {
        #[test]
        fn the_order_is_total(a in "[0-2a-b.]{0,6}", b in "[0-2a-b.]{0,6}", c in "[0-2a-b.]{0,6}") {
            prop_assert_eq!(natural_cmp(&a, &b), natural_cmp(&b, &a).reverse());
            prop_assert_eq!(natural_cmp(&a, &b).is_eq(), a == b);
            if natural_cmp(&a, &b).is_le() && natural_cmp(&b, &c).is_le() {
                prop_assert!(natural_cmp(&a, &c).is_le());
            }
        }
    }
}
