//! What counts in training: transparent pixels, masks, scenes without points, one camera among others.
