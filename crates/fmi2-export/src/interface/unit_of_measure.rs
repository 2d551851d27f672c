//! Units of measure with their SI base exponents, and display units.

/// A unit of measure, as FMI describes it: exponents of the SI base units, and base value =
/// `factor`·value + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitOfMeasure {
    pub(crate) name: &'static str,
    /// kg, m, s, A, K, mol, cd, rad.
    pub(crate) exponents: [i8; 8],
    pub(crate) factor: f64,
    pub(crate) offset: f64,
    pub(crate) displays: &'static [DisplayUnit],
}

/// A unit for displaying values: shown value = `factor`·value + `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DisplayUnit {
    pub(crate) name: &'static str,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

impl DisplayUnit {
    /// A display unit; shown value = `factor`·value.
    #[must_use]
    pub const fn new(name: &'static str, factor: f64) -> Self {
        Self { name, factor, offset: 0.0 }
    }

    /// Adds an offset to the shown value.
    #[must_use]
    pub const fn offset(mut self, offset: f64) -> Self {
        self.offset = offset;
        self
    }
}

/// The names of the base units in the order of [`UnitOfMeasure::exponents`].
pub(crate) const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

impl UnitOfMeasure {
    /// A unit without dimension yet; add exponents with [`UnitOfMeasure::kg`], [`UnitOfMeasure::m`], ….
    #[must_use]
    pub const fn new(name: &'static str) -> Self {
        Self { name, exponents: [0; 8], factor: 1.0, offset: 0.0, displays: &[] }
    }

    const fn with(mut self, place: usize, exponent: i8) -> Self {
        self.exponents[place] = exponent;
        self
    }

    /// Exponent of the kilogram.
    #[must_use]
    pub const fn kg(self, exponent: i8) -> Self {
        self.with(0, exponent)
    }

    /// Exponent of the metre.
    #[must_use]
    pub const fn m(self, exponent: i8) -> Self {
        self.with(1, exponent)
    }

    /// Exponent of the second.
    #[must_use]
    pub const fn s(self, exponent: i8) -> Self {
        self.with(2, exponent)
    }

    /// Exponent of the ampere.
    #[must_use]
    pub const fn a(self, exponent: i8) -> Self {
        self.with(3, exponent)
    }

    /// Exponent of the kelvin.
    #[must_use]
    pub const fn k(self, exponent: i8) -> Self {
        self.with(4, exponent)
    }

    /// Exponent of the mole.
    #[must_use]
    pub const fn mol(self, exponent: i8) -> Self {
        self.with(5, exponent)
    }

    /// Exponent of the candela.
    #[must_use]
    pub const fn cd(self, exponent: i8) -> Self {
        self.with(6, exponent)
    }

    /// Exponent of the radian.
    #[must_use]
    pub const fn rad(self, exponent: i8) -> Self {
        self.with(7, exponent)
    }

    /// Number of base units in one of this unit.
    #[must_use]
    pub const fn factor(mut self, factor: f64) -> Self {
        self.factor = factor;
        self
    }

    /// Value in base units at zero of this unit.
    #[must_use]
    pub const fn offset(mut self, offset: f64) -> Self {
        self.offset = offset;
        self
    }

    /// The display units to choose from.
    #[must_use]
    pub const fn displays(mut self, displays: &'static [DisplayUnit]) -> Self {
        self.displays = displays;
        self
    }

    /// Name of the unit, such as `m/s`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// A number without dimension.
    pub const ONE: Self = Self::new("1").displays(&[DisplayUnit::new("%", 100.0)]);
    /// Metre.
    pub const METRE: Self = Self::new("m").m(1).displays(&[DisplayUnit::new("mm", 1e3)]);
    /// Square metre.
    pub const SQUARE_METRE: Self = Self::new("m2").m(2).displays(&[DisplayUnit::new("cm2", 1e4)]);
    /// Second.
    pub const SECOND: Self = Self::new("s").s(1).displays(&[DisplayUnit::new("ms", 1e3)]);
    /// One per second.
    pub const PER_SECOND: Self = Self::new("1/s").s(-1);
    /// Hertz, cycles per second.
    pub const HERTZ: Self = Self::new("Hz").s(-1);
    /// Metre per second.
    pub const METRE_PER_SECOND: Self = Self::new("m/s")
        .m(1)
        .s(-1)
        .displays(&[DisplayUnit::new("km/h", 3.6), DisplayUnit::new("mm/s", 1e3)]);
    /// Metre per second squared.
    pub const METRE_PER_SECOND_SQUARED: Self = Self::new("m/s2").m(1).s(-2);
    /// Radian.
    pub const RADIAN: Self =
        Self::new("rad").rad(1).displays(&[DisplayUnit::new("deg", 180.0 / core::f64::consts::PI)]);
    /// Radian per second.
    pub const RADIAN_PER_SECOND: Self = Self::new("rad/s")
        .rad(1)
        .s(-1)
        .displays(&[DisplayUnit::new("deg/s", 180.0 / core::f64::consts::PI)]);
    /// Radian per second squared.
    pub const RADIAN_PER_SECOND_SQUARED: Self = Self::new("rad/s2").rad(1).s(-2);
    /// Kilogram.
    pub const KILOGRAM: Self = Self::new("kg").kg(1).displays(&[DisplayUnit::new("t", 1e-3)]);
    /// Kilogram per metre.
    pub const KILOGRAM_PER_METRE: Self = Self::new("kg/m").kg(1).m(-1);
    /// Kilogram metre squared.
    pub const KILOGRAM_SQUARE_METRE: Self = Self::new("kg.m2").kg(1).m(2);
    /// Newton.
    pub const NEWTON: Self =
        Self::new("N").kg(1).m(1).s(-2).displays(&[DisplayUnit::new("kN", 1e-3)]);
    /// Newton metre.
    pub const NEWTON_METRE: Self =
        Self::new("N.m").kg(1).m(2).s(-2).displays(&[DisplayUnit::new("kN.m", 1e-3)]);
    /// Newton per metre.
    pub const NEWTON_PER_METRE: Self =
        Self::new("N/m").kg(1).s(-2).displays(&[DisplayUnit::new("kN/mm", 1e-6)]);
    /// Newton second per metre.
    pub const NEWTON_SECOND_PER_METRE: Self = Self::new("N.s/m").kg(1).s(-1);
    /// Newton per second.
    pub const NEWTON_PER_SECOND: Self = Self::new("N/s").kg(1).m(1).s(-3);
    /// Newton per ampere.
    pub const NEWTON_PER_AMPERE: Self = Self::new("N/A").kg(1).m(1).s(-2).a(-1);
    /// Pascal.
    pub const PASCAL: Self =
        Self::new("Pa").kg(1).m(-1).s(-2).displays(&[DisplayUnit::new("bar", 1e-5)]);
    /// Joule.
    pub const JOULE: Self = Self::new("J").kg(1).m(2).s(-2);
    /// Watt.
    pub const WATT: Self =
        Self::new("W").kg(1).m(2).s(-3).displays(&[DisplayUnit::new("kW", 1e-3)]);
    /// Ampere.
    pub const AMPERE: Self = Self::new("A").a(1);
    /// Ampere per second.
    pub const AMPERE_PER_SECOND: Self = Self::new("A/s").a(1).s(-1);
    /// Volt.
    pub const VOLT: Self = Self::new("V").kg(1).m(2).s(-3).a(-1);
    /// Ohm.
    pub const OHM: Self = Self::new("Ohm").kg(1).m(2).s(-3).a(-2);
    /// Henry.
    pub const HENRY: Self = Self::new("H").kg(1).m(2).s(-2).a(-2);
    /// Henry per metre, the unit of permeability.
    pub const HENRY_PER_METRE: Self = Self::new("H/m").kg(1).m(1).s(-2).a(-2);
    /// Volt per metre.
    pub const VOLT_PER_METRE: Self = Self::new("V/m").kg(1).m(1).s(-3).a(-1);
    /// Volt second per metre.
    pub const VOLT_SECOND_PER_METRE: Self = Self::new("V.s/m").kg(1).m(1).s(-2).a(-1);
    /// Volt second squared per metre.
    pub const VOLT_SECOND_SQUARED_PER_METRE: Self = Self::new("V.s2/m").kg(1).m(1).s(-1).a(-1);
    /// Kelvin.
    pub const KELVIN: Self =
        Self::new("K").k(1).displays(&[DisplayUnit::new("degC", 1.0).offset(-273.15)]);
}
