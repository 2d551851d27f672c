//! The last static equilibrium. An importer that solves for the start sets inputs and asks for outputs several
//! times; as long as nothing changes that the equilibrium depends on, it is not searched again.

use multibody::Equilibrium;

/// A cache: never influences a result.
#[derive(Debug, Clone, Default)]
pub(crate) struct Resting {
    /// Fingerprint of the vehicle's parameters.
    key: u64,
    /// Bits of everything else that the equilibrium was found for.
    asked: Vec<u64>,
    found: Option<Equilibrium>,
}

fn bits<'a>(asked: &'a [&'a [f64]]) -> impl Iterator<Item = u64> + 'a {
    asked.iter().flat_map(|values| values.iter().map(|value| value.to_bits()))
}

impl Resting {
    /// The equilibrium, if it is known.
    pub fn find(&self, key: u64, asked: &[&[f64]]) -> Option<Equilibrium> {
        let known = self.key == key && self.asked.iter().copied().eq(bits(asked));
        self.found.clone().filter(|_| known)
    }

    /// The last equilibrium.
    pub fn found(&self) -> Option<&Equilibrium> {
        self.found.as_ref()
    }

    pub fn remember(&mut self, key: u64, asked: &[&[f64]], found: &Equilibrium) {
        self.key = key;
        self.asked.clear();
        self.asked.extend(bits(asked));
        self.found = Some(found.clone());
    }
}
