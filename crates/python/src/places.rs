//! Places in scenes that were made of values.

/// Names of parts of a scene that was made of values, for messages.
#[derive(Clone, Default)]
pub(crate) struct Places(Vec<(String, String)>);

impl Places {
    /// Names in place of others.
    pub(crate) fn new(names: Vec<(String, String)>) -> Self {
        Self(names)
    }

    /// Name of an element of the scene.
    pub(crate) fn of(&self, element: &str) -> String {
        let named = self.0.iter().find_map(|(from, to)| {
            let rest = element.strip_prefix(from.as_str())?;
            let is_whole = rest.is_empty() || rest.starts_with(['.', '[']);
            is_whole.then(|| format!("{to}{rest}"))
        });
        named.unwrap_or_else(|| element.to_owned())
    }

    /// Message about an element of the scene.
    pub(crate) fn message(&self, element: &str, message: &str) -> String {
        let place = self.of(element);
        let place = if place.is_empty() { "scene" } else { &place };
        format!("{place}: {message}")
    }
}
