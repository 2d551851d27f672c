//! FMI 2.0 co-simulation unit: Maglev vehicle as a constrained multibody system (eqs 9-12)
