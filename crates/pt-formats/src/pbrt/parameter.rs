//! Parameters of directives.

use std::cell::Cell;

use crate::pbrt::position::TokenPosition;

/// A parameter such as `"float radius" 0.5`.
#[derive(Clone, Debug)]
pub(super) struct ParsedParameter {
    /// Type of its values, as written: `float`, `rgb` …
    pub(super) kind: &'static str,
    pub(super) name: String,
    pub(super) values: ParameterValues,
    pub(super) at: TokenPosition,
    /// True if it comes from an `Attribute`, and may therefore be unknown to the directive.
    pub(super) is_default: bool,
    pub(super) was_read: Cell<bool>,
}

/// The values of a parameter.
#[derive(Clone, Debug)]
pub(super) enum ParameterValues {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
    Booleans(Vec<bool>),
}
