//! Levitation electromagnet with five-state controller and dynamic filter (eqs 1-5)
