//! Serialization of trees, for storage in files.
//!
//! The bytes are: a mark, the version of the format, the numbers of primitives and the options of
//! the build, statistics, the primitives and nodes, and a checksum. All numbers are little-endian.
//! The reader trusts nothing: every accepted tree is safe for all queries, whatever the origin of
//! the bytes, but only output of [`Bvh::to_bytes`] gives correct hits.

use crate::codec::{ByteReader, ByteWriter, ReadError, VERSION, checksum, ensure};
use crate::geometry::{Primitive, Sphere};
use crate::traverse::List;
use crate::wide::WideBvh;
use crate::{BuildOptions, BuildSource, Builder, Bvh, BvhStatistics, Kernel, Quality};

pub(crate) const MARK: [u8; 8] = *b"pt-bvh\r\n";
const CHECKSUM_BYTES: usize = 8;

/// Index of a variant in a list of all, by which it is serialized.
fn place<T: PartialEq>(all: &[T], variant: &T) -> u32 {
    all.iter().take_while(|v| *v != variant).count() as u32
}

fn at_place<T: Copy>(all: &[T], place: u32, what: &'static str) -> Result<T, ReadError> {
    all.get(place as usize).copied().ok_or(ReadError::Invalid { what })
}

const BUILDERS: [Builder; 3] = [Builder::Sah, Builder::Mean, Builder::None];
const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Balanced, Quality::High];

impl Bvh {
    /// Serializes the tree for [`Self::from_bytes`]; the bytes are the same on every machine.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut w = ByteWriter::default();
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

    /// Parses a tree, which returns the same bits for all queries as the original. Hits refer to
    /// the primitives by number: see [`Self::primitives`].
    ///
    /// # Errors
    /// Bytes that are not the complete output of [`Self::to_bytes`]. Forged bytes with a valid
    /// checksum are also rejected if they are not safe for queries.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReadError> {
        let body = bytes.strip_prefix(&MARK).ok_or(ReadError::Mark)?;
        let found = ByteReader(body).u32()?;
        if found != VERSION {
            return Err(ReadError::Version { found });
        }
        let (content, sum) =
            bytes.split_last_chunk::<CHECKSUM_BYTES>().ok_or(ReadError::Truncated)?;
        if u64::from_le_bytes(*sum) != checksum(content) {
            return Err(ReadError::Checksum);
        }
        let start = MARK.len() + size_of_val(&VERSION);
        let mut r = ByteReader(content.get(start..).ok_or(ReadError::Truncated)?);
        let source = BuildSource::read(&mut r)?;
        let mut statistics = BvhStatistics::read(&mut r)?;
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

impl BuildSource {
    fn write(&self, w: &mut ByteWriter) {
        let BuildOptions { builder, quality, max_leaf_size } = self.options;
        let options = [place(&BUILDERS, &builder), place(&QUALITIES, &quality), max_leaf_size];
        w.u32s(&[self.triangles, self.spheres]);
        w.u32s(&options);
    }

    fn read(r: &mut ByteReader<'_>) -> Result<Self, ReadError> {
        let [triangles, spheres, builder, quality, max_leaf_size] = r.u32s()?;
        let builder = at_place(&BUILDERS, builder, "no such builder")?;
        let quality = at_place(&QUALITIES, quality, "no such quality")?;
        let options = BuildOptions { builder, quality, max_leaf_size };
        let source = Self { triangles, spheres, options };
        let most = crate::build::MAX_PRIMITIVES as u64;
        ensure(source.primitives() <= most, "too many primitives")?;
        Ok(source)
    }

    /// Returns true if `id` is the number of a primitive of the same kind as `primitive`.
    pub(crate) fn has(&self, primitive: &Primitive, id: u32) -> bool {
        match primitive {
            Primitive::Triangle(_) => id < self.triangles,
            Primitive::Sphere(_) => id >= self.triangles && u64::from(id) < self.primitives(),
        }
    }
}

impl BvhStatistics {
    /// Writes all fields but `bytes`, which depends on the machine.
    fn write(&self, w: &mut ByteWriter) {
        for x in [self.nodes, self.leaves, self.references] {
            w.u64(x as u64);
        }
        w.f32(self.sah_cost);
        w.u32s(&[self.depth, self.skipped]);
    }

    fn read(r: &mut ByteReader<'_>) -> Result<Self, ReadError> {
        let mut number = || r.u64().map(|x| x as usize);
        let (nodes, leaves, references) = (number()?, number()?, number()?);
        let sah_cost = r.f32()?;
        let [depth, skipped] = r.u32s()?;
        Ok(Self { nodes, leaves, references, bytes: 0, sah_cost, depth, skipped })
    }
}

impl List {
    fn write(&self, w: &mut ByteWriter) {
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

    fn read(r: &mut ByteReader<'_>, source: &BuildSource) -> Result<Self, ReadError> {
        // An id, and at least four more numbers for a sphere.
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
