//! Trees as bytes, to be kept in files.
//!
//! The bytes are: a mark, the version of the form, what the tree was built over and how, numbers
//! about it, the primitives and nodes, and a checksum of all that. All numbers are little-endian.
//! Reading believes nothing: a tree that was accepted can be asked anything, whoever made the
//! bytes, but only one made of [`Bvh::to_bytes`] finds the right answers.

pub(crate) mod codec;

use pt_math::Bounds3;
use thiserror::Error;

use self::codec::{Reader, Writer, checksum};
use crate::geometry::{Primitive, Sphere, in_range};
use crate::traverse::List;
use crate::wide::WideBvh;
use crate::{BuildOptions, Builder, Bvh, Kernel, Quality, Source, Statistics};

pub(crate) const MARK: [u8; 8] = *b"pt-bvh\r\n";
/// To be raised with every change of what follows.
pub(crate) const VERSION: u32 = 2;
const CHECKSUM_BYTES: usize = 8;

/// Why bytes are not a tree.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum ReadError {
    /// They do not begin as trees do.
    #[error("these are not the bytes of a tree")]
    Mark,
    /// They are of another version of this crate.
    #[error("the tree has version {found} of the form, but only {VERSION} can be read")]
    Version {
        /// Their version.
        found: u32,
    },
    /// They end too soon.
    #[error("the tree is cut off")]
    Truncated,
    /// They were changed on their way.
    #[error("the checksum of the tree is wrong")]
    Checksum,
    /// They have the right checksum, but describe no tree that queries could use.
    #[error("the tree is not valid: {what}")]
    Invalid {
        /// Description of the problem.
        what: &'static str,
    },
}

/// An error unless something holds.
pub(crate) fn ensure(holds: bool, what: &'static str) -> Result<(), ReadError> {
    if holds { Ok(()) } else { Err(ReadError::Invalid { what }) }
}

/// The place of a variant in a list of all, as which it is written.
fn place<T: PartialEq>(all: &[T], variant: &T) -> u32 {
    all.iter().take_while(|v| *v != variant).count() as u32
}

fn at_place<T: Copy>(all: &[T], place: u32, what: &'static str) -> Result<T, ReadError> {
    all.get(place as usize).copied().ok_or(ReadError::Invalid { what })
}

const BUILDERS: [Builder; 3] = [Builder::Sah, Builder::Mean, Builder::None];
const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Balanced, Quality::High];

impl Bvh {
    /// The whole tree as bytes, the same on every machine, for [`Self::from_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut w = Writer::default();
        w.0.reserve(self.statistics.bytes + 256);
        w.0.extend(MARK);
        w.u32(VERSION);
        self.source.write(&mut w);
        self.statistics.write(&mut w);
        match &self.kernel {
            Kernel::Wide(wide) => {
                w.bounds(&self.bounds);
                wide.write(&mut w);
            }
            Kernel::List(list) => list.write(&mut w),
        }
        let sum = checksum(&w.0);
        w.u64(sum);
        w.0
    }

    /// The tree of which these are the bytes; it gives the same bits for all queries. Hits refer to
    /// the primitives by number: see [`Self::primitives`].
    ///
    /// # Errors
    /// Bytes that [`Self::to_bytes`] did not make, all of them; those that were made up to look as
    /// if it had are refused too where a query could not bear them.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReadError> {
        let body = bytes.strip_prefix(&MARK).ok_or(ReadError::Mark)?;
        let found = Reader(body).u32()?;
        if found != VERSION {
            return Err(ReadError::Version { found });
        }
        let (content, sum) =
            bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or(ReadError::Truncated)?;
        if u64::from_le_bytes(*sum) != checksum(content) {
            return Err(ReadError::Checksum);
        }
        let start = MARK.len() + size_of_val(&VERSION);
        let mut r = Reader(content.get(start..).ok_or(ReadError::Truncated)?);
        let source = Source::read(&mut r)?;
        let mut statistics = Statistics::read(&mut r)?;
        ensure(
            u64::from(statistics.skipped) <= source.primitives(),
            "more skipped than there are",
        )?;
        let (kernel, bounds) = if source.options.builder == Builder::None {
            let list = List::read(&mut r, &source)?;
            let bounds = list.bounds();
            (Kernel::List(list), bounds)
        } else {
            let bounds = r.bounds()?;
            (Kernel::Wide(WideBvh::read(&mut r, &source, &bounds)?), bounds)
        };
        ensure(r.0.is_empty(), "something follows")?;
        statistics.bytes = kernel.bytes();
        Ok(Self { kernel, bounds, statistics, source })
    }
}

impl Source {
    fn write(&self, w: &mut Writer) {
        let BuildOptions { builder, quality, max_leaf_size } = self.options;
        let options = [place(&BUILDERS, &builder), place(&QUALITIES, &quality), max_leaf_size];
        w.u32s(&[self.triangles, self.spheres]);
        w.u32s(&options);
    }

    fn read(r: &mut Reader<'_>) -> Result<Self, ReadError> {
        let [triangles, spheres, builder, quality, max_leaf_size] = r.u32s()?;
        let builder = at_place(&BUILDERS, builder, "no such builder")?;
        let quality = at_place(&QUALITIES, quality, "no such quality")?;
        let options = BuildOptions { builder, quality, max_leaf_size };
        let source = Self { triangles, spheres, options };
        let most = crate::build::MAX_PRIMITIVES as u64;
        ensure(source.primitives() <= most, "too many primitives")?;
        Ok(source)
    }

    /// Returns true if this is the number of a triangle, or of a sphere, of the kind of
    /// `primitive`.
    pub(crate) fn has(&self, primitive: &Primitive, id: u32) -> bool {
        match primitive {
            Primitive::Triangle(_) => id < self.triangles,
            Primitive::Sphere(_) => id >= self.triangles && u64::from(id) < self.primitives(),
        }
    }
}

impl Statistics {
    /// All but `bytes`, which are those of the machine.
    fn write(&self, w: &mut Writer) {
        for x in [self.nodes, self.leaves, self.references] {
            w.u64(x as u64);
        }
        w.f32(self.sah_cost);
        w.u32s(&[self.depth, self.skipped]);
    }

    fn read(r: &mut Reader<'_>) -> Result<Self, ReadError> {
        let mut number = || r.u64().map(|x| x as usize);
        let (nodes, leaves, references) = (number()?, number()?, number()?);
        let sah_cost = r.f32()?;
        let [depth, skipped] = r.u32s()?;
        Ok(Self { nodes, leaves, references, bytes: 0, sah_cost, depth, skipped })
    }
}

impl List {
    fn write(&self, w: &mut Writer) {
        w.u64(self.primitives().len() as u64);
        for (primitive, id) in self.primitives() {
            w.u32(*id);
            match primitive {
                Primitive::Triangle(p) => p.iter().for_each(|&v| w.vector(v)),
                Primitive::Sphere(s) => {
                    w.vector(s.center);
                    w.f32(s.radius);
                }
            }
        }
    }

    fn read(r: &mut Reader<'_>, source: &Source) -> Result<Self, ReadError> {
        // A number, and four more for a sphere at least.
        let count = r.count(20)?;
        let mut primitives = Vec::with_capacity(count);
        for _ in 0..count {
            let id = r.u32()?;
            let primitive = if id < source.triangles {
                Primitive::Triangle([r.vector()?, r.vector()?, r.vector()?])
            } else {
                Primitive::Sphere(Sphere { center: r.vector()?, radius: r.f32()? })
            };
            ensure(source.has(&primitive, id), "a primitive that does not exist")?;
            ensure(primitive.bounds().is_some(), "an unusable primitive")?;
            primitives.push((primitive, id));
        }
        Ok(Self::of(primitives))
    }
}

/// Tests that the box of a scene is finite and not inside out.
pub(crate) fn ensure_scene(bounds: &Bounds3) -> Result<(), ReadError> {
    // Spheres reach as far again beyond the largest coordinate, and their boxes are rounded.
    let fits = in_range(bounds.min / 4.0) && in_range(bounds.max / 4.0);
    ensure(!bounds.is_empty() && fits, "a box of the scene that is none")
}
