//! Central camera models.
