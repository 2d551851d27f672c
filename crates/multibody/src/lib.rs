//! Constrained rigid multibody dynamics in body coordinates with Lagrange multipliers (eqs 9-12)
