//! What can be wrong with settings, robots and scenarios that are handed to navigation.

/// Something that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NavigationError {
    /// A number that cannot be.
    #[error("{field}: {found}; expected {expected}")]
    Value {
        /// The path of the value.
        field: &'static str,
        /// What is there.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// No scenario of that name is known.
    #[error("no scenario is called \"{name}\"; expected one of {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// The robot that walks a scenario cannot go on.
    #[error("{0}")]
    Body(String),
}
