//! FMI 2.0 co-simulation unit: one levitation electromagnet with its controller (eqs 1-5)
