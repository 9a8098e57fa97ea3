//! State of reading and writing a file.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_scene::image::Image;
use pt_scene::measured::Measurements;
use pt_scene::medium::Grid;
use pt_scene::{IesProfile, Mesh, Motion, Points, Texture};

use crate::error::LoadError;
use crate::json::attached::{self, Attachment, Numbers};
use crate::json::node::JsonNode;
use crate::json::printer::{Entries, Out};
use crate::shared::context::LoadContext;

/// State of reading a file.
pub(super) struct JsonReader<'a> {
    /// Folder to which paths are relative.
    pub(super) folder: &'a Path,
    pub(super) context: &'a LoadContext,
    /// Name of the table entry that is read, which is the default of its own name.
    pub(super) key: String,
    /// Aspect ratio of the image, for cameras with one angle.
    pub(super) aspect: f64,
    pub(super) materials: HashMap<String, u32>,
    pub(super) media: HashMap<String, u32>,
    pub(super) tables: EntryTables,
    /// Files that were read, by type.
    pub(super) files: FileCache,
    /// Table entries with an error or a missing file, by the names of table and entry.
    pub(super) failed: HashSet<(&'static str, String)>,
}

/// Entries of each table.
#[derive(Default)]
pub(super) struct EntryTables {
    pub(super) meshes: HashMap<String, Arc<Mesh>>,
    pub(super) points: HashMap<String, Arc<Points>>,
    pub(super) images: HashMap<String, Arc<Image>>,
    pub(super) textures: HashMap<String, Arc<Texture>>,
    pub(super) grids: HashMap<String, Arc<Grid>>,
    pub(super) profiles: HashMap<String, Arc<IesProfile>>,
    pub(super) measurements: HashMap<String, Arc<Measurements>>,
    pub(super) motions: HashMap<String, Arc<Motion>>,
}

/// Contents of files, so that each file is read once per use.
#[derive(Default)]
pub(super) struct FileCache {
    pub(super) meshes: HashMap<(PathBuf, String), Arc<Mesh>>,
    pub(super) points: HashMap<PathBuf, Arc<Points>>,
    pub(super) images: HashMap<(PathBuf, bool), Arc<Image>>,
    pub(super) grids: HashMap<PathBuf, Arc<Grid>>,
    pub(super) profiles: HashMap<PathBuf, Arc<IesProfile>>,
    /// Number of bytes in memory so far.
    pub(super) bytes: u64,
}

impl<'a> JsonReader<'a> {
    pub(super) fn new(folder: &'a Path, context: &'a LoadContext) -> Self {
        Self {
            folder,
            context,
            key: String::new(),
            aspect: 1.0,
            materials: HashMap::new(),
            media: HashMap::new(),
            tables: EntryTables::default(),
            files: FileCache::default(),
            failed: HashSet::new(),
        }
    }

    /// Records that a table entry cannot be used, and that its error was reported.
    pub(super) fn fail(&mut self, table: &'static str, name: &str) {
        self.failed.insert((table, name.to_owned()));
    }

    /// Returns the error about a name that is not in a table; `what` is the term for one of its
    /// entries.
    pub(super) fn unknown<T>(
        &self,
        node: &JsonNode<'_>,
        (table, what): (&'static str, &str),
        name: &str,
        known: &HashMap<String, T>,
    ) -> LoadError {
        if self.failed.contains(&(table, name.to_owned())) {
            return LoadError::AlreadyReported;
        }
        node.unknown(what, name, sorted(known).into_iter())
    }

    /// Reads a file to which the scene refers.
    pub(super) fn read(&self, path: &Path, node: &JsonNode<'_>) -> Result<Vec<u8>, LoadError> {
        self.context.read(path).map_err(|message| node.error(message))
    }

    /// Counts the memory of the contents of files.
    ///
    /// # Errors
    /// Returns an error if it exceeds the maximum of a scene.
    pub(super) fn account(&mut self, bytes: usize, node: &JsonNode<'_>) -> Result<(), LoadError> {
        const MAX_BYTES: u64 = 1 << 35;
        self.files.bytes = self.files.bytes.saturating_add(bytes as u64);
        if self.files.bytes <= MAX_BYTES {
            return Ok(());
        }
        Err(node.error("meshes, images and grids up to this file exceed 32 GiB"))
    }

    /// Returns the path of a file to which the scene refers.
    pub(super) fn path(&self, node: &JsonNode<'_>) -> Result<PathBuf, LoadError> {
        let name = node.text().filter(|name| !name.is_empty());
        Ok(self.folder.join(name.ok_or_else(|| node.unexpected("the path of a file"))?))
    }
}

/// A file to write beside the scene.
pub(super) struct OutFile {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
}

/// State of writing a file.
#[derive(Default)]
pub(super) struct JsonWriter<'a> {
    /// Folder of files beside the scene, as a path of the scene file.
    pub(super) folder: String,
    /// See [`JsonReader::key`].
    pub(super) key: String,
    pub(super) materials: &'a [String],
    pub(super) media: &'a [String],
    /// Entries of each table, in order of first use.
    pub(super) tables: HashMap<&'static str, Entries>,
    pub(super) files: Vec<OutFile>,
    /// Arrays and contents of files of a scene in memory, which has no files beside it.
    pub(super) attachments: Option<Vec<Attachment>>,
    /// Names of table entries, by address.
    pub(super) names: HashMap<(&'static str, usize), String>,
    pub(super) taken: HashMap<&'static str, Unique>,
    /// True if entries of tables are written in place of their names.
    pub(super) is_inline: bool,
}

impl<'a> JsonWriter<'a> {
    /// Creates the state for a scene with these names of materials and media.
    pub(super) fn new(folder: String, materials: &'a [String], media: &'a [String]) -> Self {
        Self { folder, materials, media, ..Self::default() }
    }

    /// The same for a scene that stays in memory.
    pub(super) fn in_memory(materials: &'a [String], media: &'a [String]) -> Self {
        Self { attachments: Some(Vec::new()), ..Self::new(String::new(), materials, media) }
    }

    /// Returns true if the scene stays in memory.
    pub(super) fn is_in_memory(&self) -> bool {
        self.attachments.is_some()
    }

    /// Attaches an array to a scene in memory, and returns the reference to it.
    pub(super) fn array(&mut self, shape: &[usize], numbers: Numbers) -> Out {
        self.attach(Attachment::Array { shape: shape.to_vec(), numbers })
    }

    fn attach(&mut self, attachment: Attachment) -> Out {
        let all = self.attachments.get_or_insert_default();
        all.push(attachment);
        attached::reference(all.len() - 1)
    }

    /// Adds a file beside the scene, and returns its path; in memory, attaches its content.
    pub(super) fn file(&mut self, name: &str, ending: &str, bytes: Vec<u8>) -> Out {
        if self.is_in_memory() {
            return self.attach(Attachment::Content(bytes));
        }
        let is_safe = |c: char| c.is_alphanumeric() || "-_".contains(c);
        let safe: String =
            name.chars().map(|c| if is_safe(c) { c } else { '_' }).take(60).collect();
        let stem = self.taken.entry("files").or_default().name(&safe.to_lowercase(), "file");
        let name = format!("{stem}.{ending}");
        let path = format!("{}/{name}", self.folder);
        self.files.push(OutFile { name, bytes });
        Out::Text(path)
    }
}

/// Generator of unique names.
#[derive(Default)]
pub(super) struct Unique(HashSet<String>, HashMap<String, usize>);

impl Unique {
    /// Returns the wanted name, with a number if it is taken; `otherwise` replaces an empty name.
    pub(super) fn name(&mut self, wanted: &str, otherwise: &str) -> String {
        let wanted = if wanted.is_empty() { otherwise } else { wanted };
        let mut name = wanted.to_owned();
        let count = self.1.entry(wanted.to_owned()).or_insert(1);
        while !self.0.insert(name.clone()) {
            *count += 1;
            name = format!("{wanted}_{count}");
        }
        name
    }
}

fn sorted<T>(table: &HashMap<String, T>) -> Vec<&str> {
    let mut names: Vec<_> = table.keys().map(String::as_str).collect();
    names.sort_unstable();
    names
}
