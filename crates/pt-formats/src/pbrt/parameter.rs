//! Parameters of directives.

use crate::pbrt::position::TokenPosition;
use crate::shared::parameters::NamedParameter;

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
}

impl NamedParameter for ParsedParameter {
    fn name(&self) -> &str {
        &self.name
    }
}

/// The values of a parameter.
#[derive(Clone, Debug)]
pub(super) enum ParameterValues {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
    Booleans(Vec<bool>),
}
