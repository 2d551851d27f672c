//! FMI 2.0 co-simulation master: loads, connects and steps units of any make
