//! System tests of units and master together
