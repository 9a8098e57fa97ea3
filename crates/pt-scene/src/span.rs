//! Locations in scene files, for messages.

use std::fmt;
use std::path::PathBuf;

/// A location in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Span {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1; 0 for the whole file.
    pub line: u32,
    /// Column in characters, from 1; 0 for the whole line.
    pub column: u32,
    /// Name of the element in the file, such as `<polylist> of geometry "bunny"`; may be empty.
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
