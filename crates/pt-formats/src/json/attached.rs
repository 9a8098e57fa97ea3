//! Arrays and contents of files that belong to a scene in memory, beside its text: large meshes
//! and images have no digits then.
//!
//! In the text, `{"$attached": 2}` is in place of a list, or of the path of a file.

use std::cell::RefCell;
use std::fmt::Write as _;

use pt_scene::Shared;

use super::printer::Out;
use crate::shared::source::hash_of;

/// Key of a reference to an attachment.
pub(super) const ATTACHED: &str = "$attached";
/// Key of the hash of the attachment, so that the text determines the scene.
const HASH: &str = "blake3";

/// Numbers of an array, in row order.
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// Real numbers.
    Reals(Shared<f32>),
    /// Whole numbers.
    Wholes(Shared<u32>),
    /// Integers, some of which are negative or larger than 32 bits.
    Integers(Vec<i64>),
    /// Levels of pixels from 0 to 255, or whole numbers.
    Levels(Vec<u8>),
}

/// An array in place of a list, or the content of a file in place of its path.
#[derive(Clone, Debug, PartialEq)]
pub enum Attachment {
    /// An array.
    Array {
        /// Number of items along each dimension, the last of which varies fastest.
        shape: Vec<usize>,
        /// The numbers; as many as the shape has.
        numbers: Numbers,
    },
    /// Content of a file.
    Content(Vec<u8>),
}

impl Attachment {
    /// Bytes of the content or of the numbers.
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Content(bytes) | Self::Array { numbers: Numbers::Levels(bytes), .. } => bytes,
            Self::Array { numbers: Numbers::Reals(numbers), .. } => bytemuck::cast_slice(numbers),
            Self::Array { numbers: Numbers::Wholes(numbers), .. } => bytemuck::cast_slice(numbers),
            Self::Array { numbers: Numbers::Integers(numbers), .. } => {
                bytemuck::cast_slice(numbers)
            }
        }
    }

    pub(super) fn described(&self) -> String {
        match self {
            Self::Content(bytes) => format!("{} bytes", bytes.len()),
            Self::Array { shape, numbers } => {
                let kind = match numbers {
                    Numbers::Reals(_) => "real numbers",
                    Numbers::Wholes(_) | Numbers::Integers(_) | Numbers::Levels(_) => "integers",
                };
                format!("an array of {kind} of shape {}", shown(shape))
            }
        }
    }
}

/// Shape in the notation of NumPy.
pub(super) fn shown(shape: &[usize]) -> String {
    let counts: Vec<_> = shape.iter().map(ToString::to_string).collect();
    match counts.as_slice() {
        [one] => format!("({one},)"),
        _ => format!("({})", counts.join(", ")),
    }
}

/// A scene in memory: its text, and the attachments to which it refers by number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneValues {
    /// Text of a scene file.
    pub text: String,
    /// Attachments.
    pub attachments: Vec<Attachment>,
}

impl SceneValues {
    /// Appends an attachment, and its reference to the text.
    pub fn attach(&mut self, attachment: Attachment) {
        let hash = hash_of(attachment.bytes());
        let number = self.attachments.len();
        let _ = write!(self.text, "{{\"{ATTACHED}\":{number},\"{HASH}\":\"{hash}\"}}");
        self.attachments.push(attachment);
    }
}

/// Attachments of a text that is read; each is used once.
#[derive(Default)]
pub(super) struct Attachments(RefCell<Vec<Option<Attachment>>>);

impl Attachments {
    pub(super) fn new(all: Vec<Attachment>) -> Self {
        Self(RefCell::new(all.into_iter().map(Some).collect()))
    }

    /// Removes an attachment; `None` if there is none of this number.
    pub(super) fn take(&self, number: usize) -> Option<Attachment> {
        self.0.borrow_mut().get_mut(number)?.take()
    }

    /// Calls `f` with an attachment, if there is one of this number.
    pub(super) fn with<T>(&self, number: usize, f: impl FnOnce(&Attachment) -> T) -> Option<T> {
        self.0.borrow().get(number)?.as_ref().map(f)
    }
}

/// Reference to an attachment in the text.
pub(super) fn reference(number: usize) -> Out {
    Out::Object(vec![(ATTACHED.to_owned(), Out::Number(number.to_string()))])
}
