//! Flexible guideway by modal superposition, moving loads, irregularity and chirp (eqs 6-8, 13)
