//! Values that refer to arrays and contents of files in memory.

use pt_scene::Shared;

use super::attached::{ATTACHED, Attachment, Numbers, shown};
use super::node::JsonNode;
use crate::LoadError;

/// Rows of numbers of an array.
type Rows<T, const N: usize> = Result<Shared<[T; N]>, LoadError>;

impl JsonNode<'_> {
    /// Number of the attachment to which the value refers.
    fn attached_number(&self) -> Option<usize> {
        let object = self.value().as_object()?;
        object.get_number(ATTACHED)?.value.parse().ok()
    }

    /// Describes the attachment to which the value refers, if it does.
    pub(super) fn described_attachment(&self) -> Option<String> {
        self.document().attachments.with(self.attached_number()?, Attachment::described)
    }

    /// Content of a file in memory, if that is the value.
    pub(super) fn content(&self) -> Option<Vec<u8>> {
        let number = self.attached_number()?;
        let is_content = |attached: &Attachment| matches!(attached, Attachment::Content(_));
        if !self.document().attachments.with(number, is_content)? {
            return None;
        }
        match self.document().attachments.take(number)? {
            Attachment::Content(bytes) => Some(bytes),
            Attachment::Array { .. } => None,
        }
    }

    /// Shape and numbers of the array to which the value refers, if it does.
    pub(super) fn array(&self) -> Option<(Vec<usize>, Numbers)> {
        let number = self.attached_number()?;
        let is_array = |attached: &Attachment| matches!(attached, Attachment::Array { .. });
        if !self.document().attachments.with(number, is_array)? {
            return None;
        }
        match self.document().attachments.take(number)? {
            Attachment::Array { shape, numbers } => Some((shape, numbers)),
            Attachment::Content(_) => None,
        }
    }

    /// Rows of finite numbers, if the value refers to an array.
    pub(super) fn rows_of_reals<const N: usize>(&self) -> Option<Rows<f32, N>> {
        let (shape, numbers) = self.array()?;
        Some(self.check_rows::<N>(&shape).and_then(|()| Ok(rows(self.reals(numbers, N)?))))
    }

    /// Rows of whole numbers, if the value refers to an array.
    pub(super) fn rows_of_wholes<const N: usize>(&self) -> Option<Rows<u32, N>> {
        let (shape, numbers) = self.array()?;
        Some(self.check_rows::<N>(&shape).and_then(|()| Ok(rows(self.wholes(numbers, N)?))))
    }

    fn check_rows<const N: usize>(&self, shape: &[usize]) -> Result<(), LoadError> {
        if matches!(shape, [_, width] if *width == N) {
            return Ok(());
        }
        Err(self.error(format!("found an array of shape {}, expected (n, {N})", shown(shape))))
    }

    /// Finite numbers of an array with rows of `width`.
    pub(super) fn reals(&self, numbers: Numbers, width: usize) -> Result<Shared<f32>, LoadError> {
        let reals = match numbers {
            Numbers::Reals(reals) => reals,
            Numbers::Wholes(wholes) => wholes.into_iter().map(|whole| whole as f32).collect(),
            Numbers::Integers(integers) => integers.into_iter().map(|i| i as f32).collect(),
            Numbers::Levels(levels) => levels.into_iter().map(f32::from).collect(),
        };
        match reals.iter().position(|x| !x.is_finite()) {
            None => Ok(reals),
            Some(at) => Err(self.error(format!(
                "found {} in row {}, expected finite numbers of single precision",
                reals[at],
                at / width.max(1)
            ))),
        }
    }

    /// Whole numbers of an array with rows of `width`.
    fn wholes(&self, numbers: Numbers, width: usize) -> Result<Shared<u32>, LoadError> {
        let wrong = |found: String, at: usize| {
            self.error(format!(
                "found {found} in row {}, expected whole numbers from 0 to 4294967295",
                at / width.max(1)
            ))
        };
        match numbers {
            Numbers::Wholes(wholes) => Ok(wholes),
            Numbers::Levels(levels) => Ok(levels.into_iter().map(u32::from).collect()),
            Numbers::Integers(integers) => {
                let each = integers.iter().enumerate();
                each.map(|(at, i)| u32::try_from(*i).map_err(|_| wrong(i.to_string(), at)))
                    .collect()
            }
            Numbers::Reals(_) => {
                Err(self.error("found an array of real numbers, expected one of integers"))
            }
        }
    }

    /// The error about the shape of an array.
    pub(super) fn wrong_shape(&self, shape: &[usize], expected: &str) -> LoadError {
        self.error(format!("found an array of shape {}, expected {expected}", shown(shape)))
    }
}

/// Rows of numbers in the memory of the numbers.
struct RowsOf<T>(Shared<T>);

impl<T, const N: usize> AsRef<[[T; N]]> for RowsOf<T> {
    fn as_ref(&self) -> &[[T; N]] {
        self.0.as_chunks::<N>().0
    }
}

/// Groups numbers into rows, without a copy.
pub(super) fn rows<T: Send + Sync + 'static, const N: usize>(numbers: Shared<T>) -> Shared<[T; N]> {
    Shared::lent(RowsOf(numbers))
}
