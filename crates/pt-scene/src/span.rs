//! Places in scene files, for messages.

use std::fmt;
use std::path::PathBuf;

/// A place in a file, as a person would look for it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Span {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1; 0 when the whole file is meant.
    pub line: u32,
    /// Column in characters, from 1; 0 when the whole line is meant.
    pub column: u32,
    /// The element, as the author knows it: `<polylist> of geometry "bunny"`; may be empty.
    pub element: String,
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
            if self.column > 0 {
                write!(f, ":{}", self.column)?;
            }
        }
        if self.element.is_empty() { Ok(()) } else { write!(f, ": {}", self.element) }
    }
}
