//! Errors of mesh files, reported all at once.
//!
//! A reader of meshes records an error of a statement or a row, and continues with a replacement,
//! so that the following data keep their meaning. Pieces of a file that are read in parallel have
//! separate lists, which are concatenated in file order.

use super::context::LoadContext;
use crate::LoadError;

/// Errors of a file, or of a piece of one: the first ones in file order.
#[derive(Debug, Default)]
pub(crate) struct MeshDiagnostics {
    list: Vec<LoadError>,
    /// Errors without further consequences in a file that is a scene by itself, with the action
    /// taken instead.
    pardoned: Vec<(LoadError, &'static str)>,
}

impl MeshDiagnostics {
    /// Maximum number of errors that are kept; no list of errors has more.
    pub(crate) const MAX: usize = LoadContext::MAX_NOTED;

    /// Adds an error after all others, up to [`Self::MAX`].
    pub(crate) fn add(&mut self, fault: LoadError) {
        if !self.is_full() {
            self.list.push(fault);
        }
    }

    /// Adds an error without further consequences, up to [`Self::MAX`]; see
    /// [`LoadContext::forgive`].
    pub(crate) fn pardon(&mut self, fault: LoadError, instead: &'static str) {
        if self.pardoned.len() < Self::MAX {
            self.pardoned.push((fault, instead));
        }
    }

    /// Returns true if the maximum is reached, so that the read should end.
    pub(crate) fn is_full(&self) -> bool {
        self.list.len() >= Self::MAX
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Appends the errors of the piece that follows.
    pub(crate) fn append(&mut self, more: Self) {
        self.list.extend(more.list);
        self.list.truncate(Self::MAX);
        self.pardoned.extend(more.pardoned);
        self.pardoned.truncate(Self::MAX);
    }

    /// Adds errors that another pass found in the same lines, and sorts all by line.
    pub(crate) fn merge(&mut self, others: Self) {
        self.list.extend(others.list);
        self.list.sort_by_key(place);
        self.list.truncate(Self::MAX);
        self.pardoned.extend(others.pardoned);
        self.pardoned.sort_by_key(|(fault, _)| place(fault));
        self.pardoned.truncate(Self::MAX);
    }

    /// Returns all of them as errors.
    fn into_errors(mut self) -> Vec<LoadError> {
        self.list.extend(self.pardoned.into_iter().map(|(fault, _)| fault));
        self.list.sort_by_key(place);
        self.list
    }

    /// Returns the error that ends the read, or [`LoadError::AlreadyReported`] if there are other
    /// errors that may be its cause.
    pub(crate) fn because_of(&self, error: LoadError) -> LoadError {
        if self.is_empty() { error } else { LoadError::AlreadyReported }
    }
}

/// Returns the line and the column of an error.
fn place(error: &LoadError) -> Option<(u32, u32)> {
    error.place().map(|at| (at.line, at.column))
}

/// Reads a file that is a scene by itself: all errors are recorded individually in the context.
///
/// # Errors
/// Returns an error if nothing more can be read.
pub(crate) fn of_scene<T>(
    context: &LoadContext,
    read: impl FnOnce(&mut MeshDiagnostics) -> Result<T, LoadError>,
) -> Result<T, LoadError> {
    let mut faults = MeshDiagnostics::default();
    let done = read(&mut faults);
    for fault in faults.list {
        context.ok_or_report(Err::<(), _>(fault))?;
    }
    for (fault, instead) in faults.pardoned {
        let forgiven = context.forgive(Err::<(), _>(fault), instead);
        context.ok_or_report(forgiven)?;
    }
    done
}

/// Reads a file that is part of a scene.
///
/// # Errors
/// Returns the first error, with the number of others.
pub(crate) fn of_part<T>(
    read: impl FnOnce(&mut MeshDiagnostics) -> Result<T, LoadError>,
) -> Result<T, LoadError> {
    let mut faults = MeshDiagnostics::default();
    let done = read(&mut faults);
    let (value, last) = match done {
        Ok(value) => (Some(value), None),
        Err(LoadError::AlreadyReported) => (None, None),
        Err(error) => (None, Some(error)),
    };
    let is_all = !faults.is_full();
    let mut all = faults.into_errors().into_iter().chain(last);
    let first = match (all.next(), value) {
        (None, Some(value)) => return Ok(value),
        (first, _) => first.unwrap_or(LoadError::AlreadyReported),
    };
    Err(match (all.count(), first) {
        (more @ 1.., LoadError::Content { at, message }) => {
            let (least, s) =
                (if is_all { "" } else { "at least " }, if more > 1 { "s" } else { "" });
            let message = format!(
                "{message}; {least}{more} more error{s} in this file, listed by `pathtracer check`"
            );
            LoadError::Content { at, message }
        }
        (_, first) => first,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::mesh_file::error;
    use super::*;

    fn fault(line: u32) -> LoadError {
        error(Path::new("a.obj"), line, "bad")
    }

    fn lines(faults: &MeshDiagnostics) -> Vec<u32> {
        faults.list.iter().map(|fault| fault.place().map_or(0, |at| at.line)).collect()
    }

    #[test]
    fn lists_hold_the_first_faults_in_the_order_of_lines() {
        let mut faults = MeshDiagnostics::default();
        (1..=3).for_each(|i| faults.add(fault(10 * i)));
        let mut others = MeshDiagnostics::default();
        (0..4000).for_each(|i| others.add(fault(2 * i + 1)));
        assert!(others.is_full() && !faults.is_full());
        faults.merge(others);
        assert_eq!(lines(&faults)[..8], [1, 3, 5, 7, 9, 10, 11, 13]);
        assert_eq!(lines(&faults).len(), MeshDiagnostics::MAX);
    }

    #[test]
    fn a_part_of_a_scene_reports_its_first_fault_and_how_many_there_are() {
        let reported = |count: u32, end: Result<(), LoadError>| {
            let read = |faults: &mut MeshDiagnostics| {
                (1..=count).for_each(|line| faults.add(fault(line)));
                end
            };
            of_part(read).err().map(|error| error.to_string())
        };
        let more = |count: &str| {
            format!("a.obj:1: bad; {count} in this file, listed by `pathtracer check`")
        };
        assert_eq!(reported(0, Ok(())), None);
        assert_eq!(reported(1, Ok(())), Some("a.obj:1: bad".to_owned()));
        assert_eq!(reported(1, Err(LoadError::AlreadyReported)), Some("a.obj:1: bad".to_owned()));
        assert_eq!(reported(0, Err(fault(7))), Some("a.obj:7: bad".to_owned()));
        assert_eq!(reported(1, Err(fault(7))), Some(more("1 more error")));
        assert_eq!(reported(3, Ok(())), Some(more("2 more errors")));
        assert_eq!(reported(5000, Ok(())), Some(more("at least 999 more errors")));
    }
}
