//! Soccer fields: lines, landmarks, goals, sides and the rules' numbers.
