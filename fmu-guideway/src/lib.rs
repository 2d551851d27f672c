//! FMI 2.0 co-simulation unit: flexible guideway (eqs 6-8, 13)
