//! Parameters that a reader requests from an object by name.

use crate::shared::names::{meant, quote};

/// A parameter of an object.
pub(crate) trait NamedParameter {
    /// Name, as written.
    fn name(&self) -> &str;
}

/// Names that a reader requests from an object, so that all other parameters can be rejected.
#[derive(Clone, Debug, Default)]
pub(crate) struct RequestedParameters {
    requested: Vec<&'static str>,
    ignored: Vec<&'static str>,
}

impl RequestedParameters {
    /// Requests a parameter; `None` if it is not specified.
    pub(crate) fn find<'p, P: NamedParameter>(
        &mut self,
        parameters: &'p [P],
        name: &'static str,
    ) -> Option<&'p P> {
        if !self.requested.contains(&name) {
            self.requested.push(name);
        }
        parameters.iter().find(|parameter| parameter.name() == name)
    }

    /// Accepts parameters without an effect.
    pub(crate) fn ignore(&mut self, names: &[&'static str]) {
        self.ignored.extend(names);
    }

    /// Returns the first parameter that was neither requested nor ignored, with a message about it.
    /// `owner` describes the object.
    pub(crate) fn unknown<'p, P: NamedParameter>(
        &self,
        mut parameters: impl Iterator<Item = &'p P>,
        owner: &str,
    ) -> Option<(&'p P, String)> {
        let Self { requested, ignored } = self;
        let is_known = |name| requested.contains(&name) || ignored.contains(&name);
        let unknown = parameters.find(|parameter| !is_known(parameter.name()))?;
        let name = unknown.name();
        let supported = if requested.is_empty() { "none".to_owned() } else { requested.join(", ") };
        let near = meant(name, requested.iter().copied());
        let name = quote(name);
        let message =
            format!("unsupported parameter {name} of {owner}{near}; supported: {supported}");
        Some((unknown, message))
    }
}

/// Returns a number that must be above 0.
///
/// # Errors
/// A message with the name and the number.
pub(crate) fn above_zero(name: &str, x: f64) -> Result<f64, String> {
    if x > 0.0 {
        return Ok(x);
    }
    Err(format!("found {} = {x}, expected a number above 0", quote(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    impl NamedParameter for &str {
        fn name(&self) -> &str {
            self
        }
    }

    #[test]
    fn parameters_that_nobody_requests_are_unknown() {
        let parameters = ["radius", "colour", "unused"];
        let mut requested = RequestedParameters::default();
        assert_eq!(requested.find(&parameters, "radius"), Some(&"radius"));
        assert_eq!(requested.find(&parameters, "color"), None);
        requested.ignore(&["unused"]);
        let (unknown, message) = requested.unknown(parameters.iter(), "a lamp").expect("one");
        assert_eq!(*unknown, "colour");
        let near = "unsupported parameter \"colour\" of a lamp (did you mean \"color\"?)";
        assert_eq!(message, format!("{near}; supported: radius, color"));
        assert!(requested.unknown(parameters[..1].iter(), "a lamp").is_none());
    }
}
