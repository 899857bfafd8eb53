//! Pixel memory that goes back to where it came from.
