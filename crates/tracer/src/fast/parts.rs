//! The parts of version 2 of the language that a build may be without.
//!
//! A part that is left out is not compiled into the steps that have it. Scenes that need it are refused
//! ([`super::left_out`]).

/// Which parts there are.
pub(super) struct Parts {
    pub(super) planes: bool,
    pub(super) discs: bool,
    /// Cylinders too.
    pub(super) cones: bool,
    pub(super) tori: bool,
    /// Boxes of groups that are not turned by right angles.
    pub(super) turned_boxes: bool,
    pub(super) groups: bool,
    pub(super) highlights: bool,
    pub(super) patterns: bool,
    pub(super) lamps: bool,
    pub(super) skies: bool,
    pub(super) srgb: bool,
    pub(super) samples: bool,
    pub(super) lenses: bool,
    pub(super) shutters: bool,
    /// Of lights.
    pub(super) extents: bool,
}

/// Which this build has.
pub(super) const BUILT: Parts = Parts {
    planes: cfg!(feature = "planes"),
    discs: cfg!(feature = "discs"),
    cones: cfg!(feature = "cones"),
    tori: cfg!(feature = "tori"),
    turned_boxes: cfg!(feature = "turned-boxes"),
    groups: cfg!(feature = "groups"),
    highlights: cfg!(feature = "highlights"),
    patterns: cfg!(feature = "patterns"),
    lamps: cfg!(feature = "lamps"),
    skies: cfg!(feature = "skies"),
    srgb: cfg!(feature = "srgb"),
    samples: cfg!(feature = "samples"),
    lenses: cfg!(feature = "lenses"),
    shutters: cfg!(feature = "shutters"),
    extents: cfg!(feature = "extents"),
};
