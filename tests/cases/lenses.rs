//! Camera models and pictures.
