//! How do I get there: visibility graphs that count turns and collision-free predictive control.
